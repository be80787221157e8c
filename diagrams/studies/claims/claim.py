"""A claim, its verdict, and how tests become one."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....systems.numerics.statistics.corrections import holm
from ....systems.numerics.statistics.paired import PairedDifference, paired_difference
from ..records import StudyResult

HOLDS, FAILS, OPEN = "holds", "does not hold", "cannot tell"

# Of any false verdict among the tests of one claim.
LEVEL = 0.05


@dataclass(frozen=True)
class Verdict:
    """What became of a claim.

    Attributes:
        claim: Short name, the same whatever it was judged on.
        figure: Of the thesis, as "2.16".
        says: What the thesis says, in our words.
        verdict: HOLDS, FAILS or OPEN.
        evidence: The numbers, in a sentence.
    """

    claim: str
    figure: str
    says: str
    verdict: str
    evidence: str


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
        first, second: Shape (runs,) each, or one number for all runs [s].
        name: Of the comparison.
        first, second: Run by run, shape (runs,).
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


def capped(result: StudyResult, cell: str, horizon: float) -> np.ndarray:
    """min(T, horizon) of a cell's runs, shape (runs,) [s]; its own horizon is at least that."""
    return np.minimum(result.times(cell), horizon)
