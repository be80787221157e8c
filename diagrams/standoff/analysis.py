"""All that is known of one stand-off loop, and how it reads as JSON."""

import math
from dataclasses import dataclass

from ...systems.numerics.standoff.calibrated_range import HeldEquilibrium, held_equilibria
from ...systems.numerics.standoff.delay import DelayMargin, delay_margin
from ...systems.numerics.standoff.energy import certified_interval
from ...systems.numerics.standoff.equilibria import (
    Equilibrium,
    equilibria,
    singularities,
    wanted_equilibrium,
)
from ...systems.numerics.standoff.loop import StandoffLoop
from ...systems.numerics.standoff.region import Region, region_of_attraction
from .certificate import Certificate, sum_of_squares_certificate


@dataclass(frozen=True, eq=False)
class StandoffAnalysis:
    """What `analyse_standoff` finds.

    Attributes:
        loop: What was analysed.
        equilibria: Nearest first.
        wanted: The one that the loop is meant for: stable for all gains.
        bias: Its distance less the reference, which is the estimate's error there [m].
        singularities: Where the equation breaks down [m].
        region: Starts with an empty integral that settle at the wanted equilibrium.
        region_at_rest: The same for starts with y' = 0, as in the thesis's Figure 2.20.
        energy_interval: The part of the region that the energy certifies in closed form [m].
        certificate: The part that a sum of squares certifies; None if the solver finds none.
        margin: Delay that the ideal loop bears.
        filtered_margin: Delay that it bears with the derivative filtered.
        filter_time: Time constant of that filter [s].
        held: Equilibria if the estimate holds its error outside the calibrated range.
    """

    loop: StandoffLoop
    equilibria: tuple[Equilibrium, ...]
    wanted: Equilibrium
    bias: float
    singularities: tuple[float, ...]
    region: Region
    region_at_rest: Region
    energy_interval: tuple[float, float]
    certificate: Certificate | None
    margin: DelayMargin
    filtered_margin: DelayMargin
    filter_time: float
    held: tuple[HeldEquilibrium, ...]

    def as_object(self) -> dict[str, object]:
        """The part that is promised as JSON, in SI units; null: unbounded."""
        return {
            "controller": self.loop.controller,
            "equilibria": [
                {
                    "y": each.y,
                    "stable": each.stable,
                    "poles": [[pole.real, pole.imag] for pole in each.poles],
                }
                for each in self.equilibria
            ],
            "singularities": list(self.singularities),
            "region_of_attraction": [
                end if math.isfinite(end) else None for end in (self.region.low, self.region.high)
            ],
        }


def analyse_standoff(loop: StandoffLoop, filter_time: float = 0.02) -> StandoffAnalysis:
    """Analyse a loop.

    Args:
        loop: The closed loop.
        filter_time: Time constant of the derivative's filter in `filtered_margin` [s].

    Raises:
        InvalidInput: There is no equilibrium, or a singularity lies on one.
    """
    wanted = wanted_equilibrium(loop)
    return StandoffAnalysis(
        loop=loop,
        equilibria=equilibria(loop),
        wanted=wanted,
        bias=wanted.y - loop.reference,
        singularities=singularities(loop),
        region=region_of_attraction(loop),
        region_at_rest=region_of_attraction(loop, integral="still"),
        energy_interval=certified_interval(loop),
        certificate=sum_of_squares_certificate(loop),
        margin=delay_margin(loop),
        filtered_margin=delay_margin(loop, filter_time),
        filter_time=filter_time,
        held=held_equilibria(loop),
    )
