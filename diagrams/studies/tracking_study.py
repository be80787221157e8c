"""How long do teams keep sight, with each risk vector? Figures 2.16 to 2.18."""

from collections.abc import Sequence

from ...systems.numerics.geometry.arenas.random_arena import Arena
from ..tracking.scenario import Evaders, Pursuers, TrackingScenario
from ..world_source import WorldSource
from .grid import Grid, Panel
from .study import Cell, Study

# Horizon of the thesis's studies [s]; it does not say which it took.
SECONDS = 120.0

# What the thesis calls the tracking time with each of its risk vectors.
TIMES = {"uniform": "t1", "majority": "t2", "proportional": "t3"}


def thesis_base(seconds: float = SECONDS, world: WorldSource | None = None) -> TrackingScenario:
    """The game of 2.2.7: point agents, v_p = 300 mm per time unit, a = 0.3, in an arena of 4 m.

    Evaders play to escape (Table 2.1); the thesis does not say what its evaders do. Pursuers are
    assigned by the Hungarian method on the risk (2.13) and run along the fields of Table 2.2.

    Args:
        seconds: Horizon [s].
        world: Where it is played; None for the empty arena, where a study draws the obstacles.
    """
    arena = WorldSource(boundary=[[0, 0], [4, 0], [4, 4], [0, 4]])
    return TrackingScenario(
        world=world or arena,
        pursuers=Pursuers(top_speed=0.3, count=1, field="table"),
        evaders=Evaders(top_speed=0.09, count=1),
        seconds=float(seconds),
    )


def tracking_study(
    *,
    runs: int = 1000,
    seed: int = 0,
    base: TrackingScenario | None = None,
    arena: Arena | None = None,
    sizes: Sequence[int] = (1, 2, 3, 4),
    vectors: Sequence[str] = tuple(TIMES),
) -> Study:
    """The study of Figures 2.16 to 2.18, with cells "1v1-uniform" to "4v4-proportional".

    Args:
        runs: Runs of each cell.
        seed: Root of all seeds.
        base: What is played; by default `thesis_base()`.
        arena: How each run's world is drawn; None for the world of `base`, or for `Arena()` where
            no `base` is given.
        sizes: Of both teams.
        vectors: Names of risk vectors.

    Raises:
        InvalidInput: See `Study`.
    """
    return Study(
        name="tracking",
        base=base or thesis_base(),
        arena=Arena() if base is None and arena is None else arena,
        runs=runs,
        seed=seed,
        cells=tuple(
            Cell(
                name=cell_name(pursuers, evaders, vector),
                settings=(
                    f"pursuers.count={pursuers}",
                    f"evaders.count={evaders}",
                    f"pursuers.risk_vectors=[{vector}]",
                ),
            )
            for vector in vectors
            for pursuers in sizes
            for evaders in sizes
        ),
    )


def cell_name(pursuers: int, evaders: int, variant: str) -> str:
    """Name of the cell of two team sizes and what else is varied.

    Args:
        pursuers, evaders: How many.
        variant: What else is varied.
    """
    return f"{pursuers}v{evaders}-{variant}"


def tracking_grid(study: Study) -> Grid:
    """How to show and compare the cells of `tracking_study`."""
    parts = [cell.name.split("-") for cell in study.cells]
    vectors = list(dict.fromkeys(vector for _, vector in parts))
    sizes = list(dict.fromkeys(int(size.split("v")[0]) for size, _ in parts))
    means = tuple(
        Panel(
            title=f"{TIMES.get(vector, 'time')}: {vector} risk vector",
            series={
                f"{n} pursuer{'s' if n > 1 else ''}": {m: cell_name(n, m, vector) for m in sizes}
                for n in sizes
            },
        )
        for vector in vectors
    )
    curves = tuple(
        Panel(
            title=f"{n} against {m}",
            series={vector: {m: cell_name(n, m, vector)} for vector in vectors},
        )
        for n in sizes
        for m in sizes
    )
    pairs = tuple(
        (cell_name(n, m, first), cell_name(n, m, second))
        for k, first in enumerate(vectors)
        for second in vectors[k + 1 :]
        for n in sizes
        for m in sizes
    )
    return Grid(means=means, curves=curves, pairs=pairs)
