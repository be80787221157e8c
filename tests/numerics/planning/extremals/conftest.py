"""What tests of plans made of arcs share."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.planning.plan import Plan
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates


def driven_end(trailer: Trailer, plan: Plan) -> np.ndarray:
    """Where a plan's controls lead, each held, by the equations of motion: shape (4,)."""
    path = plan.path
    assert path is not None
    assert np.all(np.diff(path.times) > 0)
    assert path.times[-1] == pytest.approx(plan.time)
    assert path.controls.shape == (path.times.size - 1, 2)
    assert np.all(np.abs(path.controls[:, 1]) <= trailer.turn_rate * (1 + 1e-9))
    state = path.states[0]
    for k, (v, omega) in enumerate(path.controls):

        def rates(_, q, v=v, omega=omega):
            return trailer_rates(q[2], q[3], v, omega, trailer)

        interval = (path.times[k], path.times[k + 1])
        state = solve_ivp(rates, interval, state, rtol=1e-10, atol=1e-12).y[:, -1]
    return state


@pytest.fixture
def assert_plan_obeys() -> Callable[..., None]:
    """A function of a trailer, a start and a plan: fails unless the plan leads to its goal."""

    def check(trailer, start, plan, tolerance=1e-8) -> None:
        assert plan.converged, plan.status
        assert plan.path.states[0] == pytest.approx(start)
        assert max(plan.goal.miss(plan.path.states[-1])) < 1e-9
        assert driven_end(trailer, plan) == pytest.approx(plan.path.states[-1], abs=tolerance)

    return check
