"""Turns near borders and ponds, swept with Shapely."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines.combine import Combine
from sightfield.systems.numerics.harvest.machines.outlines import combine_outline
from sightfield.systems.numerics.harvest.paths.machine_path import TRANSIT
from sightfield.systems.numerics.harvest.turns.ground import Ground
from sightfield.systems.numerics.harvest.turns.standing_crop import StandingCrop
from sightfield.systems.numerics.harvest.turns.turn import (
    combine_footprint,
    turn_between,
    turn_times,
)

COMBINE = Combine(header_width=7.5, turning_radius=6.5, length=7.0)
POND = [(30, 22), (34, 18), (41, 21), (40, 28), (33, 29)]
POLE = [(60.0, 30.0), (60.4, 30.0), (60.4, 30.4), (60.0, 30.4)]
FIELD = Field(make_world([(0, 0), (90, 3), (84, 52), (40, 44), (5, 50)], [POND, POLE]), margin=2.5)
GROUND = Ground.of_field(FIELD)


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
        assert (turn.work == TRANSIT).all()
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


def test_what_is_taken_from_the_ground_is_an_obstacle():
    taken = shapely.box(40, 8, 58, 26)
    less = GROUND.without(taken)
    again = Ground(GROUND.region.difference(taken))
    rng = np.random.default_rng(6)
    footprint = combine_footprint(COMBINE)
    poses = [random_pose(rng) for _ in range(1000)]
    said = [less.admits_pose(pose, footprint) for pose in poses]
    assert said == [again.admits_pose(pose, footprint) for pose in poses]
    assert said != [GROUND.admits_pose(pose, footprint) for pose in poses]


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
