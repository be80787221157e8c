"""Estimates of single pictures, smoothed and carried over the pictures without one."""

import numpy as np
from pydrake.common.containers import namedview
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_positive
from ..numerics.vision.estimation.position_filter import Track, correct, predict, start_track

# Of one point: when it was last measured (-inf: never), x, y, v_x, v_y, and their covariance.
_SIZE = 1 + 4 + 16
Frame = namedview("Frame", ["number", "time", "arrived"])


class PositionFilter(LeafSystem):
    """A Kalman filter of nearly constant velocity for each of N points.

    Each new picture's valid estimates correct the points at the time it was taken; a picture is
    used once, however long it is shown. Outputs are predictions to the present time.

    .. pydrake_system::

        name: PositionFilter
        input_ports:
        - position
        - covariance
        - valid
        - frame
        output_ports:
        - filtered_position
        - filtered_covariance
        - velocity
        - known

    ===================  ====  =======  =====
    port                 size  unit     frame
    ===================  ====  =======  =====
    position             2 N   m        world
    covariance           4 N   m^2      world
    valid                N     -        -
    frame                3     -, s, -  -
    filtered_position    2 N   m        world
    filtered_covariance  4 N   m^2      world
    velocity             2 N   m/s      world
    known                N     -        -
    ===================  ====  =======  =====

    The inputs are `ShellEstimator`'s and the `frame` of its camera. `known` is 1 until a point
    has gone unmeasured for longer than `patience`; then positions and velocities are NaN and the
    covariance's diagonal is infinite. An estimate beyond the gate (1 in 1000) is left out, and
    taken for a new beginning when the point is not known.

    Source: ours.

    Args:
        count: Number of points N.
        speed_std: Standard deviation of each part of a point's unknown velocity [m/s].
        acceleration_density: Of the white noise that changes velocities [m^2/s^3].
        patience: How long a point stays known without a measurement [s].
        period: Between looks at the inputs, not longer than the camera's [s].

    Raises:
        InvalidInput: A number is not positive.
    """

    def __init__(
        self,
        count: int,
        *,
        speed_std: float = 0.3,
        acceleration_density: float = 0.05,
        patience: float = 1.5,
        period: float = 0.1,
    ):
        super().__init__()
        require(count > 0, "count", "be positive", count)
        require_positive("speed_std", speed_std)
        require_positive("acceleration_density", acceleration_density)
        require_positive("patience", patience)
        require_positive("period", period)
        self._count, self._patience = count, float(patience)
        self._speed_std, self._density = float(speed_std), float(acceleration_density)
        self._inputs = [
            self.DeclareVectorInputPort(name, size * count)
            for name, size in (("position", 2), ("covariance", 4), ("valid", 1))
        ]
        self._frame = self.DeclareVectorInputPort("frame", 3)
        # Number and time of the last picture, then the points at that time.
        start = np.zeros(2 + count * _SIZE)
        start[0], start[2::_SIZE] = -1.0, -np.inf
        self._state = self.DeclareDiscreteState(state_vector(start))
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._look)
        now = {self.xd_ticket(), self.time_ticket()}
        for name, size, calc in (
            ("filtered_position", 2, self._calc_position),
            ("filtered_covariance", 4, self._calc_covariance),
            ("velocity", 2, self._calc_velocity),
            ("known", 1, self._calc_known),
        ):
            self.DeclareVectorOutputPort(name, size * count, calc, prerequisites_of_calc=now)

    def _look(self, context, discrete_state):
        state = discrete_state.get_mutable_value(self._state)
        frame = Frame(read(self._frame, context))
        if frame.number < 0 or frame.number == state[0]:
            return
        positions, covariances, valid = (read(port, context) for port in self._inputs)
        passed = frame.time - state[1]
        state[:2] = frame.number, frame.time
        for row, z, spread, seen in zip(
            state[2:].reshape(-1, _SIZE),
            positions.reshape(-1, 2),
            covariances.reshape(-1, 2, 2),
            valid,
            strict=True,
        ):
            fresh = frame.time - row[0] <= self._patience
            track = predict(_track(row), passed, self._density) if fresh else None
            if seen:
                corrected = None if track is None else correct(track, z, spread)
                if track is None:
                    corrected = start_track(z, spread, self._speed_std)
                if corrected is not None:
                    track, row[0] = corrected, frame.time
            if track is not None:
                row[1:5], row[5:] = track.mean, track.covariance.ravel()

    def _present(self, context) -> list[Track | None]:
        """The points now; None for those that are not known."""
        state, now = context.get_discrete_state(self._state).value(), context.get_time()
        rows = state[2:].reshape(-1, _SIZE)
        return [
            predict(_track(row), now - state[1], self._density)
            if now - row[0] <= self._patience
            else None
            for row in rows
        ]

    def _means(self, context, part: slice) -> np.ndarray:
        unknown = np.full(4, np.nan)
        tracks = self._present(context)
        return np.ravel([(unknown if each is None else each.mean)[part] for each in tracks])

    def _calc_position(self, context, output):
        output.set_value(self._means(context, slice(0, 2)))

    def _calc_velocity(self, context, output):
        output.set_value(self._means(context, slice(2, 4)))

    def _calc_covariance(self, context, output):
        unknown = np.diag([np.inf, np.inf])
        tracks = self._present(context)
        output.set_value(
            np.ravel([unknown if each is None else each.covariance[:2, :2] for each in tracks])
        )

    def _calc_known(self, context, output):
        output.set_value([float(each is not None) for each in self._present(context)])


def _track(row: np.ndarray) -> Track:
    return Track(row[1:5], row[5:].reshape(4, 4))
