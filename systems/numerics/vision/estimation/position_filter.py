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


def correct_at(
    track: Track, passed: float, position: np.ndarray, covariance: np.ndarray, density: float
) -> Track | None:
    """The point after a measurement, at the later of the track's time and the measurement's.

    A measurement that comes late is one of where the point was: z = x - t v, t the time since, with
    the noise that has changed the point since added to its own (Bar-Shalom, IEEE AES 38, 2002, has
    the exact update).

    Args:
        track: Before.
        passed: Time of the measurement after the track's, negative if it is late [s].
        position: Measured, shape (2,) [m].
        covariance: Of it, shape (2, 2) [m^2].
        density: q, of the acceleration [m^2/s^3].

    Returns:
        The point, or None if the measurement is beyond the gate.
    """
    track = predict(track, max(passed, 0.0), density)
    late = min(passed, 0.0)
    look = np.hstack([np.eye(2), late * np.eye(2)])
    noise = covariance + density * abs(late) ** 3 / 3 * np.eye(2)
    surprise = position - look @ track.mean
    expected = look @ track.covariance @ look.T + noise
    if float(surprise @ np.linalg.solve(expected, surprise)) > GATE:
        return None
    gain = np.linalg.solve(expected, look @ track.covariance).T
    keep = np.eye(4) - gain @ look
    # Joseph's form stays symmetric and positive whatever the rounding.
    after = keep @ track.covariance @ keep.T + gain @ noise @ gain.T
    return Track(track.mean + gain @ surprise, after)


def limit_speed(track: Track, speed: float) -> Track:
    """The point, no faster than it can be.

    Args:
        track: Before.
        speed: At most [m/s].
    """
    fast = float(np.hypot(*track.mean[2:]))
    if fast <= speed:
        return track
    mean = track.mean.copy()
    mean[2:] *= speed / fast
    return Track(mean, track.covariance)


def correct(track: Track, position: np.ndarray, covariance: np.ndarray) -> Track | None:
    """The point after a measurement at the same time, or None if that is beyond the gate.

    Args:
        track: Before.
        position: Measured, shape (2,) [m].
        covariance: Of it, shape (2, 2) [m^2].
    """
    return correct_at(track, 0.0, position, covariance, 0.0)
