"""Steps that are a number of periods, and what a team's pairs come to."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.bounds import (
    certified_grid,
    team_certificate,
)
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

ROOM = make_world([(0, 0), (2, 0), (2, 2), (0, 2)])


@pytest.mark.parametrize(("grid", "speed", "period"), [(0.5, 0.3, 0.05), (0.4, 1.1, 0.02)])
def test_a_step_of_the_table_is_a_number_of_periods(grid, speed, period):
    chosen = certified_grid(grid, speed, period)
    table = solve_visibility_game(
        ROOM, pursuer_speed=speed, evader_speed=0.3 * speed, grid=chosen, bound="lower"
    )
    periods = table.step / period
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert 0.9 * grid < chosen <= grid


@given(st.floats(0.01, 1.0), st.floats(0.1, 2.0), st.floats(0.01, 0.2))
def test_the_grid_is_no_coarser_unless_a_period_is_longer_than_its_step(grid, speed, period):
    chosen = certified_grid(grid, speed, period)
    shortest = certified_grid(1e-9, speed, period)
    assert chosen <= max(grid, shortest) * (1 + 1e-9)
    assert chosen >= shortest * (1 - 1e-9)


def test_a_grid_speed_or_period_of_nothing_is_refused():
    for k, name in enumerate(("grid", "pursuer_speed", "period")):
        values = [0.1, 0.3, 0.05]
        values[k] = 0.0
        with pytest.raises(InvalidInput, match=f"`{name}` must be positive"):
            certified_grid(*values)


@pytest.mark.parametrize(
    ("times", "assignment", "kept"),
    [
        ([3.0, 5.0], [0, 1], 3.0),
        # Two pursuers have the same evader: the better one counts.
        ([3.0, 5.0, np.inf], [0, 0, 1], 5.0),
        ([np.inf, np.inf], [1, 0], np.inf),
        # Nobody has evader 1, whatever pursuer 1 could do.
        ([3.0, 5.0], [0, -1], 0.0),
    ],
)
def test_a_team_keeps_its_evaders_as_long_as_the_first_that_it_loses(times, assignment, kept):
    assert team_certificate(np.array(times), np.array(assignment), 2) == kept
