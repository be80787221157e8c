"""Turns near borders and ponds and searches where no word fits, swept with Shapely."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine, combine_outline
from sightfield.systems.numerics.harvest.paths import MachinePath
from sightfield.systems.numerics.harvest.turns.borders import StandingCrop
from sightfield.systems.numerics.harvest.turns.ground import Ground, Motion
from sightfield.systems.numerics.harvest.turns.turn import (
    combine_footprint,
    path_of_pieces,
    search_lattice,
    turn_between,
    turn_times,
)

COMBINE = Combine(header_width=7.5, turning_radius=6.5, length=7.0)
BENT = shapely.LineString([(-9, 0), (40, 0), (40, 40), (80, 40), (80, -9)])
CORRIDOR = BENT.buffer(7, join_style="mitre")
NECK = shapely.union_all(
    [shapely.box(0, 0, 40, 40), shapely.box(40, 14, 70, 26), shapely.box(70, -30, 110, 60)]
)
WALLS = shapely.union_all([shapely.box(40, 30, 200, 280), shapely.box(220, -5, 240, 250)])
YARD = shapely.box(0, 0, 300, 300).difference(WALLS)
CASES = {
    "corridor": (CORRIDOR, (0, 0, 0), (80, 4, -math.pi / 2)),
    "neck": (NECK, (10, 10, 1.0), (100, 50, 2.0)),
    "yard": (YARD, (20, 20, 0.3), (280, 20, 0.2)),
    "row": (shapely.box(0, 0, 12.5, 90), (6, 20, math.pi / 2), (6, 60, -math.pi / 2)),
}


def swept(path, part):
    """A part's outline every 0.1 m along a path."""
    x, y, theta = path.pose_at(path.stations_every(0.1)).T[:, :, None]
    ahead, left = part.T
    c, s = np.cos(theta), np.sin(theta)
    return shapely.polygons(np.stack([x + c * ahead - s * left, y + s * ahead + c * left], axis=-1))


@pytest.mark.parametrize("name", CASES)
def test_a_search_finds_a_way_where_no_word_fits(name):
    region, start, goal = CASES[name]
    ground = Ground(region)
    assert turn_between(start, goal, ground, COMBINE, expansions=0) is None
    path = turn_between(start, goal, ground, COMBINE)
    assert isinstance(path, MachinePath)
    assert path.poses[0] == pytest.approx(start)
    assert path.poses[-1, :2] == pytest.approx(goal[:2])
    assert math.cos(path.poses[-1, 2] - goal[2]) == pytest.approx(1)
    assert np.abs(path.curvatures).max() <= 1 / 6.5 + 1e-9
    for part in combine_outline(COMBINE):
        assert shapely.covers(region.buffer(0.016), swept(path, part)).all()
    # Each piece begins where the one before it ends: headings and gears agree with the way.
    ahead = path.poses[1:, :2] - path.poses[:-1, :2]
    middle = (path.poses[1:, 2] + path.poses[:-1, 2]) / 2
    along = ahead[:, 0] * np.cos(middle) + ahead[:, 1] * np.sin(middle)
    assert np.sign(along) == pytest.approx(path.gears)


def test_a_way_along_a_corridor_cuts_its_corners():
    region, start, goal = CASES["corridor"]
    path = turn_between(start, goal, Ground(region), COMBINE)
    middle = 40 + 40 + 40 + 36
    # With arcs of the turning radius in the three corners of the middle line.
    rounded = middle - 3 * (2 - math.pi / 2) * 6.5
    # Round the inner corners, as a string would lie.
    string = shapely.LineString([(0, 0), (33, 7), (47, 33), (73, 33), (80, 4)])
    assert string.length < path.length < rounded


def test_where_a_machine_cannot_turn_round_the_search_ends_with_nothing():
    ground = Ground(shapely.box(0, 0, 9, 120))
    start, goal = (4.5, 30, math.pi / 2), (4.5, 80, -math.pi / 2)
    assert turn_between(start, goal, ground, COMBINE) is None
    # On the same row in the same heading there is a way.
    assert turn_between(start, (4.5, 80, math.pi / 2), ground, COMBINE) is not None


def test_poses_off_the_ground_have_no_turn():
    ground = Ground(shapely.box(0, 0, 60, 60))
    assert turn_between((30, 30, 0.2), (62, 30, 0.2), ground, COMBINE) is None
    assert turn_between((2, 30, 0.2), (30, 30, 0.2), ground, COMBINE) is None


def test_ground_in_two_parts_is_not_crossed():
    ground = Ground(shapely.box(0, 0, 60, 60).difference(shapely.box(29, -1, 31, 61)))
    assert turn_between((15, 20, 1.5), (45, 40, 1.5), ground, COMBINE) is None
    assert turn_between((15, 20, 1.5), (15, 40, 1.5), ground, COMBINE) is not None


def test_a_search_goes_round_standing_crop():
    ground, stand = Ground(shapely.box(0, 0, 120, 80)), shapely.box(25, 12, 95, 68)
    crop = StandingCrop(stand)
    start, goal = (12, 40, math.pi / 2), (108, 40, -math.pi / 2)
    path = turn_between(start, goal, ground, COMBINE, crop=crop)
    assert isinstance(path, MachinePath)
    body = combine_outline(COMBINE).body
    assert not shapely.union_all(swept(path, body)).intersects(stand.buffer(-0.5))
    crop.mark(shapely.box(20, 30, 100, 50), stands=False)
    shorter = turn_between(start, goal, ground, COMBINE, crop=crop)
    assert shorter.length < path.length


