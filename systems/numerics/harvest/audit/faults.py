"""What an audit finds wrong: when, with which machines, by how much."""

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

# Faults of a kind between which less time passes are one [s].
APART = 2.0


class AuditFault(NamedTuple):
    """Something that is not as it must be.

    Attributes:
        kind: What is wrong, as "machines too near".
        machines: With which, as ("combine 0", "cart 1"); none where it is with the whole.
        begin: When it begins [s].
        end: When it ends [s].
        time: When it is worst [s].
        amount: How much it is then, in `unit` [-].
        limit: What it may be, in `unit` [-].
        unit: Of amount and limit.
    """

    kind: str
    machines: tuple[str, ...]
    begin: float
    end: float
    time: float
    amount: float
    limit: float
    unit: str


def spells(wrong: np.ndarray, time: np.ndarray) -> Iterator[tuple[int, int]]:
    """Runs of intervals that are wrong, those less than APART from each other as one.

    Args:
        wrong: By interval between two samples, shape (T - 1,).
        time: Of the samples, shape (T,) [s].

    Yields:
        The first interval, and the one after the last.
    """
    numbers = np.flatnonzero(wrong)
    if len(numbers) == 0:
        return
    breaks = np.flatnonzero(time[numbers[1:]] - time[numbers[:-1] + 1] >= APART) + 1
    for run in np.split(numbers, breaks):
        yield int(run[0]), int(run[-1]) + 1


def faults_where(
    kind: str,
    machines: tuple[str, ...],
    amounts: np.ndarray,
    limits: np.ndarray | float,
    unit: str,
    time: np.ndarray,
    moments: Callable[[int], float],
) -> list[AuditFault]:
    """A fault for every spell in which amounts are beyond their limits.

    Args:
        kind: Of the faults.
        machines: With which.
        amounts: By interval, shape (n,); wrong where they are greater than their limits.
        limits: What they may be, shape (n,) or for all.
        unit: Of amounts and limits.
        time: Of the samples, shape (n + 1,) [s].
        moments: When an interval's amount is met [s].
    """
    bounds = np.broadcast_to(limits, amounts.shape)
    found = []
    for first, last in spells(amounts > bounds, time):
        worst = first + int(np.argmax((amounts - bounds)[first:last]))
        found.append(
            AuditFault(
                kind,
                machines,
                float(time[first]),
                float(time[last]),
                moments(worst),
                float(amounts[worst]),
                float(bounds[worst]),
                unit,
            )
        )
    return found
