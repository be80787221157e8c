"""A timetable: who is unloaded when, and what every tank holds meanwhile."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True)
class Visit:
    """A cart's stay beside one combine.

    Attributes:
        combine: Its number.
        arrive: The cart is there [s].
        start_unloading: Grain flows [s].
        emptied: The tank is empty, or as empty as the plan or the cart's room makes it [s].
        leave: The cart drives off [s]; from `emptied` on the tank stays as it is.
        load_at_start: Of the tank, when unloading starts [kg].
        taken: Grain that the cart took over [kg].
        by_truck: Whether the cart drives by the truck next.
        cart: The cart's number.
    """

    combine: int
    arrive: float
    start_unloading: float
    emptied: float
    leave: float
    load_at_start: float
    taken: float
    by_truck: bool = False
    cart: int = 0

    @property
    def wait(self) -> float:
        """How long the cart stays with an emptied combine, t_n of the thesis [s]."""
        return self.leave - self.emptied


@dataclass(frozen=True)
class LoadLine:
    """A load over time, linear between breakpoints and constant beyond them.

    Attributes:
        times: Breakpoints in order, (m,) [s].
        loads: What is held then, (m,) [kg].
    """

    times: NDArray[np.float64]
    loads: NDArray[np.float64]

    def __call__(self, times: ArrayLike) -> NDArray[np.float64]:
        """The load at any times, of their shape [kg]."""
        return np.interp(np.asarray(times, dtype=np.float64), self.times, self.loads)


@dataclass(frozen=True)
class Timetable:
    """Visits in order of their start, and loads.

    Attributes:
        visits: Of all carts.
        tanks: Load of each combine's tank, (N,).
        carts: Load of each cart, (K,).
        lost: Grain that ran over at each combine, (N,) [kg].
        overflows: When each tank that ran over first did so: combine to time [s].
    """

    visits: tuple[Visit, ...]
    tanks: tuple[LoadLine, ...]
    carts: tuple[LoadLine, ...]
    lost: tuple[float, ...]
    overflows: dict[int, float]

    def of_cart(self, cart: int) -> tuple[Visit, ...]:
        """The visits of one cart, in order."""
        return tuple(visit for visit in self.visits if visit.cart == cart)
