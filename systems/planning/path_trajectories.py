"""Planned paths as Drake trajectories."""

import numpy as np
from pydrake.trajectories import PiecewisePolynomial

from ..numerics.planning.plan import TrailerPath, require_path
from ..numerics.planning.trailer import Trailer, trailer_rates


def control_trajectory(path: TrailerPath) -> PiecewisePolynomial:
    """v, omega over time, each held from one sample to the next [m/s], [rad/s].

    Raises:
        InvalidInput: The path has not two samples at increasing times.
    """
    require_path(path)
    held = np.concatenate([path.controls, path.controls[-1:]])
    return PiecewisePolynomial.ZeroOrderHold(path.times, held.T)


def state_trajectory(path: TrailerPath, trailer: Trailer) -> PiecewisePolynomial:
    """x, y, theta, beta over time [m], [m], [rad], [rad]: cubics with the path's own rates.

    They go through the samples, with the rates that the controls give on either side; in between
    the error falls with the fourth power of the time between samples.

    Raises:
        InvalidInput: The path has not two samples at increasing times.
    """
    require_path(path)
    v, omega = path.controls.T
    whole = PiecewisePolynomial()
    for k in range(len(path.controls)):
        samples = path.states[k : k + 2].T
        # The rates of a cusp or of a change of turn differ before and after it: one cubic each.
        rates = np.array(
            [trailer_rates(theta, beta, v[k], omega[k], trailer) for _, _, theta, beta in samples.T]
        ).T
        piece = PiecewisePolynomial.CubicHermite(path.times[k : k + 2], samples, rates)
        whole.ConcatenateInTime(piece)
    return whole
