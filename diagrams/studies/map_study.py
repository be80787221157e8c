"""What the map decides: how much of what a pursuer sees it can keep in sight for ever.

No games are played. In random arenas, and at several ratios of the speeds, the visibility game of
one pursuer and one evader is solved, and the pairs of places are counted: those in sight of each
other, and those of them that are kept so for ever, whatever the evader does. One thing is varied
at a time: the number of obstacles, of the same size or of the same area in all; their size; the
least gap between them; the ratio.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...systems.numerics.checked import Checked, Count, Positive, one_of
from ...systems.numerics.errors import InvalidInput, require, require_one_of, require_type
from ...systems.numerics.geometry.random_arena import Arena, draw_arena
from ...systems.numerics.geometry.world import World
from ...systems.numerics.run_seeds import run_seed
from ...systems.numerics.statistics import Estimate, paired_difference
from ...systems.numerics.tracking.visibility_game.bounds import BOUNDS
from ...systems.numerics.tracking.visibility_game.guaranteed_times import solve_visibility_game
from ..outputs import write_json
from .summary import MeanTable, to_markdown
from .worker_processes import worker_pool

# The thesis's top speed of pursuers [m/s]; what is kept for ever hangs on the ratio alone.
PURSUER_SPEED = 0.3

# What is varied, in the words of tables and axes.
FACTORS = {
    "obstacles": "number of obstacles",
    "pieces": "number of obstacles, of the same area in all",
    "size": "mean side of the obstacles [m]",
    "gap": "least gap between obstacles [m]",
    "speed_ratio": "speed ratio a",
}

VALUES = {
    "obstacles": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0),
    "pieces": (1.0, 2.0, 3.0, 5.0, 8.0, 12.0),
    "size": (0.15, 0.3, 0.45, 0.65, 0.8),
    "gap": (0.15, 0.2, 0.3, 0.4, 0.5),
    "speed_ratio": (0.1, 0.2, 0.3, 0.45, 0.6, 0.8),
}


@dataclass(frozen=True, kw_only=True)
class MapStudy(Checked):
    """Which maps are solved, and how finely.

    Raises:
        InvalidInput: A number is out of its range, or a name is none.
    """

    # What arenas are like where nothing is varied.
    arena: Arena = field(default_factory=Arena)
    # A world of one's own instead, in which the ratio alone is varied.
    world: World | None = None
    # Evader's speed over the pursuer's where nothing is varied [-].
    speed_ratio: float = 0.3
    # By factor, its values.
    values: dict[str, tuple[float, ...]] = field(default_factory=lambda: dict(VALUES))
    # Arenas of each value.
    arenas: int = 10
    # Root of all seeds.
    seed: Count = 0
    # Between the pursuer's nodes [m].
    grid: Positive = 0.1
    # Of the visibility game.
    bound: Annotated[str, one_of(BOUNDS)] = "middle"

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.arenas >= 2, "arenas", "be two at least", self.arenas)
        require(
            0 < self.speed_ratio < 1,
            "speed_ratio",
            "lie strictly between 0 and 1",
            self.speed_ratio,
        )
        for name in self.values:
            require_one_of("factor", name, FACTORS)
        for ratio in self.values.get("speed_ratio", ()):
            require(0 < ratio < 1, "speed_ratio", "lie strictly between 0 and 1", ratio)
        if self.world is None:
            # Else there are passages without a node, which evaders alone can take.
            least = min(self.arena.gap, *self.values.get("gap", (self.arena.gap,)))
            said = f"be below the least gap between obstacles, {least:g} m"
            require(self.grid < least, "grid", said, self.grid)

    @property
    def factors(self) -> dict[str, tuple[float, ...]]:
        """What is varied, and its values: in a world of one's own the ratio alone."""
        if self.world is None:
            return self.values
        return {name: each for name, each in self.values.items() if name == "speed_ratio"}

    def setting(self, factor: str, value: float) -> tuple[Arena, float]:
        """What arenas are like, and the ratio, at a value of a factor.

        Args:
            factor: A name in FACTORS.
            value: Of the factor.

        Raises:
            InvalidInput: There are no such arenas.
        """
        arena = self.arena
        mean = 0.5 * (arena.shortest + arena.longest)
        if factor == "speed_ratio":
            return arena, value
        if factor == "obstacles":
            return replace(arena, obstacles=round(value)), self.speed_ratio
        if factor == "gap":
            return replace(arena, gap=value), self.speed_ratio
        if factor == "pieces":
            scale = (arena.obstacles / value) ** 0.5
            arena = replace(arena, obstacles=round(value))
        else:
            scale = value / mean
        # The shapes stay as they are.
        sides = {"shortest": scale * arena.shortest, "longest": scale * arena.longest}
        return replace(arena, **sides), self.speed_ratio


