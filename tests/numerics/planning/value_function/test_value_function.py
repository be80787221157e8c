"""Times to go, against what is known of them in closed form and by symmetry."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.car_paths import dubins_lengths
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer, hold_beta
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.policy import attained_times
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.value_function.sweeps import (
    between,
    slack_for,
    step_multiples,
)

# Least times of the thesis's case, by multiple shooting from every Dubins word.
THESIS_CASE = 4.3476


@pytest.fixture
def states() -> np.ndarray:
    """Random states about a goal at the origin, shape (300, 4)."""
    rng = np.random.default_rng(5)
    return rng.uniform([-4, -4, -math.pi, -1.5], [2, 3, math.pi, 1.5], (300, 4))


def test_a_straight_takes_as_long_as_the_way_to_the_box(solved):
    distances = np.array([0.5, 1.0, 2.0, 3.0, 4.0])
    states = np.column_stack([-distances, np.zeros((5, 3))])
    times = solved().time_to_go(states)
    np.testing.assert_allclose(times, distances - THESIS_TOLERANCE[0], rtol=0.03)


def test_without_polish_a_straight_is_exact(solved):
    states = [[-distance, 0, 0, 0] for distance in (0.6, 1.6, 2.6)]
    times = solved(polish=0).time_to_go(states)
    np.testing.assert_allclose(times, [0.4, 1.4, 2.4], atol=2e-3)


def test_times_on_a_circle_are_its_arcs(solved):
    # The cart meets the box where it is as wide as the arc is: at the angle asin(0.2).
    value = solved(beta_width=math.inf)
    angles = np.array([0.5, 1.0, 1.5, 2.0])
    states = np.column_stack([-np.sin(angles), 1 - np.cos(angles), -angles, np.zeros(4)])
    arcs = angles - math.asin(THESIS_TOLERANCE[0])
    gaps = np.maximum(np.abs(states[:, :2]) - THESIS_TOLERANCE[:2], 0)
    times = value.time_to_go(states)
    assert (times <= 1.03 * arcs + 0.02).all()
    assert (times >= np.hypot(*gaps.T) - 0.05).all()


def test_on_a_straight_the_trailer_angle_decays(solved):
    path = hold_beta(1.0, 1, 0, 2.0, 100, Trailer())
    assert math.tan(path[-1] / 2) == pytest.approx(math.tan(0.5) * math.exp(-2.0), rel=1e-8)


def test_the_thesis_case_is_near_its_optimum(solved):
    assert solved().time_to_go([-3, -3, 0, 0]) == pytest.approx(THESIS_CASE, rel=0.03)


def test_halving_the_grid_halves_the_error(solved, states):
    # The box stays as it is.
    goal = Goal(state=(0, 0, 0, 0), tolerance=(0.4, 0.4, 0.55, 0.55))
    starts = states[:16]
    best = np.array([plan_by_casadi(Trailer(), start, goal).time for start in starts])
    errors = []
    for step in (0.4, 0.2):
        value = solved(step, wide=True, polish=None)
        errors.append(np.median(np.abs(value.interpolated(starts) / best - 1)))
    assert errors[0] < 0.02
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.parametrize("tolerance", [(0.4, 0.4, 0.55, 0.55), (0.4, 0.4, math.inf, math.inf)])
def test_close_to_the_goal_nodes_are_exact(tolerance):
    goal = Goal(state=(0, 0, 0.7, 0), tolerance=tolerance)
    value = solve_value_function(Trailer(), goal, StateGrid.of_step(0.4))
    x_nodes, y_nodes, thetas, betas = value.grid.axes()
    close = np.argwhere((value.table > 0) & (value.table < 1.4))
    rng = np.random.default_rng(6)
    t, b, j, i = rng.choice(close, 30).T
    times = value.table[t, b, j, i]
    nodes = np.column_stack([x_nodes[i], y_nodes[j], thetas[t], betas[b]])
    # Mixed from both sides of a face of the box, some are too short by a third.
    np.testing.assert_allclose(times, attained_times(value, nodes), rtol=0.03, atol=0.02)


def test_mirror_images_take_as_long(solved, states):
    value, mirrored = solved(), states * [1, -1, -1, -1]
    one, other = value.interpolated(states), value.interpolated(mirrored)
    np.testing.assert_allclose(one, other, rtol=1e-4)
    np.testing.assert_allclose(value.time_to_go(states), value.time_to_go(mirrored), rtol=1e-4)


def test_half_the_rows_give_the_whole_table(solved):
    # A grid that is not symmetric about the goal is solved row by row.
    one = solved(0.4, wide=True, polish=None)
    odd = StateGrid.covering((-6.0, -6.0, 6.0, 6.41), 0.4)
    other = solve_value_function(one.trailer, one.goal, odd)
    assert odd.y_count == one.grid.y_count + 2
    spots = [[-2, 0, 0, 0], [-2, 1, 0.3, 0.1], [-1.5, -1, 0.9, -0.4]]
    np.testing.assert_allclose(one.time_to_go(spots), other.time_to_go(spots), rtol=0.01)


def test_a_quarter_turn_of_the_world_changes_nothing(states):
    box = (0.4, 0.4, 0.55, 0.55)
    grid = StateGrid(
        x_min=-4.8, y_min=-4.8, step=0.4, x_count=25, y_count=25, theta_count=12, beta_count=12
    )
    east, north = (
        solve_value_function(Trailer(), Goal(state=(0, 0, theta, 0), tolerance=box), grid, polish=0)
        for theta in (0.0, math.tau / 4)
    )
    # At nodes, because interpolation takes one direction after the other.
    states = np.round(states / east.grid.cell) * east.grid.cell
    x, y, theta, beta = states.T
    turned = np.column_stack([-y, x, theta + math.tau / 4, beta])
    np.testing.assert_allclose(east.time_to_go(states), north.time_to_go(turned), rtol=1e-3)


def test_one_table_serves_every_goal(solved, states):
    value = solved()
    moved = value.moved(10.0, -7.0, 2.0)
    c, s = math.cos(2.0), math.sin(2.0)
    x, y, theta, beta = states.T
    there = np.column_stack([10 + c * x - s * y, -7 + s * x + c * y, theta + 2.0, beta])
    np.testing.assert_allclose(moved.interpolated(there), value.interpolated(states), rtol=1e-4)
    np.testing.assert_allclose(moved.time_to_go(there), value.time_to_go(states), rtol=1e-4)


def test_with_beta_free_the_times_are_those_of_a_car(solved):
    value = solved(beta_width=math.inf)
    rng = np.random.default_rng(8)
    starts = rng.uniform([-4, -3, -1.5, -1.5], [-2, 3, 1.5, 1.5], (40, 4))
    offsets = np.stack(np.meshgrid(*[np.linspace(-1, 1, 9)] * 3), axis=-1).reshape(-1, 3)
    box = offsets * THESIS_TOLERANCE[:3]
    best = np.array([dubins_lengths(start[:3], box, 1.0).min() for start in starts])
    errors = np.abs(value.time_to_go(starts) - best) / best
    assert np.median(errors) < 0.02
    reached = np.isfinite(value.table).all(axis=(0, 1))
    assert np.ptp(value.table[:, :, reached], axis=1).max() < 1e-3


def test_reverse_is_never_slower(solved):
    forward, both = solved(polish=0), solved(polish=0, reverse=True)
    assert (both.table <= forward.table + 2e-3).all()
    assert both.time_to_go([1, 0, 0, 0]) < 1.5 < forward.time_to_go([1, 0, 0, 0])


@pytest.mark.parametrize("step", [1.0, 0.4, 0.2, 0.125, 0.1, 0.05])
def test_steps_begin_with_one_angle_and_reach_as_far_on_any_grid(step):
    grid = StateGrid.of_step(step)
    multiples = step_multiples(grid, cubic=True)
    assert multiples[0] == 1
    assert all(np.diff(multiples) > 0)
    far = 6 * max(grid.theta_step, math.tau / 25)
    assert multiples[-1] * grid.theta_step == pytest.approx(far, abs=grid.theta_step / 2)
    # Linear interpolation would pay for every one of many short steps.
    least = step_multiples(grid, cubic=False)[0] * grid.theta_step
    assert least == pytest.approx(far / 6, abs=grid.theta_step / 2)


@pytest.mark.parametrize(
    ("angles", "dip"), [(12, 0.05), (25, 0.05), (50, 0.05 / 4), (100, 0.05 / 16)]
)
def test_beside_a_jump_a_cubic_dips_by_no_more_than_smooth_values_would(angles, dip):
    # Second differences of 0 and 8 on either side; smooth ones are alike but for a cell squared.
    middle = between(0.0, -1.0, -2.0, 5.0, 0.5, slack_for(angles))
    assert middle == pytest.approx(-1.5 - dip / 16, abs=1e-7)
    smooth = [0.01 * k**2 for k in range(-1, 3)]
    assert between(*smooth, 0.5, slack_for(angles)) == pytest.approx(0.01 * 0.25)


def test_scale_of_lengths_and_times_does_not_matter(solved):
    small = solved(0.4, wide=True, polish=None)
    large = tuple(np.array(small.goal.tolerance) * [5, 5, 1, 1])
    cart = Trailer(speed=10.0, turn_rate=2.0, length=5.0)
    big = solve_value_function(
        cart, Goal(state=(0, 0, 0, 0), tolerance=large), StateGrid.of_step(0.4, radius=5.0)
    )
    np.testing.assert_allclose(big.table, small.table / 2, rtol=1e-3)


def test_inside_the_box_there_is_nothing_left_to_go(solved):
    assert solved().time_to_go([0.15, -0.1, 0.2, math.tau - 0.1]) == 0


def test_off_the_grid_is_out_of_reach(solved):
    assert solved().time_to_go([7, 0, 0, 0]) == math.inf
    # Nothing leads back from the edge with one's face to it.
    assert solved().time_to_go([5.9, 0, 0, 0]) == math.inf


def test_a_jackknifed_cart_is_out_of_reach():
    goal = Goal(state=(0, 0, 0, 0), tolerance=(0.4, 0.4, 0.55, 0.55))
    value = solve_value_function(Trailer(jackknife=1.2), goal, StateGrid.of_step(0.4))
    assert value.time_to_go([-2, 0, 0, 1.3]) == math.inf
    assert value.time_to_go([-2, 0, 0, 1.0]) < 4


def test_progress_hears_of_every_pass():
    heard = []
    goal = Goal(state=(0, 0, 0, 0), tolerance=(0.8, 0.8, 0.8, 0.8))
    value = solve_value_function(
        Trailer(),
        goal,
        StateGrid.of_step(0.8),
        polish=3,
        progress=lambda number, change: heard.append((number, change)),
    )
    assert [number for number, _ in heard] == list(range(1, value.sweeps + 1))
    assert heard[-1][1] == value.residual


def test_a_point_is_widened_with_a_warning():
    value = solve_value_function(Trailer(), Goal(state=(0, 0, 0, 0)), StateGrid.of_step(0.8))
    assert value.goal.tolerance == pytest.approx(value.grid.cell)
    assert "wider box" in value.warnings[0]


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        (Goal(state=(9, 0, 0, 0)), "`goal` must lie on the grid"),
        (Goal(state=(0, 0, 0, 0), tolerance=(math.inf, 0, 0, 0)), "`tolerance` must be finite"),
    ],
)
def test_bad_goals_are_refused(goal, words):
    with pytest.raises(InvalidInput, match=words):
        solve_value_function(Trailer(), goal, StateGrid.of_step(0.8))


@pytest.mark.parametrize("step", [0.0, -1.0, math.nan, 2.0])
def test_bad_steps_are_refused(step):
    with pytest.raises(InvalidInput, match=r"`grid` must have a step in \(0, 1\]"):
        StateGrid.of_step(step)


def test_nan_is_refused(solved):
    with pytest.raises(InvalidInput, match="`states` must be finite numbers"):
        solved().time_to_go([0, 0, math.nan, 0])


def test_a_warm_start_needs_fewer_passes_for_the_same_times(solved, states):
    coarse = solved(0.4, wide=True, polish=None)
    box, grid = coarse.goal, StateGrid.of_step(0.25)
    cold = solve_value_function(Trailer(), box, grid, polish=12)
    warm = solve_value_function(Trailer(), box, grid, polish=12, warm_start=coarse)
    assert warm.sweeps < cold.sweeps
    one, other = warm.interpolated(states), cold.interpolated(states)
    assert np.quantile(np.abs(one - other), 0.95) < 0.02
    with pytest.raises(InvalidInput, match="warm_start"):
        solve_value_function(Trailer(length=2.0), box, grid, warm_start=coarse)
    with pytest.raises(InvalidInput, match="polish"):
        solve_value_function(Trailer(), box, grid, polish=0, warm_start=coarse)


def test_a_table_has_converged_when_nothing_changes_any_more(solved):
    """Cubic passes leave a residual beside barriers; linear ones run until there is none."""
    linear, cubic = solved(polish=0), solved(polish=8)
    assert linear.converged
    assert linear.residual < 1e-3
    assert cubic.residual > 1e-2
    assert not cubic.converged
