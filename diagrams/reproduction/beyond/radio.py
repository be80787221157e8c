"""Teams without a centre: what the range of the radio is worth."""

import math

from ....systems.numerics.geometry.arenas.random_arena import Arena
from ....systems.numerics.statistics.paired import paired_difference
from ....systems.numerics.tracking.risk import RISK_FUNCTIONS
from ...studies.grid import Grid, Panel
from ...studies.pictures import draw_means
from ...studies.study import Cell, Study
from ...studies.tracking_study import thesis_base
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop
from ..played import played

RUNS, QUICK_RUNS = 500, 8
RANGES, SIZES = (0.0, 1.0, 2.0, math.inf), (2, 3, 4)
PURSUERS, RULE = 3, "borda_max"


def radio_study(runs: int) -> Study:
    """Three pursuers with three risk functions, and radios of several ranges.

    Args:
        runs: Of each cell.
        runs: Of each cell.
    """
    return Study(
        name="radio",
        base=thesis_base(),
        arena=Arena(),
        runs=runs,
        cells=tuple(
            Cell(
                name=_cell(m, reach),
                settings=(
                    f"pursuers.count={PURSUERS}",
                    f"evaders.count={m}",
                    f"pursuers.risk_functions=[{', '.join(RISK_FUNCTIONS)}]",
                    f"pursuers.assignment={RULE}",
                    "pursuers.extra=riskiest",
                    f"pursuers.radio_range={'.inf' if math.isinf(reach) else reach}",
                ),
            )
            for reach in RANGES
            for m in SIZES
        ),
    )


def _cell(evaders: int, reach: float) -> str:
    return f"{PURSUERS}v{evaders}-{reach:g}m"


def _make(workshop: Workshop) -> Evidence:
    result = played(workshop, radio_study(workshop.runs_of(RUNS, QUICK_RUNS)))
    names = {reach: "a centre" if math.isinf(reach) else f"{reach:g} m" for reach in RANGES}
    panel = Panel(
        title="range of the radio",
        series={name: {m: _cell(m, reach) for m in SIZES} for reach, name in names.items()},
    )
    file = workshop.pictures / "beyond_radio.png"
    draw_means(result, Grid(means=(panel,), curves=(), pairs=())).savefig(file, dpi=110)
    found = [
        (m, paired_difference(result.times(_cell(m, math.inf)), result.times(_cell(m, 0.0))))
        for m in SIZES
    ]
    return Evidence(
        (Picture(file, "Restricted means of the tracking time of three pursuers."),),
        (
            Finding(
                "A centre less no radio at all",
                "",
                "; ".join(
                    f"{PURSUERS}v{m}: {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}]"
                    for m, d in found
                )
                + ".",
                SHOWN,
            ),
        ),
    )


RADIO = Exhibit(
    id="beyond-radio",
    covers=(),
    title="Pursuers without a centre",
    states="The thesis has a centre that knows everything. Here each pursuer knows what it sees "
    "and what those within radio range tell it, and applies the team's rule to that.",
    command="sightfield track thesis_borda_4v3 --set pursuers.radio_range=1.5",
    make=_make,
)
