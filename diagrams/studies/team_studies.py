"""Studies of teams: by risk vector, by how they agree, by pursuers against evaders.

Figures 2.16 to 2.18 ask how long teams keep sight with each risk vector. Figure 2.19 asks whether
it pays to agree: three teams of three pursuers play the same runs. One ranks and aggregates
(Algorithm 1); in one every pursuer takes an evader in its sight by lot; in one each takes the
evader that it ranks riskiest itself. Lots are drawn anew at every step, as `hold` of `thesis_base`
is "none".

The last study sets pursuers against evaders, the thesis's and others: who keeps an assignment until
its evader is lost, who runs along the field of this project's margins, who tries its steps, who
plays by the solved visibility game, who keeps what its lower bound certifies. A strategy is as good
as it is against the evaders that are worst for it.
"""

import re
from collections.abc import Mapping, Sequence

from ...systems.numerics.errors import require, require_one_of
from ...systems.numerics.geometry.random_arena import Arena
from ..tracking.scenario import Evaders, Pursuers, TrackingScenario
from ..world_source import WorldSource
from .opponents import (
    OPPONENTS,
    POLICIES,
    RUNS,
    Match,
    cell_name,
    match_cell,
    match_of,
    runs_against,
)
from .study import Study
from .summary import StudyGrid, StudyPanel, matrix_of

# Horizon of the thesis's studies [s]; it does not say which it took.
SECONDS = 120.0

# What the thesis calls the tracking time with each of its risk vectors.
TIMES = {"uniform": "t1", "majority": "t2", "proportional": "t3"}


def thesis_base(seconds: float = SECONDS, world: WorldSource | None = None) -> TrackingScenario:
    """The game of 2.2.7: point agents, v_p = 300 mm per time unit, a = 0.3, in an arena of 4 m.

    The thesis does not say what its evaders do: a study says it, here they play to escape (Table
    2.1). Pursuers are assigned by the Hungarian method on the risk (2.13), anew at every step, and
    run along the fields of Table 2.2.

    Args:
        seconds: Horizon [s].
        world: Where it is played; None for the empty arena, where a study draws the obstacles.
    """
    arena = WorldSource(boundary=[[0, 0], [4, 0], [4, 4], [0, 4]])
    return TrackingScenario(
        world=world or arena,
        pursuers=Pursuers(top_speed=0.3, count=1, field="table", hold="none", smoothing=0.0),
        evaders=Evaders(top_speed=0.09, count=1),
        seconds=float(seconds),
    )


def tracking_study(
    *,
    runs: int = RUNS,
    seed: int = 0,
    base: TrackingScenario | None = None,
    arena: Arena | None = None,
    sizes: Sequence[int] = (1, 2, 3, 4),
    vectors: Sequence[str] = tuple(TIMES),
    opponents: Sequence[str] = OPPONENTS,
    opponent_runs: Mapping[str, int] | None = None,
) -> Study:
    """The study of Figures 2.16 to 2.18: "1v1-uniform-adversarial" to "4v4-...-best_response".

    Args:
        runs: Runs of each cell.
        seed: Root of all seeds.
        base: What is played; by default `thesis_base()`.
        arena: How each run's world is drawn; None for the world of `base`, or for `Arena()` where
            no `base` is given.
        sizes: Of both teams.
        vectors: Names of risk vectors.
        opponents: Policies of the evaders.
        opponent_runs: Runs of each cell against some of them, where not `runs`.

    Raises:
        InvalidInput: See `Study` and `runs_against`.
    """
    numbers = runs_against(opponents, runs, opponent_runs)
    return Study(
        name="tracking",
        base=base or thesis_base(),
        arena=Arena() if base is None and arena is None else arena,
        runs=max(numbers.values()),
        seed=seed,
        cells=tuple(
            match_cell(
                Match(pursuers, evaders, vector, opponent),
                (f"pursuers.risk_vectors=[{vector}]",),
                numbers,
            )
            for opponent in opponents
            for vector in vectors
            for pursuers in sizes
            for evaders in sizes
        ),
    )


def tracking_grid(study: Study) -> StudyGrid:
    """How to show and compare the cells of `tracking_study`."""
    matches = [match_of(cell.name) for cell in study.cells]
    opponents = list(dict.fromkeys(match.opponent for match in matches))
    vectors = list(dict.fromkeys(match.variant for match in matches))
    sizes = list(dict.fromkeys(match.pursuers for match in matches))
    means = tuple(
        StudyPanel(
            title=f"{TIMES.get(vector, 'time')}: {vector} risk vector, against {opponent}",
            series={
                f"{n} pursuer{'s' if n > 1 else ''}": {
                    m: cell_name(n, m, vector, opponent) for m in sizes
                }
                for n in sizes
            },
        )
        for opponent in opponents
        for vector in vectors
    )
    curves = tuple(
        StudyPanel(
            title=f"{n} against {m} {opponent}",
            series={vector: {m: cell_name(n, m, vector, opponent)} for vector in vectors},
        )
        for opponent in opponents
        for n in sizes
        for m in sizes
    )
    pairs = tuple(
        (cell_name(n, m, first, opponent), cell_name(n, m, second, opponent))
        for opponent in opponents
        for k, first in enumerate(vectors)
        for second in vectors[k + 1 :]
        for n in sizes
        for m in sizes
    )
    return StudyGrid(
        means=means, curves=curves, pairs=pairs, matrix=matrix_of(study), columns=len(vectors)
    )


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


# Field, assignment and hold of each; the risk vector is the base's: proportional.
PURSUIT = {
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
USUAL = tuple(name for name in PURSUIT if name != "certified")

SIZES = ("1v1", "2v2", "3v3", "3v4", "4v4")

# Of each cell; evaders that walk at random are seldom lost, so that these games last long.
POLICY_RUNS = 300


def policies_study(
    *,
    runs: int = POLICY_RUNS,
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
        require_one_of("pursuers", name, PURSUIT)
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
                        ("field", "assignment", "hold"), PURSUIT[name], strict=True
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
