"""How verdicts vary with what the thesis leaves open: map, evaders, robots, horizon."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from ....systems.numerics.geometry.random_arena import Arena
from ...tracking.scenario import TrackingScenario
from ...world_source import WorldSource
from ..opponents import OPPONENTS
from ..records import StudyResult
from ..study import Study
from ..tracking_study import thesis_base
from .claim import Judgement

# Half the thickness of the testbed's robots, which the thesis leaves between them and walls [m].
RADIUS = 0.16

# Where times are cut off as well; the thesis does not say what the maximum time is [s].
HORIZONS = (30.0, 60.0)

Judge = Callable[..., tuple[Judgement, ...]]


@dataclass(frozen=True)
class Variant:
    """One way to fill in what is not stated.

    Attributes:
        name: What is different.
        base: What is played.
        arena: How worlds are drawn; None: that of `base`.
        opponents: Policies of the evaders.
    """

    name: str
    base: TrackingScenario
    arena: Arena | None
    opponents: tuple[str, ...] = OPPONENTS


def variants(world: Path | None = None, *, few: bool = False) -> tuple[Variant, ...]:
    """The variants, and the map of your own if you give one.

    Args:
        world: WKT, GeoJSON or ROS map; None: none.
        few: The first alone, other evaders, without other arenas and robots, whose games take long.
    """
    base = thesis_base()
    body = {"model": "differential_drive", "radius": RADIUS}
    robots = replace(
        base,
        pursuers=replace(base.pursuers, **body),
        evaders=replace(base.evaders, **body),
    )
    found = [
        Variant("evaders that wander", base, Arena(), ("random_walk",)),
        Variant("2 obstacles", base, Arena(obstacles=2)),
        Variant("8 obstacles", base, Arena(obstacles=8, longest=0.6)),
        Variant("robots of the testbed", robots, Arena(gap=2.5 * RADIUS)),
    ]
    found = found[:1] if few else found
    if world is not None:
        found.append(Variant(world.stem, thesis_base(world=WorldSource(file=str(world))), None))
    return tuple(found)


def judge_everywhere(
    judge: Judge,
    results: Mapping[str, StudyResult],
    horizons: tuple[float, ...] = HORIZONS,
) -> dict[str, tuple[Judgement, ...]]:
    """Judgements by what was assumed.

    Args:
        judge: `judge_teams` or `judge_allocations`.
        results: Studies by what they assume, the thesis's reading first; that one is judged at
            the shorter horizons too.
        horizons: Which [s].
    """
    (name, main), *others = results.items()
    found = {name: judge(main)}
    for horizon in horizons:
        found[f"{horizon:g} s"] = judge(main, horizon=horizon)
    return {**found, **{name: judge(result) for name, result in others}}


def varied(
    make: Callable[..., Study],
    variant: Variant,
    opponent_runs: Mapping[str, int],
    **options,
) -> Study:
    """The study of `make` on a variant, with other options as it takes them.

    Args:
        make: Makes the study.
        variant: Which.
        opponent_runs: Runs of each cell by opponent, whether the variant has them or not.
        options: Of `make`.
    """
    known = {each: opponent_runs[each] for each in variant.opponents}
    return make(
        base=variant.base,
        arena=variant.arena,
        opponents=variant.opponents,
        opponent_runs=known,
        **options,
    )