def test_with_nothing_in_the_way_a_search_finds_nearly_what_words_give():
    ground = Ground(shapely.box(-90, -90, 90, 90))
    site = ground.site(combine_footprint(COMBINE))
    motion = Motion(COMBINE.turning_radius, COMBINE.speed, COMBINE.acceleration)
    rng = np.random.default_rng(8)
    for _ in range(10):
        start, goal = rng.uniform(-40, 40, (2, 3))
        pieces = search_lattice(site, motion, start, goal, (1, 1), 2000)
        path = path_of_pieces(start, goal, *pieces)
        gears = np.concatenate([[1], path.gears, [1]])
        time = path.length / 1.5 + 3.0 * np.count_nonzero(np.diff(gears))
        assert time <= turn_times(start, goal, COMBINE) + 3.0


POND = [(30, 22), (34, 18), (41, 21), (40, 28), (33, 29)]
POLE = [(60.0, 30.0), (60.4, 30.0), (60.4, 30.4), (60.0, 30.4)]
FIELD = Field(make_world([(0, 0), (90, 3), (84, 52), (40, 44), (5, 50)], [POND, POLE]), margin=2.5)
GROUND = Ground(FIELD.ground)


def outlines(path, part, spacing=0.1):
    """A part's outline at poses along a path, by rotation and translation alone."""
    x, y, theta = path.pose_at(path.stations_every(spacing)).T[:, :, None]
    ahead, left = part.T
    c, s = np.cos(theta), np.sin(theta)
    return shapely.polygons(np.stack([x + c * ahead - s * left, y + s * ahead + c * left], axis=-1))


def random_pose(rng):
    return [rng.uniform(0, 90), rng.uniform(0, 52), rng.uniform(-9, 9)]


def admitted_pose(rng):
    while True:
        pose = random_pose(rng)
        if GROUND.admits_pose(pose, combine_footprint(COMBINE)):
            return pose


def test_a_pose_is_admitted_where_its_outline_is_on_the_ground():
    rng = np.random.default_rng(3)
    footprint = combine_footprint(COMBINE)
    inner, outer = GROUND.region.buffer(-0.001), GROUND.region.buffer(0.011)
    admitted = 0
    for _ in range(2000):
        pose = random_pose(rng)
        x, y, theta = pose
        c, s = np.cos(theta), np.sin(theta)
        corners = [part @ [[c, s], [-s, c]] + [x, y] for part in combine_outline(COMBINE)]
        outline = shapely.union_all([shapely.Polygon(part) for part in corners])
        said = GROUND.admits_pose(pose, footprint)
        admitted += said
        if inner.contains(outline):
            assert said
        if not outer.contains(outline):
            assert not said
    assert 400 < admitted < 1600


def test_no_part_of_a_turn_leaves_the_ground():
    rng = np.random.default_rng(4)
    allowed = GROUND.region.buffer(0.016)
    found = 0
    for _ in range(60):
        start, goal = admitted_pose(rng), admitted_pose(rng)
        turn = turn_between(start, goal, GROUND, COMBINE)
        if turn is None:
            continue
        found += 1
        assert turn.poses[0] == pytest.approx(start)
        assert turn.poses[-1, :2] == pytest.approx(goal[:2])
        assert np.cos(turn.poses[-1, 2] - goal[2]) == pytest.approx(1)
        assert not turn.cutting.any()
        curvatures = np.abs(turn.curvatures)
        assert (np.isclose(curvatures, 1 / 6.5) | np.isclose(curvatures, 0)).all()
        for part in combine_outline(COMBINE):
            assert shapely.covers(allowed, outlines(turn, part)).all()
        assert GROUND.admits(turn, combine_footprint(COMBINE))
    assert found > 40


def test_bodies_keep_off_standing_crop_and_raised_headers_need_not():
    rng = np.random.default_rng(5)
    stand = shapely.box(40, 8, 58, 26)
    crop = StandingCrop(stand)
    header, body = combine_outline(COMBINE)
    found = over = 0
    for _ in range(60):
        start, goal = admitted_pose(rng), admitted_pose(rng)
        turn = turn_between(start, goal, GROUND, COMBINE, crop=crop)
        if turn is None:
            continue
        found += 1
        swept = shapely.union_all(outlines(turn, body))
        # Edges of the raster are off by less than a cell.
        assert not swept.intersects(stand.buffer(-0.75))
        over += shapely.union_all(outlines(turn, header)).intersects(stand.buffer(-0.3))
    assert found > 25
    assert over > 3


def test_a_turn_with_nothing_in_the_way_takes_its_estimate():
    rng = np.random.default_rng(7)
    wide = Ground(shapely.box(-80, -80, 80, 80))
    starts, goals = rng.uniform(-10, 10, (2, 40, 3))
    times = turn_times(starts, goals, COMBINE)
    for start, goal, time in zip(starts, goals, times, strict=True):
        turn = turn_between(start, goal, wide, COMBINE)
        gears = np.concatenate([[1], turn.gears, [1]])
        stops = np.flatnonzero(np.diff(gears))
        runs = np.diff(turn.stations[stops])
        short = runs[runs < 1.5**2 / 0.5]
        saved = (short / 1.5 + 3.0 - 2 * np.sqrt(short / 0.5)).sum()
        assert turn.length / 1.5 + 3.0 * len(stops) - saved == pytest.approx(time)
