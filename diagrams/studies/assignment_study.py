"""Three pursuers with three risk functions: does it pay to agree? Figure 2.19.

Three teams play the same runs. One ranks and aggregates (Algorithm 1); in one every pursuer takes
an evader in its sight by lot; in one each takes the evader that it ranks riskiest itself. Lots are
drawn anew at every step, as `hold` of `thesis_base` is "none".
"""

from collections.abc import Mapping, Sequence

from ...systems.numerics.geometry.random_arena import Arena
from ..tracking.scenario import TrackingScenario
from .grid import StudyGrid, StudyPanel, matrix_of
from .opponents import OPPONENTS, RUNS, Match, cell_name, match_cell, match_of, runs_against
from .study import Study
from .tracking_study import thesis_base

PURSUERS = 3

# One for each pursuer. The thesis does not say which it took.
FUNCTIONS = ("total", "nearest", "mean")

# The algorithm as corrected, in both senses (the thesis minimises a score that is highest for the
# riskiest evader), then the two teams that it is compared with.
RULES = ("borda_min", "borda_max", "random_visible", "own_riskiest")
_REFERENCES = ("random_visible", "own_riskiest")


def assignment_study(
    *,
    runs: int = RUNS,
    seed: int = 0,
    base: TrackingScenario | None = None,
    arena: Arena | None = None,
    sizes: Sequence[int] = (1, 2, 3, 4),
    rules: Sequence[str] = RULES,
    opponents: Sequence[str] = OPPONENTS,
    opponent_runs: Mapping[str, int] | None = None,
) -> Study:
    """The study of Figure 2.19: "3v1-borda_min-adversarial" to "3v4-own_riskiest-best_response".

    Args:
        runs, seed, base, arena: As of `tracking_study`.
        sizes: Of the evaders' team.
        rules: Names of assignment rules.
        opponents, opponent_runs: As of `tracking_study`.

    Raises:
        InvalidInput: See `Study` and `runs_against`.
    """
    numbers = runs_against(opponents, runs, opponent_runs)
    return Study(
        name="assignment",
        base=base or thesis_base(),
        arena=Arena() if base is None and arena is None else arena,
        runs=max(numbers.values()),
        seed=seed,
        cells=tuple(
            match_cell(
                Match(PURSUERS, evaders, rule, opponent),
                (
                    f"pursuers.risk_functions=[{', '.join(FUNCTIONS)}]",
                    f"pursuers.assignment={rule}",
                    # The teams compared with leave nobody idle either.
                    "pursuers.extra=riskiest",
                ),
                numbers,
            )
            for opponent in opponents
            for rule in rules
            for evaders in sizes
        ),
    )


def assignment_grid(study: Study) -> StudyGrid:
    """How to show and compare the cells of `assignment_study`."""
    matches = [match_of(cell.name) for cell in study.cells]
    opponents = list(dict.fromkeys(match.opponent for match in matches))
    rules = list(dict.fromkeys(match.variant for match in matches))
    sizes = list(dict.fromkeys(match.evaders for match in matches))
    own = [rule for rule in rules if rule not in _REFERENCES]

    def name(evaders: int, rule: str, opponent: str) -> str:
        return cell_name(PURSUERS, evaders, rule, opponent)

    return StudyGrid(
        means=tuple(
            StudyPanel(
                title=f"three risk functions, against {opponent}",
                series={rule: {m: name(m, rule, opponent) for m in sizes} for rule in rules},
            )
            for opponent in opponents
        ),
        curves=tuple(
            StudyPanel(
                title=f"{PURSUERS} against {m} {opponent}",
                series={rule: {m: name(m, rule, opponent)} for rule in rules},
            )
            for opponent in opponents
            for m in sizes
        ),
        pairs=tuple(
            (name(m, rule, opponent), name(m, reference, opponent))
            for opponent in opponents
            for rule in own
            for reference in rules
            if reference in _REFERENCES
            for m in sizes
        ),
        matrix=matrix_of(study),
    )
