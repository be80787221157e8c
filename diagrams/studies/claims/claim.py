"""A claim, its verdict against each opponent, and how tests become one."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from ....systems.numerics.errors import require
from ....systems.numerics.statistics import (
    Estimate,
    PairedDifference,
    holm,
    paired_difference,
    restricted_mean,
)
from ..opponents import cell_name, runs_by_opponent
from ..records import StudyResult

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
