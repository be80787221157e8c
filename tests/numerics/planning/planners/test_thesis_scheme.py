"""The thesis's averages: that they are computed, and that they are not the time to go."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.planners.thesis_scheme import (
    plan_by_averaging,
    solve_by_averaging,
)
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid

GOAL = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.4, 0.4, 0.55, 0.55))


@pytest.fixture(scope="module")
def table():
    return solve_by_averaging(Trailer(), GOAL, StateGrid.of_step(0.4))


def test_the_table_is_a_fixed_point_of_the_averages(table):
    # Straight behind the goal: x' > 0, y' = 0, and both signs of theta' and beta'.
    u, step = table.table, 0.05
    i = j = table.grid.x_count // 2
    i -= 4
    best = u[0, 0, j, i]
    means = []
    for turn in (-1, 1):
        corners = [u[t, b, j, x] for t in (0, turn) for b in (0, turn) for x in (i, i + 1)]
        means.append(np.mean(corners) + step)
    assert best == pytest.approx(min(means), abs=2e-3)


def test_the_table_depends_on_the_step_alone_and_is_not_the_time_to_go(table):
    # From four cells away a cart takes 1.2 to the box at least.
    behind = [[-1.6, 0.0, 0.0, 0.0]]
    assert table.time_to_go(behind)[0] < 0.6
    doubled = solve_by_averaging(Trailer(), GOAL, StateGrid.of_step(0.4), step=0.1)
    inner = np.isfinite(table.table) & (table.table < 0.5)
    np.testing.assert_allclose(doubled.table[inner], 2 * table.table[inner], atol=0.02)


def test_a_refined_grid_does_not_bring_it_nearer():
    spot = [[-1.6, 0.0, 0.0, 0.0]]
    wide = Goal(state=GOAL.state, tolerance=(0.5, 0.5, 0.7, 0.7))
    coarse, fine = (
        solve_by_averaging(Trailer(), wide, StateGrid.of_step(step)).time_to_go(spot)[0]
        for step in (0.5, 0.25)
    )
    # Twice as many steps of the same length: twice the value.
    assert fine > 1.4 * coarse


def test_the_label_says_what_it_is(table):
    assert table.scheme == "averaging"
    assert any("not the time to go" in warning for warning in table.warnings)


def test_its_path_leads_straight_ahead_into_the_box(table):
    plan = plan_by_averaging(Trailer(), (-3.0, 0.0, 0.0, 0.0), GOAL, value=table)
    assert plan.status == "arrived"
    assert max(GOAL.miss(plan.path.states[-1])) == 0
    assert plan.time >= 2.6 - 1e-9
    assert plan.notes["time_to_go"] < 0.7 * plan.time


def test_reverse_is_refused():
    with pytest.raises(InvalidInput, match="forwards only"):
        solve_by_averaging(Trailer(reverse=True), GOAL, StateGrid.of_step(0.4))


def test_a_path_into_a_wider_box_has_not_converged(table):
    """To the point no path is as quick; the table's box is a cell wide."""
    point = Goal(state=GOAL.state)
    plan = plan_by_averaging(Trailer(), (-3.0, 0.0, 0.0, 0.0), point, value=table)
    assert plan.path is not None
    assert (plan.status, plan.converged) == ("arrived in a wider box", False)
