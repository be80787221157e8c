"""Who answers for whom where there are more evaders than pursuers."""

import itertools

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.pursuit import velocity_after
from sightfield.systems.numerics.tracking.visibility_game.regain import steps_to_guard
from sightfield.systems.numerics.tracking.visibility_game.responsibilities import (
    AGES,
    NOBODY,
    hardest,
    make_team_board,
    prospects,
    responsibilities,
    shared_certificate,
    team_velocities,
    watchers,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders

ROOM = make_world(
    [(0, 0), (4, 0), (4, 4), (0, 4)], [[(1.13, 1.21), (2.47, 1.21), (2.47, 2.63), (1.13, 2.63)]]
)
STEP = 1.8


@pytest.fixture(scope="module")
def tables():
    speeds = {"pursuer_speed": 1.0, "evader_speed": 0.3}
    return (
        solve_visibility_game(ROOM, grid=0.1, **speeds),
        solve_two_evaders(ROOM, grid=0.25, **speeds),
    )


@pytest.fixture(scope="module")
def board(tables):
    return make_team_board(*tables)


def draw_prospects(rng, n, m):
    """Times of one evader and of two, who see the same or less."""
    visible = rng.random((n, m)) < 0.7
    one = np.where(rng.random((n, m)) < 0.4, AGES, rng.uniform(1, 30, (n, m))) * visible
    two = np.minimum(one[:, :, None], one[:, None, :]) * rng.uniform(0.1, 1, (n, m, m))
    return one, np.minimum(two, two.transpose(0, 2, 1)), visible


def times_of(owners, one, two):
    """How long each pursuer keeps what it answers for, the least first."""
    times = []
    for i in range(len(one)):
        own = [j for j, owner in enumerate(owners) if owner == i]
        pairs = [two[i, j, k] for j, k in itertools.combinations(own, 2)]
        times.append(one[i, own[0]] if len(own) == 1 else min(pairs, default=AGES))
    return sorted(times)


@pytest.mark.parametrize(("n", "m"), [(1, 2), (2, 3), (3, 4), (3, 6)])
def test_the_least_time_is_the_largest_of_all_ways_to_share(n, m):
    rng = np.random.default_rng(n + m)
    for _ in range(20):
        one, two, visible = draw_prospects(rng, n, m)
        seers = [[i for i in range(n) if visible[i, j]] or [NOBODY] for j in range(m)]
        best = max(times_of(owners, one, two) for owners in itertools.product(*seers))
        owners = responsibilities(one, two, visible, np.full(m, NOBODY), STEP)
        if any(seer != [NOBODY] for seer in seers):
            assert times_of(owners, one, two) == best
        assert all(owner in seer for owner, seer in zip(owners, seers, strict=True))


def test_large_teams_find_a_way_that_no_single_change_betters():
    rng = np.random.default_rng(8)
    one, two, visible = draw_prospects(rng, 6, 9)
    visible[0] = True
    one[0] = np.maximum(one[0], 0.5)
    owners = responsibilities(one, two, visible, np.full(9, NOBODY), STEP)
    best = times_of(owners, one, two)
    assert len(set(owners.tolist())) > 3
    for i, j in np.argwhere(visible):
        other = owners.copy()
        other[j] = i
        assert times_of(other, one, two) <= best


def test_the_team_changes_its_mind_for_a_gain_alone():
    visible = np.ones((2, 3), dtype=bool)
    one = np.full((2, 3), AGES)
    two = np.full((2, 3, 3), 10.0)
    held = np.array([0, 0, 1])
    # Little to gain: with evaders 1 and 2 a pursuer keeps them some steps longer, or a tenth.
    two[:, 1, 2] = two[:, 2, 1] = 10.0 + 3.0 * STEP
    assert responsibilities(one, two, visible, held, STEP).tolist() == held.tolist()
    two[:, 1, 2] = two[:, 2, 1] = 11.0 + 2.9 * STEP
    assert responsibilities(one, two, visible, held, STEP).tolist() == held.tolist()
    two[:, 1, 2] = two[:, 2, 1] = 11.0 + 3.1 * STEP
    chosen = responsibilities(one, two, visible, held, STEP)
    assert chosen[1] == chosen[2] != chosen[0]


def test_a_teammate_stands_in_for_one_that_does_not_see_its_own():
    visible = np.ones((2, 3), dtype=bool)
    one, two = np.full((2, 3), AGES), np.full((2, 3, 3), 10.0)
    held = np.array([0, 0, 1])
    assert watchers(one, two, visible, held).tolist() == held.tolist()
    visible[0, 1], one[0, 1], two[0, 1], two[0, :, 1] = False, 0.0, 0.0, 0.0
    # Who answers for it stays the same, as long as the other keeps it as well as anybody could.
    assert responsibilities(one, two, visible, held, STEP).tolist() == held.tolist()
    assert watchers(one, two, visible, held).tolist() == [0, 1, 1]
    # The other would keep it longer beside the first evader, the third being out of its sight's
    # reach: that gains enough, if it is enough more.
    two[1, 0, 1] = two[1, 1, 0] = 11.0 + 2.9 * STEP
    assert responsibilities(one, two, visible, held, STEP).tolist() == held.tolist()
    two[1, 0, 1] = two[1, 1, 0] = 11.0 + 3.1 * STEP
    assert responsibilities(one, two, visible, held, STEP).tolist() == [1, 1, 0]
    # Of two that could stand in, who keeps what it has the longest.
    visible, one = np.ones((3, 4), dtype=bool), np.full((3, 4), AGES)
    two = np.broadcast_to(np.array([10.0, 4.0, 6.0])[:, None, None], (3, 4, 4)).copy()
    visible[0, 1], one[0, 1], two[0, 1], two[0, :, 1] = False, 0.0, 0.0, 0.0
    held = np.array([0, 0, 1, 2])
    assert watchers(one, two, visible, held).tolist() == [0, 2, 1, 2]
    # Nobody sees the last.
    visible[:, 3], one[:, 3] = False, 0.0
    assert watchers(one, two, visible, held).tolist() == [0, 2, 1, NOBODY]


def test_an_evader_that_nobody_sees_stays_with_its_own_and_changes_nothing():
    visible = np.ones((2, 3), dtype=bool)
    one, two = np.full((2, 3), AGES), np.full((2, 3, 3), 10.0)
    two[:, 0, 2] = two[:, 2, 0] = 14.5
    visible[:, 1], one[:, 1], two[:, 1], two[:, :, 1] = False, 0.0, 0.0, 0.0
    for held in ([0, 0, 1], [1, 0, 0]):
        held = np.array(held)
        # Each of the other two has a pursuer to itself.
        assert responsibilities(one, two, visible, held, STEP).tolist() == held.tolist()
    # Both of the others have the same, and the other pursuer has nobody that it sees.
    chosen = responsibilities(one, two, visible, np.array([0, 1, 0]), STEP)
    assert chosen[1] == 1
    assert chosen[0] != chosen[2]
    # Nobody's before, nobody's now.
    assert responsibilities(one, two, visible, np.array([0, NOBODY, 1]), STEP)[1] == NOBODY


def draw_free(rng, count):
    index, found = build_edge_index(ROOM), []
    while len(found) < count:
        point = rng.uniform(0.05, 3.95, 2)
        if point_is_free(index, *point):
            found.append(point)
    return np.array(found)


def test_prospects_are_what_the_tables_say(tables, board):
    single, double = tables
    rng, index = np.random.default_rng(2), build_edge_index(ROOM)
    lost = 0
    for _ in range(20):
        pursuers, evaders = draw_free(rng, 2), draw_free(rng, 3)
        visible = np.array([[segment_is_clear(index, *p, *e) for e in evaders] for p in pursuers])
        one, two = prospects(board, pursuers.ravel(), evaders.ravel(), visible)
        np.testing.assert_array_equal(one > 0, visible)
        np.testing.assert_array_equal(two, two.transpose(0, 2, 1))
        for i, j in np.argwhere(visible):
            expected = single.time(pursuers[i], evaders[j])
            assert min(expected, AGES) == pytest.approx(one[i, j])
            for k in range(j):
                expected = double.time(pursuers[i], evaders[j], evaders[k])
                assert min(expected, AGES) == pytest.approx(two[i, j, k])
                lost += 0 < two[i, j, k] < AGES
    assert lost > 10


def test_the_hardest_evader_is_the_one_that_is_lost_first():
    one = np.array([[5.0, 3.0, 9.0, 4.0], [1.0, 1.0, 1.0, 1.0], [2.0, 2.0, 2.0, 2.0]])
    assert hardest(one, np.array([0, NOBODY, 0, 1])).tolist() == [0, 3, -1]


def test_every_step_leaves_as_much_as_the_table_of_two_says(tables, board):
    double = tables[1]
    rng = np.random.default_rng(3)
    free, last = np.argwhere(double.evader_numbers >= 0), len(double.evader_numbers) - 1
    index = build_edge_index(ROOM)
    owners, field = np.array([0, 0]), np.zeros(2)
    tried = 0
    while tried < 30:
        p = double.places[rng.integers(len(double.places))]
        nodes = free[rng.integers(len(free), size=2)]
        evaders = double.evader_grid.at(*nodes.T)
        promised = double.time(p, *evaders)
        if not 2 * double.step < promised < np.inf:
            continue
        velocity = team_velocities(
            board, p, evaders.ravel(), owners, owners, field, 1.0, double.step
        )
        then = p + velocity * double.step
        # Whatever the evaders do, a step less is left.
        ways = (nodes + move for move in rng.integers(-1, 2, (20, 2, 2)))
        for to in ways:
            ends = double.evader_grid.at(*to.T)
            clear = (segment_is_clear(index, *a, *b) for a, b in zip(evaders, ends, strict=True))
            if (to == to.clip(0, last)).all() and all(clear):
                assert double.time(then, *ends) >= promised - double.step - 1e-9
        tried += 1


def test_one_evader_is_followed_as_by_the_game_of_one(board):
    rng = np.random.default_rng(4)
    for _ in range(10):
        pursuers, evaders = draw_free(rng, 3).ravel(), draw_free(rng, 4).ravel()
        field = rng.uniform(-1, 1, 6)
        owners = np.array([2, NOBODY, 0, NOBODY])
        velocity = team_velocities(board, pursuers, evaders, owners, owners, field, 1.0, 0.05)
        for i, j in ((0, 2), (2, 0)):
            at, wish = slice(2 * i, 2 * i + 2), field[2 * i : 2 * i + 2]
            evader = evaders[2 * j : 2 * j + 2]
            alone = velocity_after(board.single, pursuers[at], evader, wish, 1.0, 0.05)
            np.testing.assert_array_equal(velocity[at], alone)
        np.testing.assert_array_equal(velocity[2:4], field[2:4])


def test_one_without_an_evader_relieves_one_that_answers_for_several(board):
    # The first answers for two, the third for nobody.
    pursuers = np.array([0.6, 0.6, 3.4, 0.6, 3.4, 3.4])
    evaders = np.array([0.5, 3.4, 1.8, 0.5, 3.5, 1.5])
    owners = np.array([0, 0, 1])
    velocity = team_velocities(board, pursuers, evaders, owners, owners, np.zeros(6), 1.0, 0.05)
    steps = steps_to_guard(board.single, pursuers[4:], evaders, np.array([[True, True, False]]))
    j = int(np.argmin(steps[0]))
    wish = velocity_after(
        board.single, pursuers[4:], evaders[2 * j : 2 * j + 2], np.zeros(2), 1.0, 0.05
    )
    assert np.hypot(*wish) == pytest.approx(1.0)
    np.testing.assert_array_equal(velocity[4:], wish)


def test_one_that_sees_none_of_its_own_goes_where_it_could_guard_one(board):
    pursuers = np.array([0.6, 0.6, 3.4, 3.4])
    evaders = np.array([0.5, 3.4, 1.8, 0.5, 2.0, 0.3])
    # The first pursuer watches all three; it is nearest to the second evader, but the first is its.
    watching = np.zeros(3, dtype=int)
    for owners, j in (([1, 0, 0], 0), ([0, 1, 0], 1), ([0, 0, 1], 2)):
        velocity = team_velocities(
            board, pursuers, evaders, np.array(owners), watching, np.zeros(4), 1.0, 0.05
        )
        evader = evaders[2 * j : 2 * j + 2]
        wish = velocity_after(board.single, pursuers[2:], evader, np.zeros(2), 1.0, 0.05)
        assert np.hypot(*wish) == pytest.approx(1.0)
        np.testing.assert_array_equal(velocity[2:], wish)


def test_the_certificate_is_the_least_time_of_those_who_answer():
    one = np.array([[4.0, 9.0, 6.0], [AGES, 2.0, AGES]])
    two = np.zeros((2, 3, 3))
    two[0, 0, 2] = two[0, 2, 0] = 3.0
    assert shared_certificate(one, two, np.array([0, 1, 0])) == 2.0
    assert shared_certificate(one, two, np.array([0, 0, 1])) == 0.0
    assert shared_certificate(one, two, np.array([0, NOBODY, 1])) == 0.0
    two[0, 0, 1] = two[0, 1, 0] = 5.0
    assert shared_certificate(one, two, np.array([0, 0, 1])) == 5.0
    assert shared_certificate(one, two, np.array([1, 0, 1])) == 0.0
    two[1, 0, 2] = two[1, 2, 0] = one[0, 1] = AGES
    assert shared_certificate(one, two, np.array([1, 0, 1])) == np.inf
