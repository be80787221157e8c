"""The order in which a cart serves its combines."""

import math
from collections.abc import Sequence
from itertools import pairwise

from .fleet import Fleet

# The exact search takes time like 2^n n^2.
_EXACT = 11


def shortest_tour(fleet: Fleet, combines: Sequence[int]) -> tuple[int, ...]:
    """The quickest way round some combines, from the first of them and back [s].

    Their given order stands if no other is quicker, and for more than eleven of them: there the
    order of the rows is taken for good. Exact otherwise (dynamic programming over subsets, Held
    and Karp 1962).
    """
    given = tuple(combines)
    if len(given) < 4 and _is_symmetric(fleet):
        return given
    if len(given) > _EXACT:
        return given
    best = _held_karp(fleet, given)
    return best if tour_time(fleet, best) < tour_time(fleet, given) * (1.0 - 1e-12) else given


def tour_time(fleet: Fleet, order: Sequence[int]) -> float:
    """Driving time of one round without a truck [s]."""
    return math.fsum(
        fleet.travel_times[here][there] for here, there in pairwise((*order, order[0]))
    )


def _is_symmetric(fleet: Fleet) -> bool:
    return all(
        fleet.travel_times[i][j] == fleet.travel_times[j][i]
        for i in range(fleet.size)
        for j in range(i)
    )


def _held_karp(fleet: Fleet, combines: tuple[int, ...]) -> tuple[int, ...]:
    """A quickest order. A state is the set of those served and the last of them."""
    first, others = combines[0], combines[1:]
    ways = fleet.travel_times
    states = {(1 << i, i): (ways[first][n], (n,)) for i, n in enumerate(others)}
    for _ in range(len(others) - 1):
        longer: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {}
        for (done, _last), (time, order) in states.items():
            for i, n in enumerate(others):
                if done >> i & 1:
                    continue
                key, total = (done | 1 << i, i), time + ways[order[-1]][n]
                if key not in longer or total < longer[key][0]:
                    longer[key] = total, (*order, n)
        states = longer
    if not states:
        return combines
    _, order = min((time + ways[order[-1]][first], order) for time, order in states.values())
    return (first, *order)
