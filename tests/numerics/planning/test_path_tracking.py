"""A disturbed cart comes back to its path, forwards, backwards and through cusps."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.path_tracking import (
    make_path_tracker,
    tracking_control,
    tracking_error,
)
from sightfield.systems.numerics.planning.plan import (
    TrailerPath,
    driven_path,
    motion_step,
    refined_path,
)
from sightfield.systems.numerics.planning.trailer import Trailer

CART = Trailer(reverse=True)
# A cart of other size, whose hitch is behind the axle; jackknifed angle for a circle backwards.
TRUCK = Trailer(speed=2.0, turn_rate=0.8, length=4.0, hitch_offset=0.5, reverse=True)
LEFT, RIGHT = math.asin(0.4), -math.asin(0.4)

PATHS = {
    "forward": (CART, 0.0, [(1, 0, 2), (1, 0.6, 3), (1, -0.5, 3), (1, 0, 4)]),
    "turning at the bound": (CART, 0.0, [(1, 1, 1), (1, 0, 2), (1, -1, 1), (1, 0, 4)]),
    "straight back": (CART, 0.0, [(-1, 0, 9)]),
    "back on a circle": (CART, RIGHT, [(-1, 0.4, 9)]),
    "forth, back and forth": (CART, 0.0, [(1, 0.3, 4), (-1, -0.2, 2), (1, 0, 5)]),
    "long trailer": (TRUCK, 0.0, [(2, 0, 2), (2, 0.3, 4), (2, 0, 10)]),
    "long trailer backwards": (TRUCK, 0.0, [(-2, 0, 18)]),
}
DISTURBANCES = [(0, 0.3, 0, 0), (-0.3, -0.3, 0.3, 0.3), (0.3, 0, -0.3, -0.3), (0, 0.5, 0.5, 0.5)]


def follow(trailer, path, start, step=0.01):
    """Drive after a path until its end; the errors at its end and the controls given."""
    tracker = make_path_tracker(trailer, path)
    state, progress, controls, rates = np.array(start, dtype=float), 0.0, [], []
    while progress < tracker.duration:
        control, rate = tracking_control(tracker, state, progress)
        controls.append(control)
        rates.append(rate)
        state = motion_step(state, control, step, trailer)
        progress += rate * step
        assert len(controls) * step < 2 * tracker.duration
    return tracking_error(state, path.states[-1]), np.array(controls), np.array(rates)


@pytest.mark.parametrize("disturbance", DISTURBANCES)
@pytest.mark.parametrize("name", PATHS)
def test_a_disturbed_cart_comes_back_to_its_path(name, disturbance):
    trailer, beta, pieces = PATHS[name]
    path = driven_path(trailer, (1.0, 2.0, 0.7, beta), pieces)
    start = path.states[0] + np.array(disturbance)
    error, controls, rates = follow(trailer, path, start)
    # Sampling at 0.01 s alone leaves 0.01 of the way.
    assert np.abs(error).max() < 0.03
    assert np.abs(controls[:, 1]).max() <= trailer.turn_rate
    assert set(controls[:, 0]) <= {v for v, _, _ in pieces}
    assert rates.min() >= 0
    assert rates.max() <= 2


def test_large_disturbances_use_the_whole_turn_rate():
    path = driven_path(CART, (0, 0, 0, 0), [(1, 0, 12)])
    error, controls, _ = follow(CART, path, (0.0, 2.0, 0.0, 0.0))
    assert np.abs(controls[:, 1]).max() == CART.turn_rate
    assert np.abs(error).max() < 0.02


def test_without_a_disturbance_the_controls_are_the_planned_ones():
    trailer, beta, pieces = PATHS["forth, back and forth"]
    path = driven_path(trailer, (0, 0, 0, beta), pieces, step=0.05)
    tracker = make_path_tracker(trailer, path)
    for time in (0.0, 0.123, 3.99, 4.01, 7.5, 10.99):
        k = np.searchsorted(path.times, time, side="right") - 1
        state = motion_step(path.states[k], path.controls[k], time - path.times[k], trailer)
        control, rate = tracking_control(tracker, state, time)
        np.testing.assert_allclose(control, path.controls[k], atol=1e-9)
        assert rate == pytest.approx(1, abs=1e-9)


def test_whole_turns_make_no_difference():
    trailer, beta, pieces = PATHS["forward"]
    tracker = make_path_tracker(trailer, driven_path(trailer, (0, 0, 0, beta), pieces))
    state = np.array([0.1, 0.2, 0.3, 0.4])
    turned = state + np.array([0, 0, math.tau, -math.tau])
    np.testing.assert_allclose(
        tracking_control(tracker, state, 0.5)[0], tracking_control(tracker, turned, 0.5)[0]
    )


def test_the_mirror_image_of_a_path_is_followed_by_mirrored_controls():
    _, beta, pieces = PATHS["back on a circle"]
    tracker = make_path_tracker(CART, driven_path(CART, (0, 0, 0, beta), pieces))
    mirrored = [(v, -omega, t) for v, omega, t in pieces]
    other = make_path_tracker(CART, driven_path(CART, (0, 0, 0, -beta), mirrored))
    state = np.array([0.02, 0.03, 0.04, beta + 0.05])
    control, rate = tracking_control(tracker, state, 0.1)
    mirror_control, mirror_rate = tracking_control(other, state * [1, -1, -1, -1], 0.1)
    np.testing.assert_allclose(mirror_control, control * [1, -1])
    assert mirror_rate == pytest.approx(rate)


def test_at_the_end_everything_stands_still():
    tracker = make_path_tracker(CART, driven_path(CART, (0, 0, 0, 0), [(1, 0, 1)]))
    control, rate = tracking_control(tracker, np.array([0.9, 0.1, 0, 0]), 1.0)
    assert (*control, rate) == (0, 0, 0)


def test_a_driven_path_has_the_closed_form_of_straights_and_circles():
    path = driven_path(CART, (0, 0, 0, 0.8), [(1, 0, 1), (-1, 0.5, 2)])
    x, y, theta, beta = path.states[path.times == 1][0]
    np.testing.assert_allclose([x, y, theta], [1, 0, 0], atol=1e-12)
    assert math.tan(beta / 2) == pytest.approx(math.tan(0.4) * math.exp(-1), rel=1e-6)
    np.testing.assert_allclose(
        path.states[-1, :3], [1 - 2 * math.sin(1), -2 * (1 - math.cos(1)), 1], atol=1e-6
    )


def test_a_refined_path_keeps_its_samples_and_its_controls():
    path = driven_path(CART, (0, 0, 0, 0.3), [(1, 0.5, 1.0), (1, -1, 0.33)], step=0.5)
    fine = refined_path(path, CART, 0.01)
    at = np.searchsorted(fine.times, path.times)
    np.testing.assert_array_equal(fine.times[at], path.times)
    np.testing.assert_array_equal(fine.states[at], path.states)
    assert np.diff(fine.times).max() <= 0.01 + 1e-12
    np.testing.assert_array_equal(fine.controls[at[:-1]], path.controls)
    exact = driven_path(CART, (0, 0, 0, 0.3), [(1, 0.5, 1.0), (1, -1, 0.33)], step=0.01)
    np.testing.assert_allclose(
        np.interp(0.7, fine.times, fine.states[:, 3]),
        np.interp(0.7, exact.times, exact.states[:, 3]),
        atol=1e-4,
    )


@pytest.mark.parametrize(
    ("times", "states", "controls"),
    [
        ([0.0], np.zeros((1, 4)), np.zeros((0, 2))),
        ([0.0, 1.0], np.zeros((2, 3)), np.zeros((1, 2))),
        ([0.0, 1.0], np.zeros((2, 4)), np.zeros((2, 2))),
        ([0.0, 0.0], np.zeros((2, 4)), np.zeros((1, 2))),
        ([0.0, 1.0], np.full((2, 4), np.nan), np.zeros((1, 2))),
    ],
)
def test_what_is_no_path_is_refused(times, states, controls):
    with pytest.raises(InvalidInput, match="path"):
        make_path_tracker(CART, TrailerPath(np.array(times), states, controls))


def test_bad_weights_and_pieces_are_refused():
    path = driven_path(CART, (0, 0, 0, 0), [(1, 0, 1)])
    with pytest.raises(InvalidInput, match="weights"):
        make_path_tracker(CART, path, (1, 0, 1, 1))
    with pytest.raises(InvalidInput, match="pieces"):
        driven_path(CART, (0, 0, 0, 0), [])
    with pytest.raises(InvalidInput, match="duration"):
        driven_path(CART, (0, 0, 0, 0), [(1, 0, 0)])
    with pytest.raises(InvalidInput, match="step"):
        refined_path(path, CART, 0.0)
