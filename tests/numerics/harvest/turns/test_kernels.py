"""Compiled parts of turns and of the search on a lattice, as recorded at random poses."""

import numpy as np
import pytest
from numba.typed import List

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.turns.borders import StandingCrop
from sightfield.systems.numerics.harvest.turns.ground import Ground
from sightfield.systems.numerics.harvest.turns.turn import (
    _in_crop,
    _joined,
    _key,
    _rest,
    _table_place,
    _ways_to_goal,
    combine_footprint,
    motion_of,
    search_lattice,
)
from sightfield.systems.numerics.harvest.turns.words import (
    PIECES,
    WORD_COUNT,
    _clear,
    _hull_cut,
    _may_stay,
    drive,
    driving_time,
    fitting_word,
    path_stays,
    quickest_time,
)

COMBINE = Combine(
    header_width=7.3, header_depth=1.7, turning_radius=6.1, length=6.7, width=3.3, speed=1.7,
    acceleration=0.45,
)  # fmt: skip
POND = [(30, 22), (34, 18), (41, 21), (40, 28), (33, 29)]
FIELD = Field(make_world([(0, 0), (90, 3), (84, 52), (40, 44), (5, 50)], [POND]), margin=2.7)
STAND = Field(make_world([(48.3, 7.1), (70.2, 9.4), (66.6, 27.2), (50.9, 30.3)])).polygon
MOTION = motion_of(COMBINE)


@pytest.fixture(scope="module")
def site():
    return Ground(FIELD.ground).site(combine_footprint(COMBINE), StandingCrop(STAND))


def poses(seed, count):
    return np.random.default_rng([8, seed]).uniform([-6, -6, -4], [96, 58, 4], (count, 3))


def pieces(rng):
    """A few arcs and straights, some of no length."""
    count = int(rng.integers(1, 5))
    curvatures = rng.choice([0.0, 1 / 6.1, -1 / 6.1, 0.05], count)
    lengths = rng.uniform(-12, 12, count) * (rng.random(count) < 0.85)
    return curvatures, lengths, count


def test_what_stays_on_the_ground_is_as_recorded(site, as_recorded):
    rng, room = np.random.default_rng(5), np.zeros((2, 20, 2))
    said = []
    for pose in poses(1, 500):
        curvatures, lengths, count = pieces(rng)
        stays = path_stays(site, pose, curvatures, lengths)
        may = _may_stay(site.borders, site.footprint, pose, curvatures, lengths, count)
        # The quick test refuses nothing that the full one admits.
        assert may or not stays
        step, curvature = lengths[0] / 10, curvatures[0]
        clear = _clear(site, *pose, step, curvature, room)
        there = drive(*pose, step, curvature)
        cuts = [
            _hull_cut(site.borders, site.footprint, part, *pose, *there, room) for part in (0, 1)
        ]
        said.append([stays, may, clear, *cuts])
    said = np.array(said, dtype=float)
    assert (said.mean(axis=0) > 0.02).all()
    as_recorded([said.sum(axis=0), said])


def test_where_crop_stands_is_as_recorded(site, as_recorded):
    corner = site.crop_origin
    at = np.concatenate([poses(2, 200)[:, :2], [corner + 0.2, corner - 0.1]])
    inside = [_in_crop(site, x, y) for x, y in at]
    stands = [
        0 <= j < site.crop.shape[0] and 0 <= i < site.crop.shape[1] and bool(site.crop[j, i])
        for i, j in np.floor((at - corner) / 0.5).astype(int)
    ]
    assert inside == stands
    as_recorded(np.array(inside, dtype=float))


def test_ways_round_obstacles_and_what_remains_are_as_recorded(site, as_recorded):
    start, goal = np.array([12.3, 12.1, 0.4]), np.array([78.2, 40.6, -1.1])
    turns, lengths = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    for number, (begin, end) in enumerate([(start, goal), (goal, start)]):
        ahead = _ways_to_goal(site, begin, end)
        as_recorded(np.where(np.isfinite(ahead), ahead, -1.0), f"ahead {number}")
        rest = [
            _rest(site, MOTION, pose, end, gear, after, ahead, turns, lengths)
            for pose in poses(3, 40)
            for gear, after in ((1, 1), (-1, 0))
        ]
        as_recorded(np.where(np.isfinite(rest), rest, -1.0), f"rest {number}")
    # A short way: the search for ways to the goal ends a little farther away.
    near = _ways_to_goal(site, goal + np.array([-6.0, 0.0, 0.0]), goal)
    as_recorded(np.where(np.isfinite(near), near, -1.0), "near")


