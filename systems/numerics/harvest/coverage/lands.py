"""Contiguous lands of swaths, one a combine, balanced by time."""

import numpy as np

from .swaths import Swath


def chain_swaths(swaths: tuple[Swath, ...]) -> list[int]:
    """Numbers of all swaths, neighbours one after the other: cell by cell, strip by strip."""
    cells: dict[int, list[int]] = {}
    for number, swath in enumerate(swaths):
        cells.setdefault(swath.cell, []).append(number)
    for members in cells.values():
        members.sort(key=lambda number: swaths[number].strip)
    middles = np.array([swath.ends.mean(axis=0) for swath in swaths])
    order: list[int] = []
    left = dict(cells)
    while left:
        if not order:
            # The cell of the outermost strip.
            cell = min(left, key=lambda each: swaths[left[each][0]].strip)
            members = left.pop(cell)
        else:
            at = middles[order[-1]]
            cell = min(
                left,
                key=lambda each: min(np.hypot(*(middles[left[each][k]] - at)) for k in (0, -1)),
            )
            members = left.pop(cell)
            first, last = middles[members[0]], middles[members[-1]]
            if np.hypot(*(last - at)) < np.hypot(*(first - at)):
                members = members[::-1]
        order.extend(members)
    return order


def split_chain(times: np.ndarray, budgets: np.ndarray) -> list[slice]:
    """Parts of a chain of works, in order, so that the latest ends as early as can be.

    Args:
        times: Of the works for the worker of each part, shape (count, m) [s].
        budgets: When the worker of each part begins, shape (count,) [s].
    """
    count = len(budgets)
    low, high = float(budgets.max()), float(budgets.max() + times.max(axis=0).sum())
    ends: list[int] = []
    for _ in range(50):
        middle = (low + high) / 2
        trial = _fill(times, budgets, middle)
        if trial is None:
            low = middle
        else:
            high, ends = middle, trial
    if not ends:
        ends = [times.shape[1]] * count
    begins = [0, *ends[:-1]]
    return [slice(begin, end) for begin, end in zip(begins, ends, strict=True)]


def _fill(times: np.ndarray, budgets: np.ndarray, deadline: float) -> list[int] | None:
    ends, at, last = [], 0, times.shape[1]
    for own, begin in zip(times, budgets, strict=True):
        clock = begin
        while at < last and clock + own[at] <= deadline:
            clock += own[at]
            at += 1
        ends.append(at)
    return ends if at == last else None
