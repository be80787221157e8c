"""A Kalman filter for one point that moves at nearly constant velocity in the plane.

x' = v, v' = white noise of density q: between measurements dt apart,

    F = [I, dt I; 0, I],   Q = q [dt^3/3 I, dt^2/2 I; dt^2/2 I, dt I].

Source: ours; textbook (Bar-Shalom, Li, Kirubarajan, Estimation with Applications, 6.2).
"""

from typing import NamedTuple

import numpy as np

# A measurement whose squared distance, in standard deviations, is greater comes by chance once
# in a thousand times: it is taken for a mistake.
GATE = 13.8


class Track(NamedTuple):
    """What is known of a point.

    Attributes:
        mean: x, y [m], and velocity [m/s], shape (4,).
        covariance: Shape (4, 4).
    """

    mean: np.ndarray
    covariance: np.ndarray


def start_track(position: np.ndarray, covariance: np.ndarray, speed_std: float) -> Track:
    """A point seen for the first time.

    Args:
        position: Measured, shape (2,) [m].
        covariance: Of it, shape (2, 2) [m^2].
        speed_std: Standard deviation of each part of its unknown velocity [m/s].
    """
    wide = np.zeros((4, 4))
    wide[:2, :2] = covariance
    wide[2:, 2:] = speed_std**2 * np.eye(2)
    return Track(np.concatenate([position, np.zeros(2)]), wide)


def predict(track: Track, duration: float, density: float) -> Track:
    """The point some time later.

    Args:
        track: Before.
        duration: dt, not negative [s].
        density: q, of the acceleration [m^2/s^3].
    """
    eye, zero = np.eye(2), np.zeros((2, 2))
    step = np.block([[eye, duration * eye], [zero, eye]])
    noise = np.block(
        [
            [duration**3 / 3 * eye, duration**2 / 2 * eye],
            [duration**2 / 2 * eye, duration * eye],
        ]
    )
    return Track(step @ track.mean, step @ track.covariance @ step.T + density * noise)


def correct(track: Track, position: np.ndarray, covariance: np.ndarray) -> Track | None:
    """The point after a measurement at the same time, or None if that is beyond the gate.

    Args:
        track: Before.
        position: Measured, shape (2,) [m].
        covariance: Of it, shape (2, 2) [m^2].
    """
    surprise = position - track.mean[:2]
    expected = track.covariance[:2, :2] + covariance
    if float(surprise @ np.linalg.solve(expected, surprise)) > GATE:
        return None
    gain = np.linalg.solve(expected, track.covariance[:2]).T
    keep = np.eye(4)
    keep[:, :2] -= gain
    # Joseph's form stays symmetric and positive whatever the rounding.
    after = keep @ track.covariance @ keep.T + gain @ covariance @ gain.T
    return Track(track.mean + gain @ surprise, after)
