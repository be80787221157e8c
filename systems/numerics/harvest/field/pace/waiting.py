"""Who has to wait for whom, so that the left of every combine stays open."""

from collections.abc import Sequence

import numpy as np

from ..combine_path import CombinePath
from ..swept_cells import CropCells
from .holds import Holds

# Places looked at in each header's width of way.
SAMPLES = 4

# Half the width of a combine's body, in headers' widths.
BODY = 0.2


def find_holds(
    paths: Sequence[CombinePath], cells: CropCells, header: float, gap: float
) -> tuple[Holds, ...]:
    """What each combine waits for: the crop on its left cut, and its cutter a gap ahead.

    On its way to a loop, and in reverse, it waits for the crop in its way instead. Nobody waits
    for a loop that is begun after its own, nor for what another does after the loop that it waits
    for; so there is always one that can go on.

    Args:
        paths: Of the combines.
        cells: As they are cut, if every loop waits for all those before it.
        header: Width of the header [m].
        gap: Way by which the combine on the left is to be ahead [m].
    """
    found = []
    for n, path in enumerate(paths):
        at = np.arange(0.0, path.length, header / SAMPLES)
        working = (path.loop_at(at) >= 0) & (path.gear_at(at) > 0)
        for beside, places in ((True, at[working]), (False, at[~working])):
            # On the way to a loop, what the body is about to drive over has to be cut.
            sides = [header] if beside else [-BODY * header, 0.0, BODY * header]
            where = np.repeat(places, len(sides))
            offsets = np.tile(sides, len(places))
            points = path.alongside(offsets, where)[:, :2]
            row, column, on = cells.cell_of(points)
            by = np.where(on, cells.cut_by[row, column], -1)
            when = cells.cut_at[row, column]
            turn = path.turn_at(where)
            for m, other in enumerate(paths):
                theirs = np.flatnonzero(by == m)
                theirs = theirs[other.turn_at(when[theirs]) < turn[theirs]]
                if m != n and len(theirs):
                    passed = when[theirs]
                    needs = np.minimum(passed + gap, other.end_of_turn(passed))
                    found.append(
                        Holds(n, m, beside, where[theirs], passed, np.maximum.accumulate(needs))
                    )
    return tuple(found)


def least_delays(holds: Sequence[Holds], combines: int, most: float) -> np.ndarray:
    """Ways that the first combine drives before each other starts, so that they rarely wait.

    Args:
        holds: Who waits for whom.
        combines: Number of combines.
        most: Longest delay of one after the one before [m].

    Returns:
        Shape (combines,) [m].
    """
    delays = np.zeros(combines)
    for n in range(1, combines):
        wanted = [
            delays[hold.other] + float((hold.needs - hold.stations).max())
            for hold in holds
            if hold.waiting == n and hold.other < n
        ]
        delays[n] = np.clip(max(wanted, default=0.0), delays[n - 1], delays[n - 1] + most)
    return delays
