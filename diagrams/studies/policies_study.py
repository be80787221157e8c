"""Pursuers against evaders: what each way to pursue is worth against each way to escape.

The thesis's pursuers and others: who keeps an assignment until its evader is lost, who runs along
the field of this project's margins, who tries its steps, who plays by the solved visibility game,
who keeps what its lower bound certifies. A strategy is as good as it is against the evaders that
are worst for it.
"""

import re
from collections.abc import Mapping, Sequence

from ...systems.numerics.errors import require, require_one_of
from ...systems.numerics.geometry.random_arena import Arena
from ..tracking.scenario import TrackingScenario
from .grid import StudyGrid, StudyPanel, matrix_of
from .opponents import POLICIES, Match, cell_name, match_cell, match_of, runs_against
from .study import Study
from .tracking_study import thesis_base

# Field, assignment and hold of each; the risk vector is the base's: proportional.
PURSUERS = {
    "thesis": ("table", "hungarian", "none"),
    "table_held": ("table", "hungarian", "until_lost"),
    "margin": ("margin", "hungarian", "none"),
    "margin_held": ("margin", "hungarian", "until_lost"),
    "lookahead_held": ("lookahead", "hungarian", "until_lost"),
    "guarantee": ("guarantee", "guarantee", "certificate"),
    "certified": ("certified", "guarantee", "certificate"),
}
REFERENCE = "thesis"

# Played unless others are chosen: the lower bound takes half a minute an arena.
USUAL = tuple(name for name in PURSUERS if name != "certified")

SIZES = ("1v1", "2v2", "3v3", "3v4", "4v4")

# Of each cell; evaders that walk at random are seldom lost, so that these games last long.
RUNS = 300


def policies_study(
    *,
    runs: int = RUNS,
    seed: int = 0,
    base: TrackingScenario | None = None,
    arena: Arena | None = None,
    sizes: Sequence[str] = SIZES,
    opponents: Sequence[str] = POLICIES,
    opponent_runs: Mapping[str, int] | None = None,
    starts: int = 1,
    pursuers: Sequence[str] = USUAL,
) -> Study:
    """The study of policies: "1v1-thesis-adversarial" to "4v4-guarantee-optimal_distance".

    Args:
        runs, seed, base, arena: As of `tracking_study`.
        sizes: Of the teams, "3v4" being three pursuers against four evaders.
        opponents, opponent_runs: As of `tracking_study`.
        starts: Runs that share an arena, for which its visibility game is solved once.
        pursuers: Names in PURSUERS.

    Raises:
        InvalidInput: A size is none, or a name; see `Study` and `runs_against`.
    """
    for name in pursuers:
        require_one_of("pursuers", name, PURSUERS)
    for size in sizes:
        fine = re.fullmatch("[1-9][0-9]*v[1-9][0-9]*", size)
        require(fine is not None, "size", "have the form 3v4, pursuers first", size)
    numbers = runs_against(opponents, runs, opponent_runs)
    teams = [tuple(map(int, size.split("v"))) for size in sizes]
    return Study(
        name="policies",
        base=base or thesis_base(),
        arena=Arena() if base is None and arena is None else arena,
        runs=max(numbers.values()),
        seed=seed,
        starts_per_arena=starts,
        cells=tuple(
            match_cell(
                Match(n, m, name, opponent),
                tuple(
                    f"pursuers.{key}={value}"
                    for key, value in zip(
                        ("field", "assignment", "hold"), PURSUERS[name], strict=True
                    )
                ),
                numbers,
            )
            for opponent in opponents
            for name in pursuers
            for n, m in teams
        ),
    )


def policies_grid(study: Study) -> StudyGrid:
    """How to show and compare the cells of `policies_study`: each pursuers less the thesis's."""
    matches = [match_of(cell.name) for cell in study.cells]
    teams = list(dict.fromkeys((match.pursuers, match.evaders) for match in matches))
    opponents = list(dict.fromkeys(match.opponent for match in matches))
    pursuers = list(dict.fromkeys(match.variant for match in matches))
    compared = [each for each in pursuers if each != REFERENCE] if REFERENCE in pursuers else []
    return StudyGrid(
        curves=tuple(
            StudyPanel(
                title=f"{n} against {m} {opponent}",
                series={each: {m: cell_name(n, m, each, opponent)} for each in pursuers},
            )
            for n, m in teams
            for opponent in opponents
        ),
        pairs=tuple(
            (cell_name(n, m, each, opponent), cell_name(n, m, REFERENCE, opponent))
            for opponent in opponents
            for each in compared
            for n, m in teams
        ),
        matrix=matrix_of(study),
    )
