"""What the pursuers together know of the evaders from their pictures."""

from collections.abc import Sequence

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_types import read, state_vector
from ..numerics.errors import require, require_non_negative, require_positive
from ..numerics.geometry.world import World
from ..numerics.vision.shared_estimate import Tracks, Whereabouts, correct, no_tracks, predict


class SharedEstimate(LeafSystem):
    """Joins the estimates of all pursuers' cameras and remembers evaders out of sight.

    Each period, for each evader: x stays and P grows by the way it can have gone; then each
    camera's valid estimate z with covariance R corrects them, K = P (P + R)^-1, x' = x + K (z - x),
    P' = P - K P, unless z is further off than 4 standard deviations.

    .. pydrake_system::

        name: SharedEstimate
        input_ports:
        - position_0
        - covariance_0
        - valid_0
        - position_1
        - covariance_1
        - valid_1
        output_ports:
        - evader_position
        - evader_covariance
        - evader_known

    =================  ====  ====  =====
    port               size  unit  frame
    =================  ====  ====  =====
    position_0         2 Ne  m     world
    covariance_0       4 Ne  m^2   world
    valid_0            Ne    -     -
    position_1         2 Ne  m     world
    covariance_1       4 Ne  m^2   world
    valid_1            Ne    -     -
    evader_position    2 Ne  m     world
    evader_covariance  4 Ne  m^2   world
    evader_known       Ne    -     -
    =================  ====  ====  =====

    There are inputs for each of the cameras; two are shown. Covariances are row by row; `valid`
    is 1 where there is an estimate. `evader_position` is always a place where an evader can be,
    or outside the world while `evader_known` is 0: nothing sees it there.

    Source: ours; Zhang 2014, 2.2.8.3, collects the estimates at one work station.

    Args:
        regions: Where the evaders' centres can be.
        cameras: Number of cameras.
        evaders: Number of evaders Ne.
        speed: Of the evaders, at most [m/s].
        period: Between pictures [s].
        delay: From a picture to its use [s].

    Raises:
        InvalidInput: A number is out of its range.
    """

    def __init__(
        self,
        regions: Sequence[World],
        *,
        cameras: int,
        evaders: int,
        speed: float,
        period: float,
        delay: float = 0.0,
    ):
        super().__init__()
        require(cameras > 0, "cameras", "be positive", cameras)
        require(evaders > 0, "evaders", "be positive", evaders)
        require_non_negative("speed", speed)
        require_positive("period", period)
        require_non_negative("delay", delay)
        self._whereabouts = Whereabouts(regions)
        self._count, self._speed, self._period = evaders, float(speed), float(period)
        self._cameras = [
            tuple(
                self.DeclareVectorInputPort(f"{name}_{i}", size * evaders)
                for name, size in (("position", 2), ("covariance", 4), ("valid", 1))
            )
            for i in range(cameras)
        ]
        nothing = no_tracks(evaders)
        self._positions = self.DeclareDiscreteState(state_vector(nothing.positions.ravel()))
        self._covariances = self.DeclareDiscreteState(state_vector(nothing.covariances.ravel()))
        self.DeclarePeriodicDiscreteUpdateEvent(period, delay, self._update)
        state = {self.xd_ticket()}
        self.DeclareVectorOutputPort(
            "evader_position", 2 * evaders, self._calc_position, prerequisites_of_calc=state
        )
        self.DeclareStateOutputPort("evader_covariance", self._covariances)
        self.DeclareVectorOutputPort(
            "evader_known", evaders, self._calc_known, prerequisites_of_calc=state
        )

    def _tracks(self, context) -> Tracks:
        return Tracks(
            context.get_discrete_state(self._positions).value().reshape(-1, 2),
            context.get_discrete_state(self._covariances).value().reshape(-1, 2, 2),
        )

    def _update(self, context, discrete_state):
        tracks = predict(self._tracks(context), self._speed, self._period)
        for position, covariance, valid in self._cameras:
            tracks = correct(
                tracks,
                read(valid, context) > 0.5,
                read(position, context).reshape(-1, 2),
                read(covariance, context).reshape(-1, 2, 2),
            )
        discrete_state.set_value(self._positions, tracks.positions.ravel())
        discrete_state.set_value(self._covariances, tracks.covariances.ravel())

    def _calc_position(self, context, output):
        output.set_value(self._whereabouts.places(self._tracks(context)).ravel())

    def _calc_known(self, context, output):
        output.set_value(np.asarray(self._tracks(context).known, dtype=float))
