"""Teams without a centre: what the range of the radio is worth."""

import math
from collections.abc import Mapping, Sequence

from ....systems.numerics.geometry.random_arena import Arena
from ....systems.numerics.statistics import paired_difference
from ....systems.numerics.tracking.risk import RISK_FUNCTIONS
from ...studies.opponents import Match, cell_name, match_cell, runs_against
from ...studies.report import draw_matrix, draw_means
from ...studies.study import Study
from ...studies.summary import StudyGrid, StudyPanel, matrix_of
from ...studies.team_studies import thesis_base
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop
from ..played import played

RUNS = {"adversarial": 500, "best_response": 100}
QUICK_RUNS = {"adversarial": 8, "best_response": 2}
RANGES, SIZES, QUICK_SIZES = (0.0, 1.0, 2.0, math.inf), (2, 3, 4), (2, 4)
PURSUERS, RULE = 3, "borda_max"


def radio_study(runs: Mapping[str, int], sizes: Sequence[int] = SIZES) -> Study:
    """Three pursuers with three risk functions, and radios of several ranges.

    Args:
        runs: Of each cell, by opponent.
        sizes: Of the evaders' team.
    """
    numbers = runs_against(tuple(runs), max(runs.values()), runs)
    return Study(
        name="radio",
        base=thesis_base(),
        arena=Arena(),
        runs=max(numbers.values()),
        cells=tuple(
            match_cell(
                Match(PURSUERS, m, _name(reach), opponent),
                (
                    f"pursuers.risk_functions=[{', '.join(RISK_FUNCTIONS)}]",
                    f"pursuers.assignment={RULE}",
                    "pursuers.extra=riskiest",
                    f"pursuers.radio_range={'.inf' if math.isinf(reach) else reach}",
                ),
                numbers,
            )
            for opponent in numbers
            for reach in RANGES
            for m in sizes
        ),
    )


def _name(reach: float) -> str:
    return "centre" if math.isinf(reach) else f"{reach:g}m"


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_RUNS)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    result = played(workshop, radio_study(runs, sizes))

    def cell(evaders: int, reach: float, opponent: str) -> str:
        return cell_name(PURSUERS, evaders, _name(reach), opponent)

    panels = tuple(
        StudyPanel(
            title=f"range of the radio, against {opponent}",
            series={_name(reach): {m: cell(m, reach, opponent) for m in sizes} for reach in RANGES},
        )
        for opponent in runs
    )
    grid = StudyGrid(means=panels, matrix=matrix_of(result.study))
    files = [workshop.pictures / f"beyond_radio{name}.png" for name in ("", "_matrix")]
    draw_means(result, grid).savefig(files[0], dpi=110)
    draw_matrix(result, grid).savefig(files[1], dpi=110)
    captions = (
        "Restricted means of the tracking time of three pursuers, by opponent.",
        "The same means, ranges of the radio against evaders.",
    )
    findings = []
    for opponent in runs:
        times = {
            (m, reach): result.times(cell(m, reach, opponent))
            for m in sizes
            for reach in (0.0, math.inf)
        }
        found = [(m, paired_difference(times[m, math.inf], times[m, 0.0])) for m in sizes]
        said = "; ".join(
            f"{PURSUERS}v{m}: {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}]" for m, d in found
        )
        subject = f"A centre less no radio at all, against {opponent}"
        findings.append(Finding(subject, "", f"{said}.", SHOWN))
    return Evidence(tuple(map(Picture, files, captions)), tuple(findings))


RADIO = Exhibit(
    id="beyond-radio",
    covers=(),
    title="Pursuers without a centre",
    states="The thesis has a centre that knows everything. Here each pursuer knows what it sees "
    "and what those within radio range tell it, and applies the team's rule to that.",
    command="sightfield track thesis_borda_4v3 --set pursuers.radio_range=1.5",
    make=_make,
)
