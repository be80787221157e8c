"""How long do teams keep sight, with each risk vector? Figures 2.16 to 2.18."""

from collections.abc import Mapping, Sequence

from ...systems.numerics.geometry.random_arena import Arena
from ..tracking.scenario import Evaders, Pursuers, TrackingScenario
from ..world_source import WorldSource
from .grid import StudyGrid, StudyPanel, matrix_of
from .opponents import OPPONENTS, RUNS, Match, cell_name, match_cell, match_of, runs_against
from .study import Study

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
