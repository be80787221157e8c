"""From which starting distances a stand-off loop settles at the wanted equilibrium, exactly."""

import math
from dataclasses import dataclass

from ..errors import require
from .energy import edge
from .loop import StandoffLoop
from .separatrix import separatrix


@dataclass(frozen=True)
class RegionOfAttraction:
    """An open interval of starting distances.

    Attributes:
        low, high: Its ends; infinite where it is unbounded [m].
    """

    low: float
    high: float

    def holds(self, y: float) -> bool:
        """Whether a distance [m] lies inside.

        Args:
            y: The distance [m].
        """
        return self.low < y < self.high


def region_of_attraction(loop: StandoffLoop, *, integral: str = "empty") -> RegionOfAttraction:
    """The starts that end at the wanted equilibrium.

    On one side lies the other equilibrium or the singularity, whichever is nearer, for all four
    controllers. On the other side P and PD attract from everywhere; with an integral part a start
    far away winds the integral up so much that the loop swings over the edge. A straight error
    (a = 0) makes the loop linear: it settles from everywhere.

    Args:
        loop: The closed loop.
        integral: How the integral of PI and PID starts: `empty`, at zero as it is at rest, or
            `still`, so that y' = 0 at the start, as in the thesis's Figure 2.20.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    require(integral in ("empty", "still"), "integral", "be empty or still", integral)
    border = edge(loop)
    if math.isinf(border):
        return RegionOfAttraction(-math.inf, math.inf)
    outward = math.copysign(math.inf, loop.error.a)
    opposite: float | None = -outward
    if loop.integrates:
        found = separatrix(loop)
        opposite = found.empty if integral == "empty" else found.still
    far = -outward if opposite is None else opposite
    return RegionOfAttraction(min(far, border), max(far, border))
