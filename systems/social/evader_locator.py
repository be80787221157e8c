"""Where the evader is, from the pictures that friends have posted."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.systems.framework import LeafSystem

from ..drake_parts import AbstractValue
from ..numerics.errors import require_non_negative, require_one_of, require_positive
from ..numerics.social.landmarks.maze import Maze
from ..numerics.social.localisation.location import Reading, nearest_free, read_picture
from ..numerics.social.localisation.relative import METHODS
from ..numerics.social.recognition.references import maze_references


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known of the evader.

    Attributes:
        readings: Readings of the pictures that came last.
        position: Shape (2,) [m]; NaN before the first location.
        covariance: Covariance at the time of the picture, shape (2, 2) [m^2].
        located_at: When the picture was taken [s]; negative before the first location.
        locations: How many pictures gave a location.
    """

    readings: tuple[Reading, ...]
    position: np.ndarray
    covariance: np.ndarray
    located_at: float
    locations: int


class EvaderLocator(LeafSystem):
    """Looks for the evader and landmarks in new pictures, and keeps the newest location.

    Locations from pictures taken at the same time are averaged by their covariances; a picture
    older than the present location changes nothing. Since then the evader may have moved anywhere:

        covariance = covariance_then + (speed age)^2 I,  age = time - located_at.

    .. pydrake_system::

        name: EvaderLocator
        input_ports:
        - pictures
        output_ports:
        - evader_position
        - evader_covariance
        - located_at
        - locations
        - readings

    =================  ==========================  ====  =====  ===========
    port               size                        unit  frame  feedthrough
    =================  ==========================  ====  =====  ===========
    pictures           abstract: tuple of Picture  -     -      -
    evader_position    2                           m     world  -
    evader_covariance  4                           m^2   world  -
    located_at         1                           s     -      -
    locations          1                           -     -      -
    readings           abstract: tuple of Reading  -     -      -
    =================  ==========================  ====  =====  ===========

    `located_at` is when the picture was taken, and negative before the first location: then
    `evader_position` is NaN and the covariance, row by row, infinite on its diagonal. `locations`
    counts pictures that gave a location; `readings` has one entry for each of the last pictures.

    Source: Zhang 2014, 2.3.3 and 2.3.4.2; covariances are ours.

    Args:
        maze: The map, and what to look for.
        speed: Of the evader, at most [m/s].
        period: Between looks at the input [s].
        offset: Of the first look [s].
        features: One of `recognition.references.METHODS`.
        method: One of `localisation.relative.METHODS`.

    Raises:
        InvalidInput: A number is out of its range, or there is no such method.
    """

    def __init__(
        self,
        maze: Maze,
        *,
        speed: float,
        period: float = 1.0,
        offset: float = 0.0,
        features: str = "sift",
        method: str = "level",
    ):
        super().__init__()
        require_non_negative("speed", speed)
        require_positive("period", period)
        require_non_negative("offset", offset)
        require_one_of("method", method, METHODS)
        self._maze, self._speed, self._method = maze, float(speed), method
        self._references = maze_references(maze, features)
        self._pictures = self.DeclareAbstractInputPort("pictures", AbstractValue.Make(()))
        nothing = Knowledge((), np.full(2, math.nan), np.diag([math.inf, math.inf]), -1.0, 0)
        self._state = self.DeclareAbstractState(AbstractValue.Make(nothing))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period, offset, self._look)
        state = {self.abstract_state_ticket(self._state)}
        for name, size, calc, sources in (
            ("evader_position", 2, self._calc_position, state),
            ("evader_covariance", 4, self._calc_covariance, {*state, self.time_ticket()}),
            ("located_at", 1, self._calc_time, state),
            ("locations", 1, self._calc_count, state),
        ):
            self.DeclareVectorOutputPort(name, size, calc, prerequisites_of_calc=sources)
        self.DeclareAbstractOutputPort(
            "readings",
            lambda: AbstractValue.Make(()),
            self._calc_readings,
            prerequisites_of_calc=state,
        )

    def _known(self, context) -> Knowledge:
        return context.get_abstract_state(self._state).get_value()

    def _look(self, context, state):
        known = self._known(context)
        position, covariance, located_at = known.position, known.covariance, known.located_at
        pictures: Any = self._pictures.Eval(context)
        readings = tuple(
            read_picture(each, self._maze, self._references, self._method) for each in pictures
        )
        found = [each for each in readings if each.location.outcome.has_location]
        for each in found:
            then, location = each.picture.time, each.location
            if then > located_at:
                position, covariance, located_at = location.position, location.covariance, then
            elif then == located_at:
                position, covariance = _averaged(
                    position, covariance, location.position, location.covariance
                )
                # Around a corner, the mean of two free places can lie in the wall.
                position = nearest_free(self._maze, position)
        count = known.locations + len(found)
        state.get_mutable_abstract_state(self._state).set_value(
            Knowledge(readings, position, covariance, located_at, count)
        )

    def _calc_position(self, context, output):
        output.set_value(self._known(context).position)

    def _calc_covariance(self, context, output):
        known = self._known(context)
        age = max(context.get_time() - known.located_at, 0.0)
        grown = known.covariance + (self._speed * age) ** 2 * np.eye(2)
        output.set_value(grown.ravel())

    def _calc_time(self, context, output):
        output.set_value([self._known(context).located_at])

    def _calc_count(self, context, output):
        output.set_value([float(self._known(context).locations)])

    def _calc_readings(self, context, output):
        output.set_value(self._known(context).readings)


def _averaged(
    a: np.ndarray, a_spread: np.ndarray, b: np.ndarray, b_spread: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The mean of two positions by their covariances, and its own."""
    gain = a_spread @ np.linalg.inv(a_spread + b_spread)
    spread = a_spread - gain @ a_spread
    return a + gain @ (b - a), 0.5 * (spread + spread.T)
