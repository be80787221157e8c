"""All that is known of one stand-off loop, and how it reads as JSON."""

import math
from collections.abc import Iterable
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
from ...systems.numerics.standoff.region import RegionOfAttraction, region_of_attraction
from ...systems.numerics.standoff.sampled.margins import LoopMargins, loop_margins, sampled_loop
from ...systems.numerics.standoff.sampled.region import sampled_region
from ...systems.numerics.standoff.sampled_pid import SampledPid
from .certificate import SumOfSquaresCertificate, sum_of_squares_certificate

_DEFAULT = SampledPid()
# The numbers of `LoopMargins` that JSON has, with their units.
MARGINS = {
    "gain_margin": "",
    "phase_margin": "rad",
    "crossover": "rad/s",
    "delay_margin": "s",
    "peak_sensitivity": "",
}


@dataclass(frozen=True, eq=False)
class StandoffAnalysis:
    """What `analyse_standoff` finds.

    Attributes:
        loop, sampled, delay_samples: What was analysed.
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
        sampled_region: Starts that it attracts, with its limit too; None if it is not stable.
        sampled_margins: Of the loop as a computer closes it, with its clock, filter and delay.
        held: Equilibria if the estimate holds its error outside the calibrated range.
    """

    loop: StandoffLoop
    sampled: SampledPid
    delay_samples: int
    equilibria: tuple[Equilibrium, ...]
    wanted: Equilibrium
    bias: float
    singularities: tuple[float, ...]
    region: RegionOfAttraction
    region_at_rest: RegionOfAttraction
    energy_interval: tuple[float, float]
    certificate: SumOfSquaresCertificate | None
    margin: DelayMargin
    filtered_margin: DelayMargin
    sampled_margins: LoopMargins
    sampled_region: RegionOfAttraction | None
    held: tuple[HeldEquilibrium, ...]

    def as_object(self) -> dict[str, object]:
        """What is promised as JSON, in SI units; null: unbounded, or none.

        An equilibrium is `stable` if a real loop, with a fast enough filter and clock, stays there;
        `stable_in_equation` if the poles of the ideal loop say so. What becomes of the wanted one
        with this clock, filter and delay stands under `sampled`.
        """
        certificate = self.certificate
        sums = (certificate.low, certificate.high) if certificate is not None else None
        sampled = self.sampled_margins
        return {
            "controller": self.loop.controller,
            "equilibria": [
                {
                    "y": each.y,
                    "stable": each.stable and each.realisable,
                    "stable_in_equation": each.stable,
                    "poles": _pairs(each.poles),
                }
                for each in self.equilibria
            ],
            "bias": self.bias,
            "singularities": list(self.singularities),
            "region_of_attraction": _ends(self.region.low, self.region.high),
            "region_from_rest": _ends(self.region_at_rest.low, self.region_at_rest.high),
            "certified": {
                "energy": _ends(*self.energy_interval),
                "sums_of_squares": _ends(*sums) if sums is not None else None,
            },
            "delay_margin": self.margin.delay,
            "delay_margin_filtered": self.filtered_margin.delay,
            "sampled": {
                "period": self.sampled.period,
                "filter_time": self.sampled.filter_time,
                "delay": self.delay_samples * self.sampled.period,
                "stable": sampled.stable,
                "poles": _pairs(sampled.poles),
                **{
                    name: _finite(getattr(sampled, name)) if sampled.stable else None
                    for name in MARGINS
                },
                "limit": _finite(self.sampled.limit),
                "region_of_attraction": None
                if self.sampled_region is None
                else _ends(self.sampled_region.low, self.sampled_region.high),
            },
            "held_equilibria": [
                {"y": each.y, "stable": each.stable, "calibrated": each.calibrated}
                for each in self.held
            ],
        }


def analyse_standoff(
    loop: StandoffLoop, sampled: SampledPid = _DEFAULT, delay_samples: int = 0
) -> StandoffAnalysis:
    """Analyse a loop.

    Args:
        loop: The closed loop.
        sampled: Its clock, and the filter of its derivative.
        delay_samples: How many samples late the estimate comes.

    Raises:
        InvalidInput: There is no equilibrium, or a singularity lies on one.
    """
    wanted = wanted_equilibrium(loop)
    return StandoffAnalysis(
        loop=loop,
        sampled=sampled,
        delay_samples=delay_samples,
        equilibria=equilibria(loop),
        wanted=wanted,
        bias=wanted.y - loop.reference,
        singularities=singularities(loop),
        region=region_of_attraction(loop),
        region_at_rest=region_of_attraction(loop, integral="still"),
        energy_interval=certified_interval(loop),
        certificate=sum_of_squares_certificate(loop),
        margin=delay_margin(loop),
        filtered_margin=delay_margin(loop, sampled.filter_time),
        sampled_margins=loop_margins(sampled_loop(loop, sampled, delay_samples)),
        sampled_region=sampled_region(loop, sampled, delay_samples),
        held=held_equilibria(loop),
    )


def _pairs(poles: Iterable[complex]) -> list[list[float]]:
    return [[float(pole.real), float(pole.imag)] for pole in poles]


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _ends(low: float, high: float) -> list[float | None]:
    return [_finite(low), _finite(high)]
