"""Machines: where an auger reaches a cart, and tractors that tow trailers."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.harvest.machines import (
    MIDDLE,
    Hitch,
    box_middle,
    drive_team,
    is_alongside,
    pair_up,
)
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates

LENGTH, HITCH, REACH = 5.0, 0.9, 8.0
POSE = np.array([10.0, 5.0, np.pi / 2])


def state_of(box, heading, beta):
    """The state of a cart whose box has its middle at a place [m] and a heading."""
    theta = heading + beta
    behind = LENGTH * (1.0 - MIDDLE)
    x, y = (
        np.array(box)
        + behind * np.array([np.cos(heading), np.sin(heading)])
        + HITCH * np.array([np.cos(theta), np.sin(theta)])
    )
    return np.array([x, y, theta, beta])


def reached(state, stands=False):
    return is_alongside(POSE, state, LENGTH, HITCH, REACH, stands)


@pytest.mark.parametrize("beta", [0.0, 0.5, -1.2])
def test_the_middle_of_the_box_is_behind_the_hitch_along_the_trailer(beta):
    found = box_middle(state_of((3.0, -2.0), 0.7, beta), LENGTH, HITCH)
    np.testing.assert_allclose(found, (3.0, -2.0, 0.7), atol=1e-12)


@pytest.mark.parametrize("beta", [0.0, 0.6, -0.9])
def test_it_reaches_a_box_that_is_beside_and_parallel_however_its_tractor_turns(beta):
    beside = np.array([10.0 - REACH, 5.0])
    assert reached(state_of(beside, np.pi / 2, beta))
    assert not reached(state_of(np.add(beside, (0.0, 4.0)), np.pi / 2, beta))
    assert not reached(state_of(np.add(beside, (-1.5, 0.0)), np.pi / 2, beta))
    assert not reached(state_of(np.add(beside, (2 * REACH, 0.0)), np.pi / 2, beta))
    assert not reached(state_of(beside, np.pi / 2 + 0.3, beta))


def test_a_combine_that_stands_swings_its_auger():
    ahead = state_of((10.0 - REACH, 9.0), 0.3, 0.2)
    assert not reached(ahead)
    assert reached(ahead, stands=True)
    assert not reached(state_of((10.0 - REACH, 20.0), 0.3, 0.2), stands=True)


def test_a_combine_pours_only_into_a_cart_that_is_to_empty_it():
    poses = np.array([POSE, np.add(POSE, (40.0, 0.0, 0.0))])
    at = [state_of((x - REACH, 5.0), np.pi / 2, 0.1) for x in (50.0, 10.0)]
    stands = np.zeros(2, dtype=bool)

    def pairs(*wanted):
        return pair_up(
            poses, np.array(at), np.array(wanted, dtype=float), stands, LENGTH, HITCH, REACH
        ).tolist()

    assert pairs(1, 0) == [1.0, 0.0]
    assert pairs(1, -1) == [-1.0, 0.0]
    assert pairs(0, 1) == [-1.0, -1.0]


TRAILER = Trailer(speed=6.0, turn_rate=1.2, length=5.0, hitch_offset=0.8, reverse=True)
TOWED = Hitch(TRAILER.length, TRAILER.hitch_offset)
STATES = np.array([[1.0, 2.0, 0.3, 0.2], [-3.0, 4.0, 2.0, -0.7], [0.0, 0.0, -1.0, 1.1]])
CONTROLS = [(6.0, 1.0), (3.0, -0.5), (6.0, 0.0), (-2.0, 0.4), (0.0, 0.0)]


def step(states, v, omega, duration):
    """All carts under one control."""
    control = np.tile([float(v), float(omega)], 3)
    moved = drive_team(
        states.ravel(), control, TRAILER.speed, TRAILER.turn_rate, TOWED, duration, 30
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
