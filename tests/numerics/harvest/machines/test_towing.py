"""A cart's step obeys the equations of the tractor-trailer."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.harvest.machines.cart import Hitch
from sightfield.systems.numerics.harvest.machines.towing import drive_team
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates

TRAILER = Trailer(speed=6.0, turn_rate=1.2, length=5.0, hitch_offset=0.8, reverse=True)
HITCH = Hitch(TRAILER.length, TRAILER.hitch_offset)
STATES = np.array([[1.0, 2.0, 0.3, 0.2], [-3.0, 4.0, 2.0, -0.7], [0.0, 0.0, -1.0, 1.1]])
CONTROLS = [(6.0, 1.0), (3.0, -0.5), (6.0, 0.0), (-2.0, 0.4), (0.0, 0.0)]


def step(states, v, omega, duration):
    """All carts under one control."""
    control = np.tile([float(v), float(omega)], 3)
    moved = drive_team(
        states.ravel(), control, TRAILER.speed, TRAILER.turn_rate, HITCH, duration, 30
    )
    return moved.reshape(3, 4)


@pytest.mark.parametrize(("v", "omega"), CONTROLS)
def test_a_step_is_the_solution_of_the_equations_of_motion(v, omega):
    found = step(STATES, v, omega, 0.7)
    for state, after in zip(STATES, found, strict=True):
        solved = solve_ivp(
            lambda _, s: trailer_rates(s[2], s[3], v, omega, TRAILER),
            (0.0, 0.7),
            state,
            rtol=1e-10,
            atol=1e-10,
        )
        np.testing.assert_allclose(after, solved.y[:, -1], atol=1e-7)


def test_driving_back_control_by_control_retraces_the_way():
    states = [STATES]
    for v, omega in CONTROLS:
        states.append(step(states[-1], v, omega, 0.25))
    after = states[-1]
    for (v, omega), before in zip(reversed(CONTROLS), reversed(states[:-1]), strict=True):
        after = step(after, -v, -omega, 0.25)
        np.testing.assert_allclose(after, before, atol=1e-6)


def test_controls_beyond_the_bounds_are_clipped():
    most = step(STATES, TRAILER.speed, -TRAILER.turn_rate, 0.25)
    np.testing.assert_array_equal(step(STATES, 9.0, -3.0, 0.25), most)
