"""A claim, its verdict against each opponent, and how that hangs on what the thesis leaves open."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...systems.numerics.errors import require
from ...systems.numerics.geometry.random_arena import Arena
from ...systems.numerics.statistics import (
    Estimate,
    PairedDifference,
    holm,
    paired_difference,
    restricted_mean,
)
from ..tracking.scenario import TrackingScenario
from ..world_source import WorldSource
from .opponents import OPPONENTS, cell_name, runs_by_opponent
from .records import StudyResult
from .study import Study
from .team_studies import thesis_base

HOLDS, FAILS, OPEN = "holds", "does not hold", "cannot tell"

# Of any false verdict among the tests of one claim.
LEVEL = 0.05


@dataclass(frozen=True)
class ClaimVerdict:
    """What became of a claim against one opponent.

    Attributes:
        claim: Short name, the same whatever it was judged on.
        figure: Of the thesis, as "2.16".
        says: What the thesis says, in our words.
        opponent: Policy of the evaders.
        level: Mean of the restricted means of the claim's cells, over the runs that there are
            against every opponent [s]; the less, the stronger the opponent.
        verdict: HOLDS, FAILS or OPEN.
        evidence: The numbers, in a sentence.
    """

    claim: str
    figure: str
    says: str
    opponent: str
    level: float
    verdict: str
    evidence: str


@dataclass(frozen=True)
class Judgement:
    """What became of a claim: it holds only if it does against the strongest opponent.

    Attributes:
        against: The verdict on it for each opponent of a study.
    """

    against: tuple[ClaimVerdict, ...]

    @property
    def strongest(self) -> ClaimVerdict:
        """That against the opponent with the least mean over the claim's cells."""
        return min(self.against, key=lambda verdict: verdict.level)

    @property
    def claim(self) -> str:
        """Its short name."""
        return self.strongest.claim

    @property
    def verdict(self) -> str:
        """HOLDS, FAILS or OPEN: that against the strongest opponent."""
        return self.strongest.verdict

    @property
    def said(self) -> str:
        """The verdict with whom it was found against."""
        opponent = self.strongest.opponent
        if len(self.against) == 1:
            return f"{self.verdict}, against {opponent} alone"
        return f"{self.verdict}, against {opponent}, the strongest of {len(self.against)}"

    @property
    def evidence(self) -> str:
        """The numbers against each opponent, those against the strongest first."""
        first = self.strongest
        others = [each for each in self.against if each is not first]
        parts = [f"{self.said} (mean {first.level:.1f} s): {first.evidence}"]
        parts += [
            f"{each.verdict}, against {each.opponent} (mean {each.level:.1f} s): {each.evidence}"
            for each in others
        ]
        return " ".join(part[0].upper() + part[1:] for part in parts)


@dataclass(frozen=True)
class Games:
    """The games of a study against one opponent, cut off at a horizon.

    Attributes:
        result: A finished study, its cells named by `cell_name`.
        opponent: Policy of the evaders.
        horizon: At most that of the study [s].
        shared: Runs that there are against every opponent.
    """

    result: StudyResult
    opponent: str
    horizon: float
    shared: int

    def times(self, pursuers: int, evaders: int, variant: str) -> np.ndarray:
        """min(T, horizon) of a cell's runs, shape (runs,) [s].

        Args:
            pursuers, evaders: How many.
            variant: Of the pursuers.
        """
        cell = cell_name(pursuers, evaders, variant, self.opponent)
        return np.minimum(self.result.times(cell), self.horizon)

    def mean(self, pursuers: int, evaders: int, variant: str) -> Estimate:
        """Restricted mean of a cell up to the horizon [s].

        Args:
            pursuers, evaders: How many.
            variant: Of the pursuers.
        """
        cell = cell_name(pursuers, evaders, variant, self.opponent)
        return restricted_mean(self.result.times(cell), self.result.lost(cell), self.horizon)

    def level(self, cells: Iterable[tuple[int, int, str]]) -> float:
        """Mean of the restricted means of some cells, over the runs that are shared [s].

        Args:
            cells: Pursuers, evaders and variant of each.
        """
        return float(np.mean([self.times(*cell)[: self.shared].mean() for cell in cells]))


def judge_against_each(
    result: StudyResult, horizon: float | None, judge: Callable[[Games], Sequence[ClaimVerdict]]
) -> tuple[Judgement, ...]:
    """Judge claims against every opponent of a study.

    Args:
        result: A finished study.
        horizon: Where times are cut off [s]; None: where the study ends.
        judge: Judges each claim on the games against one opponent, the claims in one order.

    Raises:
        InvalidInput: The horizon is beyond the study's.
    """
    end = result.horizon(result.study.cells[0].name)
    horizon = end if horizon is None else horizon
    require(horizon <= end, "horizon", f"be at most the study's, {end} s", horizon)
    runs = runs_by_opponent(result.study)
    columns = [judge(Games(result, each, horizon, min(runs.values()))) for each in runs]
    return tuple(Judgement(row) for row in zip(*columns, strict=True))


@dataclass(frozen=True)
class Test:
    """A difference, by name, that a claim wants to be positive.

    Attributes:
        name: Of the comparison.
        difference: Of the runs.
    """

    name: str
    difference: PairedDifference


def compare(name: str, first: np.ndarray, second: np.ndarray | float) -> Test:
    """The test that a claim wants the first to be greater than the second, run by run.

    Args:
        name: Of the test.
        first, second: Shape (runs,) each, the second or one number for all runs [s].
    """
    return Test(name, paired_difference(first, np.broadcast_to(second, first.shape)))


def joint_verdict(tests: Sequence[Test]) -> tuple[str, str]:
    """The verdict of a claim that wants every one of some differences to be positive.

    It holds if all are, and does not hold if some is negative, each beyond chance after Holm's
    correction for their number; else nobody can tell.

    Returns:
        Verdict, and how many of the tests say what, with the least of the differences.
    """
    adjusted = holm([test.difference.p_value for test in tests])
    sure = adjusted < LEVEL
    signs = np.sign([test.difference.mean for test in tests])
    with_it, against = int((sure & (signs > 0)).sum()), int((sure & (signs < 0)).sum())
    verdict = FAILS if against else HOLDS if with_it == len(tests) else OPEN
    least = min(tests, key=lambda test: test.difference.mean)
    d = least.difference
    said = (
        f"{with_it} of {len(tests)} tests in favour, {against} against, after Holm; least: "
        f"{least.name} {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}]"
    )
    return verdict, said


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
        horizons: Which [s]; those that are no shorter than the games are left out.
    """
    (name, main), *others = results.items()
    found = {name: judge(main)}
    for horizon in (each for each in horizons if each < main.study.base.seconds):
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
