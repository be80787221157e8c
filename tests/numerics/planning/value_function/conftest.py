"""Value functions that several tests look at; solved once."""

from collections.abc import Callable
from functools import lru_cache

import pytest

from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.value_function.value_function import ValueFunction


@pytest.fixture(scope="session")
def solved() -> Callable[..., ValueFunction]:
    """Solve for a box of one thesis cell around a state, in the middle of a square grid."""

    @lru_cache
    def solve(
        state=(0.0, 0.0, 0.0, 0.0),
        step: float = 0.2,
        beta_width: float = THESIS_TOLERANCE[3],
        reverse: bool = False,
        polish: int = 24,
    ) -> ValueFunction:
        goal = Goal(state=state, tolerance=(*THESIS_TOLERANCE[:3], beta_width))
        grid = StateGrid.of_step(step, state[:2])
        return solve_value_function(Trailer(reverse=reverse), goal, grid, polish=polish)

    return solve
