"""Three pursuers with three risk functions: does it pay to agree? Figure 2.19.

Three teams play the same runs. One ranks and aggregates (Algorithm 1); in one every pursuer takes
an evader in its sight by lot; in one each takes the evader that it ranks riskiest itself.
"""

from collections.abc import Sequence

from ...systems.numerics.geometry.arenas.random_arena import Arena
from ..tracking.scenario import TrackingScenario
from .grid import Grid, Panel
from .study import Cell, Study
from .tracking_study import cell_name, thesis_base

PURSUERS = 3

# One for each pursuer. The thesis does not say which it took.
FUNCTIONS = ("total", "nearest", "mean")

# The algorithm as corrected, in both senses (the thesis minimises a score that is highest for the
# riskiest evader), then the two teams that it is compared with.
RULES = ("borda_min", "borda_max", "random_visible", "own_riskiest")
_REFERENCES = ("random_visible", "own_riskiest")


def assignment_study(
    *,
    runs: int = 1000,
    seed: int = 0,
    base: TrackingScenario | None = None,
    arena: Arena | None = None,
    sizes: Sequence[int] = (1, 2, 3, 4),
    rules: Sequence[str] = RULES,
) -> Study:
    """The study of Figure 2.19, with cells "3v1-borda_min" to "3v4-own_riskiest".

    Args:
        runs, seed, base, arena: As of `tracking_study`.
        sizes: Of the evaders' team.
        rules: Names of assignment rules.

    Raises:
        InvalidInput: See `Study`.
    """
    return Study(
        name="assignment",
        base=base or thesis_base(),
        arena=Arena() if base is None and arena is None else arena,
        runs=runs,
        seed=seed,
        cells=tuple(
            Cell(
                name=cell_name(PURSUERS, evaders, rule),
                settings=(
                    f"pursuers.count={PURSUERS}",
                    f"evaders.count={evaders}",
                    f"pursuers.risk_functions=[{', '.join(FUNCTIONS)}]",
                    f"pursuers.assignment={rule}",
                    # The teams compared with leave nobody idle either.
                    "pursuers.extra=riskiest",
                ),
            )
            for rule in rules
            for evaders in sizes
        ),
    )


def assignment_grid(study: Study) -> Grid:
    """How to show and compare the cells of `assignment_study`."""
    parts = [cell.name.partition("-")[::2] for cell in study.cells]
    rules = list(dict.fromkeys(rule for _, rule in parts))
    sizes = list(dict.fromkeys(int(size.split("v")[1]) for size, _ in parts))
    own = [rule for rule in rules if rule not in _REFERENCES]
    return Grid(
        means=(
            Panel(
                title="three pursuers with three risk functions",
                series={rule: {m: cell_name(PURSUERS, m, rule) for m in sizes} for rule in rules},
            ),
        ),
        curves=tuple(
            Panel(
                title=f"{PURSUERS} against {m}",
                series={rule: {m: cell_name(PURSUERS, m, rule)} for rule in rules},
            )
            for m in sizes
        ),
        pairs=tuple(
            (cell_name(PURSUERS, m, rule), cell_name(PURSUERS, m, reference))
            for rule in own
            for reference in rules
            if reference in _REFERENCES
            for m in sizes
        ),
    )