def test_cells_of_the_lattice_have_keys_of_their_own_and_places_in_the_table():
    rng, start = np.random.default_rng(2), np.array([12.3, 12.1, 0.4])
    table = np.full(1 << 10, -1, dtype=np.int64)
    keys = {}
    for pose in poses(4, 300):
        for gear in (1, -1, 0):
            key = _key(pose, gear, start, 0.96)
            i, j = np.floor((pose[:2] - start[:2]) / 0.96)
            heading = np.floor((pose[2] - start[2]) / (2 * np.pi) * 24 + 0.5) % 24
            assert keys.setdefault(key, (i, j, heading, gear)) == (i, j, heading, gear)
            place = _table_place(table, key)
            if place >= 0 and len(keys) < 700:
                assert table[place] == -1
                table[place] = key
                assert _table_place(table, key) == -1
    assert len(set(keys.values())) == len(keys) > 600
    # Rounding to the nearest of 24 headings, whole turns apart or not.
    step = 2 * np.pi / 24
    for turned in rng.integers(-60, 60, 30):
        pose = start + np.array([0.0, 0.0, turned * step])
        for off in (-0.49 * step, 0.49 * step, 2 * np.pi):
            assert _key(pose, 1, start, 0.96) == _key(pose + np.array([0, 0, off]), 1, start, 0.96)
        assert _key(pose, 1, start, 0.96) != _key(
            pose + np.array([0, 0, 0.51 * step]), 1, start, 0.96
        )


def test_equal_neighbours_are_joined_in_the_order_of_driving():
    backwards = [(0.0, 0.0), (0.1, 2.0), (0.1, 1.5), (0.1, -1.0), (0.0, 4.0), (0.0, 0.0)]
    curvatures, lengths = _joined(List([*backwards, (0.0, 3.0)]))
    assert curvatures.tolist() == [0.0, 0.1, 0.1]
    assert lengths.tolist() == [7.0, -1.0, 3.5]
    nothing = _joined(List([(0.0, 0.0)]))
    assert [len(each) for each in nothing] == [0, 0]


@pytest.mark.parametrize("gears", [(1, 1), (1, -1), (-1, 1), (0, 1), (1, 0), (0, 0), (-1, -1)])
def test_times_of_driving_are_as_recorded(gears, as_recorded):
    rng = np.random.default_rng(6)
    times = []
    for _ in range(40):
        lengths = rng.uniform(-8, 8, 6) * (rng.random(6) < 0.7)
        times += [driving_time(lengths, count, 1.7, 0.45, *gears) for count in (0, 3, 6)]
    turns, lengths = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    ends = poses(5, 20).reshape(-1, 2, 3)
    times += [quickest_time(MOTION, one, other, *gears, turns, lengths) for one, other in ends]
    as_recorded(np.array(times))
    # Just long enough for the full speed between two stops.
    way = 1.7**2 / 0.45
    time = driving_time(np.array([way]), 1, 1.7, 0.45, -1, -1)
    assert time == pytest.approx(way / 1.7 + 2 * 1.7 / 0.45)


@pytest.mark.parametrize("with_runs", [False, True])
def test_words_that_fit_are_as_recorded(site, with_runs, as_recorded):
    rng, still = np.random.default_rng(9), np.zeros(0)
    found = []
    while len(found) < 14:
        one, other = rng.uniform([0, 0, -4], [90, 52, 4], (2, 3))
        if not (path_stays(site, one, still, still) and path_stays(site, other, still, still)):
            continue
        bends, ways = np.zeros(PIECES), np.zeros(PIECES)
        gears = ((1, 1), (0, -1), (-1, 0))[len(found) % 3]
        time = fitting_word(site, MOTION, one, other, gears, 90.0, with_runs, bends, ways)
        found.append([time, *bends, *ways])
        if time < 90.0:
            # No quicker one is admitted, and it is found if it is just asked for.
            for least, again in ((time, time), (time + 1e-6, time), (0.9 * time, 0.9 * time)):
                told = fitting_word(site, MOTION, one, other, gears, least, with_runs, bends, ways)
                assert told == pytest.approx(again)
    as_recorded(np.array(found))


@pytest.mark.parametrize("expansions", [0, 1, 40, 300])
def test_a_search_that_ends_with_its_expansions_is_as_recorded(site, expansions, as_recorded):
    start, goal = np.array([12.3, 12.1, 0.4]), np.array([78.2, 40.6, -1.1])
    as_recorded(search_lattice(site, MOTION, start, goal, (1, 1), expansions))
