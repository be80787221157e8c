"""Where a cart is to be to be beside a combine, and when."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..machines.alongside import MIDDLE, STANDING
from ..machines.cart import Cart
from .ground import Traffic, stations_at
from .lane import STEP, Lane
from .route import Meeting
from .way import poses_on

# A cart comes onto the lane so far behind its place, so that its trailer is straight there [m].
SETTLE = 8.0
# Where beside a combine that stands a cart is tried, to its left, ahead and behind, turned how
# [rad], and how far off as a part of how far the auger reaches then.
BEARINGS, HEADINGS = (1.6, 2.1, 2.6, 3.0, 1.1, 0.7, 0.3), (0.0, 3.14159, 1.57, -1.57)
NEARBY = 0.9
# How strongly it closes the gap to its place [1/s].
CATCH_UP = 0.5


@dataclass(frozen=True, eq=False)
class Lanes:
    """The lanes beside all combines, as a cart sees them.

    Attributes:
        cart: The cart.
        of: Of each combine its lanes, in order.
    """

    cart: Cart
    of: tuple[Sequence[Lane], ...]

    @property
    def lead(self) -> float:
        """From the middle of the trailer's box ahead to the tractor's axle [m]."""
        return self.cart.length * (1.0 - MIDDLE) + self.cart.hitch_offset

    def numbers_at(self, combine: int, station: float) -> list[int]:
        """Which lanes serve a combine at a station: one, several where it ends, or none on its way
        between two loops.
        """
        return [
            number
            for number, lane in enumerate(self.of[combine])
            if lane.begin - 1e-6 <= station <= lane.end + 1e-6
        ]

    def place_at(self, combine: int, number: int, station: float) -> float:
        """Way along a lane at which the tractor is to be for a station of the combine [m].

        Args:
            number: Of the lane.
        """
        return self.of[combine][number].slot_at(station) + self.lead

    def found_at(
        self, combine: int, number: int, station: float, state: np.ndarray
    ) -> tuple[float, float]:
        """Way along a lane to the point nearest to a cart, and how far that is [m], [m].

        Args:
            number: Of the lane.
            station: Of the combine [m].
            state: x, y, theta, beta of the cart, shape (4,) [m], [m], [rad], [rad].
        """
        points = self.of[combine][number].points
        gaps = np.hypot(*(points[:, :2] - state[:2]).T)
        # A closed lane may pass twice: the place nearer to the combine counts.
        place = self.place_at(combine, number, station)
        nearest = int(np.argmin(gaps + 1e-3 * np.abs(STEP * np.arange(len(gaps)) - place)))
        return STEP * nearest, float(gaps[nearest])

    def nearest(self, combine: int, station: float, state: np.ndarray) -> tuple[float, float, int]:
        """As `found_at` for the lane that is nearest of those that serve a combine; its number.

        Args:
            station: Of the combine [m].
            state: x, y, theta, beta of the cart, shape (4,) [m], [m], [rad], [rad].
        """
        numbers = self.numbers_at(combine, station)
        found = [(*self.found_at(combine, n, station, state), n) for n in numbers]
        return min(found, key=lambda each: each[1])

    def meetings(self, traffic: Traffic, combine: int) -> list[Meeting]:
        """Where the tractor is to be, over time, for each lane that it may come to."""
        ways = len(self.numbers_at(combine, float(traffic.progress[combine])))
        return [self._meeting(traffic, combine, choice) for choice in range(max(1, ways))]

    def _meeting(self, traffic: Traffic, combine: int, choice: int) -> Meeting:
        lanes = self.of[combine]
        begins = np.array([lane.begin for lane in lanes]) - 1e-6
        ends = np.array([lane.end for lane in lanes]) + 1e-6

        def poses(times: np.ndarray) -> np.ndarray:
            stations = stations_at(traffic, combine, times)
            serves = (begins <= stations[:, None]) & (stations[:, None] <= ends)
            # The choice is among lanes that serve at once, where the combine ends.
            rank = np.minimum(choice, serves.sum(axis=1) - 1)
            chosen = (serves.cumsum(axis=1) == rank[:, None] + 1).argmax(axis=1)
            found = np.full((len(times), 3), np.nan)
            for number in np.unique(chosen[serves.any(axis=1)]).tolist():
                at = (chosen == number) & serves.any(axis=1)
                lane = lanes[number]
                places = np.interp(stations[at], lane.stations, lane.slots) + self.lead - SETTLE
                found[at] = poses_on(lane.points, STEP, places)
            return found

        return poses

    def places_at_standing(self, pose: np.ndarray, reach: float) -> list[np.ndarray]:
        """Where a tractor may stand so that a combine that stands reaches its box, shape (3,) each.

        Its auger swings round, so that a cart need not come along the lane, where others may be.

        Args:
            pose: x, y, theta of the combine, shape (3,).
            reach: Of the auger [m].
        """
        places = []
        far = NEARBY * STANDING * reach
        for bearing in BEARINGS:
            x = pose[0] + far * np.cos(pose[2] + bearing)
            y = pose[1] + far * np.sin(pose[2] + bearing)
            for turn in HEADINGS:
                course = pose[2] + turn
                ahead = self.lead * np.array([np.cos(course), np.sin(course)])
                places.append(np.array([x + ahead[0], y + ahead[1], course]))
        return places

    def speed_beside(self, combine: int, number: int, station: float, speed: float, way: float):
        """Speed to be at one's place on a lane, for a combine that drives at a speed [m/s].

        Args:
            number: Of the lane.
            station: Of the combine [m].
            way: Along the lane [m].
        """
        here = self.place_at(combine, number, station)
        soon = self.place_at(combine, number, station + speed)
        return float(np.clip(soon - here + CATCH_UP * (here - way), 0.0, self.cart.speed))