class Kept(NamedTuple):
    """What came out of one map at one ratio.

    Attributes:
        kept: Part of the pairs in sight that are kept so for ever, no unit.
        sighted: Part of all pairs of places that are in sight of each other, no unit.
    """

    kept: float
    sighted: float


@dataclass(frozen=True, eq=False)
class MapResult:
    """A finished study.

    Attributes:
        study: What was studied.
        found: By factor and value, one entry for each arena.
    """

    study: MapStudy
    found: dict[str, dict[float, tuple[Kept, ...]]]

    def kept(self, factor: str, value: float) -> np.ndarray:
        """Parts that are kept, shape (arenas,).

        Args:
            factor: A name in FACTORS.
            value: Of the factor.
        """
        return np.array([each.kept for each in self.found[factor][value]])

    def sighted(self, factor: str, value: float) -> np.ndarray:
        """Parts in sight, shape (arenas,).

        Args:
            factor, value: As of `kept`.
        """
        return np.array([each.sighted for each in self.found[factor][value]])


# A map and a ratio to be solved: arena and seed, or a world of one's own.
Task = tuple[Arena | World, int, float]


def run_map_study(
    study: MapStudy,
    *,
    workers: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> MapResult:
    """Solve all maps; arena r of a setting has the r-th child of the root seed.

    Args:
        study: Which maps.
        workers: Number of processes; 0 solves in this one.
        progress: Told the number of games solved and the number in all.

    Raises:
        InvalidInput: An arena has no room for its obstacles; see `solve_visibility_game`.
    """
    require_type("study", study, MapStudy)
    require(workers >= 0, "workers", "be zero or positive", workers)
    tasks = _tasks(study)
    # The setting from which the others differ belongs to several factors.
    wanted = list(dict.fromkeys(task for each in tasks.values() for task in each))
    solved: dict[Task, Kept] = {}

    def keep(results: Iterable[Kept]) -> None:
        progress(0, len(wanted))
        for task, kept in zip(wanted, results, strict=True):
            solved[task] = kept
            progress(len(solved), len(wanted))

    jobs = [(task, study.grid, study.bound) for task in wanted]
    if workers == 0:
        keep(map(_solve, jobs))
    else:
        pool = worker_pool(min(workers, len(jobs)), preload=[__name__])
        try:
            keep(pool.map(_solve, jobs))
        finally:
            # Nobody waits any more for what an error or Ctrl-C has broken off.
            pool.shutdown(wait=False, cancel_futures=True)
    found: dict[str, dict[float, tuple[Kept, ...]]] = {name: {} for name in study.factors}
    for (factor, value), each in tasks.items():
        found[factor][value] = tuple(solved[task] for task in each)
    return MapResult(study, found)


def _tasks(study: MapStudy) -> dict[tuple[str, float], list[Task]]:
    """The maps of each value of each factor."""
    tasks: dict[tuple[str, float], list[Task]] = {}
    for factor, values in study.factors.items():
        for value in values:
            arena, ratio = study.setting(factor, value)
            if study.world is not None:
                tasks[factor, value] = [(study.world, 0, ratio)]
            else:
                seeds = [run_seed(study.seed, run) for run in range(study.arenas)]
                tasks[factor, value] = [(arena, seed, ratio) for seed in seeds]
    return tasks


def _solve(job: tuple[Task, float, str]) -> Kept:
    """Solve the game on one map."""
    (place, seed, ratio), grid, bound = job
    world = place if isinstance(place, World) else draw_arena(place, seed)
    try:
        table = solve_visibility_game(
            world,
            pursuer_speed=PURSUER_SPEED,
            evader_speed=ratio * PURSUER_SPEED,
            grid=grid,
            bound=bound,
        )
    except InvalidInput as error:
        raise InvalidInput(f"{error} (at a speed ratio of {ratio:g}, in {place})") from None
    places = int((table.sighted > 0).sum())
    return Kept(table.share_for_ever, table.pairs / (places * int(table.evader_nodes.sum())))


def mean_share(shares: np.ndarray, confidence: float = 0.95) -> Estimate:
    """Mean over arenas with Student's interval, cut to [0, 1]; of one world without one.

    Args:
        shares: Shape (arenas,).
        confidence: Of the interval, between 0 and 1.
    """
    if len(shares) == 1:
        return Estimate(float(shares[0]), float(shares[0]), float(shares[0]), 0.0, 1)
    found = paired_difference(shares, np.zeros_like(shares), confidence)
    error = float(shares.std(ddof=1)) / len(shares) ** 0.5
    low, high = max(found.low, 0.0), min(found.high, 1.0)
    return Estimate(found.mean, low, high, error, len(shares))


CONFIDENCE = 0.95


def summarise_maps(result: MapResult) -> dict[str, Any]:
    """The study in numbers, ready for JSON.

    Args:
        result: A finished study.

    Returns:
        grid [m], bound, speed_ratio and arenas (of each value; 1 in a world of one's own) of the
        study, confidence, and factors: by name for each value the mean over the arenas of kept,
        the part of the pairs in sight that are kept so for ever, with low and high, and of
        sighted, the part of all pairs that are in sight.
    """
    study = result.study
    factors: dict[str, list[dict[str, float]]] = {}
    for factor, values in result.found.items():
        factors[factor] = []
        for value in values:
            kept = mean_share(result.kept(factor, value), CONFIDENCE)
            sighted = float(result.sighted(factor, value).mean())
            entry = {"value": value, "kept": kept.value, "low": kept.low, "high": kept.high}
            factors[factor].append({**entry, "sighted": sighted})
    return {
        "study": "map",
        "seed": study.seed,
        "arenas": study.arenas if study.world is None else 1,
        "grid": study.grid,
        "bound": study.bound,
        "speed_ratio": study.speed_ratio,
        "confidence": CONFIDENCE,
        "factors": factors,
    }


def map_tables(summary: dict[str, Any]) -> tuple[MeanTable, ...]:
    """A table for each factor.

    Args:
        summary: From `summarise_maps`.
    """
    several = summary["arenas"] > 1
    interval = f", {summary['confidence']:.0%} interval" if several else ""
    head = f"of the pairs in sight, kept for ever{interval}"
    return tuple(
        MeanTable(
            f"{FACTORS[factor]}",
            (FACTORS[factor].partition(" [")[0], head, "of all pairs, in sight"),
            tuple(
                (
                    f"{each['value']:g}",
                    f"{each['kept']:.3f}"
                    + (f" ({each['low']:.3f}-{each['high']:.3f})" if several else ""),
                    f"{each['sighted']:.3f}",
                )
                for each in entries
            ),
        )
        for factor, entries in summary["factors"].items()
    )


def draw_maps(result: MapResult) -> Figure:
    """Shares kept over each factor: a dot for each arena, the means with their intervals.

    Args:
        result: A finished study.
    """
    factors = list(result.found)
    columns = min(3, len(factors))
    rows = -(-len(factors) // columns)
    figure = Figure(figsize=(0.8 + 3.6 * columns, 0.8 + 3.2 * rows), layout="constrained")
    axes = figure.subplots(rows, columns, sharey=True, squeeze=False)
    for axis in axes.ravel()[len(factors) :]:
        axis.set_axis_off()
    for axis, factor in zip(axes.ravel(), factors, strict=False):
        _draw_factor(axis, result, factor)
    axes[0, 0].set_ylim(0.0, 1.02)
    figure.supylabel("share of the pairs in sight", fontsize=10)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=len(labels), frameon=False)
    return figure


def _draw_factor(axis: Axes, result: MapResult, factor: str) -> None:
    values = np.array(list(result.found[factor]))
    spread = 0.012 * (values.max() - values.min())
    for k, value in enumerate(values):
        shares = result.kept(factor, float(value))
        # Side by side, so that no dot hides another.
        aside = spread * np.linspace(-1.0, 1.0, len(shares)) if len(shares) > 1 else np.zeros(1)
        axis.plot(
            value + aside,
            shares,
            "o",
            color="tab:gray",
            alpha=0.4,
            markersize=3,
            label="one arena" if k == 0 and len(shares) > 1 else None,
        )
    means = [mean_share(result.kept(factor, float(value)), CONFIDENCE) for value in values]
    mean = np.array([each.value for each in means])
    reach = np.array([mean - [e.low for e in means], [e.high for e in means] - mean])
    axis.errorbar(
        values,
        mean,
        yerr=reach,
        color="tab:blue",
        marker="o",
        markersize=5,
        linewidth=1.2,
        capsize=3,
        label="kept for ever"
        if len(result.kept(factor, float(values[0]))) == 1
        else f"kept for ever, mean, {CONFIDENCE:.0%} interval",
    )
    axis.set_xlabel(FACTORS[factor])
    axis.grid(alpha=0.3)


def write_map_report(result: MapResult, summary: dict[str, Any], folder: Path) -> list[str]:
    """Write the table, numbers and picture of a finished study; return the names of the files.

    Args:
        result: A finished study.
        summary: From `summarise_maps`.
        folder: Exists.
    """
    rows = [
        {"factor": factor, "value": value, "arena": k, **each._asdict()}
        for factor, values in result.found.items()
        for value, some in values.items()
        for k, each in enumerate(some)
    ]
    pq.write_table(pa.Table.from_pylist(rows), folder / "table.parquet")
    write_json(folder / "summary.json", summary)
    tables = to_markdown(map_tables(summary))
    (folder / "tables.md").write_text(tables, encoding="utf-8")
    draw_maps(result).savefig(folder / "map.png", dpi=120)
    return ["table.parquet", "summary.json", "tables.md", "map.png"]
