"""Which arcs a solution consists of, so that its switches can be placed exactly.

Intervals of equal duration cannot switch where the optimum does; that costs up to a thousandth of
the time. Optimal paths are bang arcs and few singular ones: once their order is known, a programme
with one duration per arc puts every switch in its place.
"""

import numpy as np

from ..plan import TrailerPath
from ..trailer import Trailer
from .guess import FREE, Guess, columns_at

# Relative distance from a bound within which a control is at it.
_AT_BOUND = 1e-3


def split_into_arcs(path: TrailerPath, trailer: Trailer, intervals_per_arc: int) -> Guess:
    """Group a solution of the programme of one arc by the bounds that its controls are at.

    A single free interval between two arcs is where a switch falls: it is shared between them.

    Args:
        path: The solution.
        trailer: Whose bounds.
        intervals_per_arc: How finely each arc is divided anew.
    """
    bounds = np.array([trailer.speed, trailer.turn_rate])
    at_bound = np.abs(path.controls) >= (1 - _AT_BOUND) * bounds
    signs = np.where(at_bound, np.sign(path.controls), FREE).astype(int)
    ends = np.flatnonzero((signs[1:] != signs[:-1]).any(axis=1)) + 1
    starts = np.concatenate([[0], ends])
    ends = np.concatenate([ends, [len(signs)]])
    switches = path.times[starts].copy()
    kept = np.ones(len(starts), dtype=bool)
    for k in range(1, len(starts) - 1):
        if ends[k] - starts[k] == 1 and not at_bound[starts[k]].all():
            kept[k] = False
            switches[k + 1] = path.times[starts[k] : ends[k] + 1].mean()
    kinds, switches = signs[starts[kept]], np.append(switches[kept], path.times[-1])
    # Two arcs of one kind on both sides of a switch that was none are one.
    same = np.concatenate([[False], (kinds[1:] == kinds[:-1]).all(axis=1)])
    kinds, switches = kinds[~same], switches[np.append(~same, True)]
    durations = np.diff(switches)
    m = intervals_per_arc
    times = np.append(
        (switches[:-1, None] + durations[:, None] * np.arange(m) / m).ravel(), switches[-1]
    )
    middles = 0.5 * (times[1:] + times[:-1])
    held = path.controls[np.searchsorted(path.times, middles, side="right") - 1]
    signs = np.repeat(kinds, m, axis=0)
    controls = np.where(signs == FREE, held, signs * bounds)
    return Guess(columns_at(times, path.times, path.states), controls, durations, signs)
