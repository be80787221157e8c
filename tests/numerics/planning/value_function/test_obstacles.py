"""Times to go among walls."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import covering_discs, deepest_overlap
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.obstacles import (
    make_walls,
    room_of,
    shut_ways,
)
from sightfield.systems.numerics.planning.value_function.policy import best_word, roll_out
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.value_function.sweeps import make_motions, step_multiples

GOAL = Goal(state=(6.0, 3.0, 0.0, 0.0), tolerance=(0.4, 0.4, 0.55, 0.55))
FIELD = [[-5, -5], [11, -5], [11, 11], [-5, 11]]
WALL = [[1.3, 1.5], [1.7, 1.5], [1.7, 7], [1.3, 7]]


@pytest.fixture(scope="module")
def solve():
    def times(*walls):
        grid = StateGrid.covering((-5, -5, 11, 11), 0.4)
        world = make_world(FIELD, walls)
        return solve_value_function(Trailer(), GOAL, grid, obstacles=world, polish=0)

    return times


@pytest.fixture(scope="module")
def walled(solve):
    return solve(WALL)


def test_the_way_round_a_wall_is_longer(solve, walled):
    start = [-2.0, 3.0, 0.0, 0.0]
    # Round the wall's lower end, half a width away from it.
    detour = math.hypot(3.3, 1.75) + 0.4 + math.hypot(3.9, 1.35)
    assert solve().time_to_go(start) < detour < walled.time_to_go(start) < 13


@pytest.mark.parametrize("times_of", ["interpolated", "looked_up"])
def test_walls_have_no_mirror_images(walled, times_of):
    """Walls are on one side, though the grid lies alike on both sides of the goal."""
    look_up = getattr(walled, times_of)
    low, high = [-4, -1, -math.pi, -1], [0, 7, math.pi, 1]
    starts = np.random.default_rng(16).uniform(low, high, (100, 4))
    times = look_up(starts)
    images = look_up(np.array([0, 6, 0, 0]) + starts * [1, -1, -1, -1])
    known = np.isfinite(times) & np.isfinite(images)
    assert np.median(np.abs(times[known] - images[known])) > 0.5


def test_no_wall_makes_a_way_shorter_than_a_cell_can_tell(solve, walled):
    both = np.isfinite(walled.table)
    gained = solve().table[both] - walled.table[both]
    # Beside a wall the nodes in reach speak for their cell; a step of the grid takes 0.4.
    assert gained.max() < 0.4
    assert np.quantile(gained, 0.9) < 0.01


def test_steps_are_shut_just_when_the_cart_would_overlap_a_wall():
    grid, cart = StateGrid.covering((-5, -5, 11, 11), 0.4), Trailer(hitch_offset=0.2)
    world, discs = make_world(FIELD, [WALL]), covering_discs(cart)
    multiples = step_multiples(grid, cubic=False)
    shut = shut_ways(grid, cart, make_walls(world, discs, grid), 1.0, multiples)
    motions = make_motions(grid, cart, 1.0, multiples)
    axes, random = grid.axes(), np.random.default_rng(3)
    shut_count = 0
    for _ in range(400):
        t, b, j, i = (int(random.integers(count)) for count in grid.shape)
        start = (axes[0][i], axes[1][j], axes[2][t], axes[3][b])
        c = int(random.integers(len(motions.controls)))
        piece = (*motions.controls[c], float(motions.durations[c]))
        # Two looks in each angle between theta nodes, as the masks have.
        path = driven_path(cart, start, [piece], grid.theta_step / 2 + 1e-6)
        depth = deepest_overlap(world, discs, path.states)
        is_shut = bool(shut[t, b, j, i] >> c & 1)
        shut_count += is_shut
        # Beyond the grid there is no way, and about rounding there is nothing to say.
        if abs(depth) > 0.08:
            assert is_shut == (depth > 0)
    assert 100 < shut_count < 350


def test_in_a_wall_there_is_no_way(walled):
    assert walled.time_to_go([1.5, 3.0, 0.0, 0.0]) == math.inf
    # Not from any depth, for any planner that asks.
    for x in np.linspace(0.8, 2.2, 15):
        room = room_of(walled.walls, np.array([x, 3.0, 0.0, 0.0]))
        word = best_word(walled, (x, 3.0, 0.0, 0.0))
        assert word is None or room > -0.1


def test_the_trailer_keeps_clear_too(walled):
    # The tractor is past the wall, the trailer in it.
    assert walled.time_to_go([2.5, 3.0, 0.0, 0.0]) == math.inf
    assert np.isfinite(walled.time_to_go([3.7, 3.0, 0.0, 0.0]))


def test_among_walls_the_time_to_go_is_that_of_a_way_which_is_driven(walled):
    low, high = [-4, -1, -math.pi, -1], [0, 7, math.pi, 1]
    start = np.random.default_rng(61).uniform(low, high)
    time, driven = walled.time_to_go(start), roll_out(walled, start)
    assert driven.arrived
    assert driven.path.times[-1] == pytest.approx(time, rel=1e-9)
    world = make_world(FIELD, [WALL])
    other = plan_by_casadi(Trailer(), start, GOAL, seeds=[driven.path], obstacles=world)
    assert other.converged
    # The programme's intervals are coarse beside a wall.
    assert time == pytest.approx(other.time, rel=5e-3)


def test_a_walled_in_goal_is_unreachable(solve):
    # The gaps at its ends are too narrow for the cart.
    ring = [[1.2, -4.9], [1.8, -4.9], [1.8, 10.9], [1.2, 10.9]]
    assert solve(ring).time_to_go([-2.0, 3.0, 0.0, 0.0]) == math.inf
