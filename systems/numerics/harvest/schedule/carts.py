"""Several carts: which combines each serves, in which order, and what to change if they cannot.

Carts do not wait for one another, so that a split is as good as its worst group, measured by how
much slower that group's cart could drive. With one visit to each combine a round every split
is tried up to ten combines (six with trips to a truck, where each group takes a linear programme
for every number of visits to a trip); more are split into neighbours. Where none of these serves
all, every split of a few combines is tried again with visits in any order, and then groups of
neighbours are tried that several carts serve one after another.

A remedy changes one input alone, just as far as it takes for a schedule.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import combinations, pairwise, product

from .best_visits import ACCURACY, ENOUGH, BestVisits, best_visits, can_keep_up, visits_that_serve
from .fleet import LEAST, MOST, Fleet, Round, Truck, require_count, round_of
from .limits import best_round, is_excluded, least_carts

# The exact search takes time like 2^n n^2.
_EXACT = 11

Group = tuple[int, ...]
Split = tuple[Group, ...]
_ALL_SPLITS, _ALL_SPLITS_WITH_TRUCK = 10, 6
_ANY_ORDER, _ANY_ORDER_WITH_TRUCK, _SHARED = 6, 4, 8
# Combines up to which nothing is left out, so that more of anything is never worse.
_FEW = 4

# Relative precision of a factor, with the visits that are known.
_PRECISION = 1e-12
# Largest factor by which an input is changed.
_FARTHEST = 1e3


def shortest_tour(fleet: Fleet, combines: Sequence[int]) -> tuple[int, ...]:
    """The order of the quickest way round some combines, from the first of them and back.

    The given order is kept if no other is quicker, and for more than eleven combines, whose order
    is taken to be good. Exact otherwise (dynamic programming over subsets, Held and Karp 1962).
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


@dataclass(frozen=True)
class CartGroup:
    """One cart's combines, or those of several that follow one another.

    Attributes:
        order: Order in which it serves them, if each once a round.
        best: The visits with which its driving could be slowest.
        carts: How many carts share them.
    """

    order: Group
    best: BestVisits
    carts: int = 1

    @property
    def travel_scale(self) -> float:
        """Factor by which its driving could be slower; less than 1: there is no schedule."""
        return self.best.scale


Groups = tuple[CartGroup, ...]


def assign_combines(
    fleet: Fleet, carts: int, truck: Truck | None = None, *, neighbours: bool = False
) -> Groups:
    """The split of the combines among at most `carts` carts whose worst group is best.

    Carts share combines only if no split without sharing serves all. Of equally good splits the one
    is taken whose next worst group is better, and then the one whose groups are closer together.

    Args:
        fleet: The combines.
        carts: How many there are at most.
        truck: Where carts of finite capacity unload.
        neighbours: Only groups of combines that follow one another, so that carts keep out of
            each other's way.

    Raises:
        InvalidInput: There are no carts.
    """
    best: Groups = ()
    for groups in _assignments(fleet, carts, truck, neighbours):
        if not best or _worst(groups) > _worst(best):
            best = groups
        if _worst(best) >= ENOUGH:
            break
    return best


def largest_scale(
    groups: Groups,
    fleet: Fleet,
    carts: int,
    truck: Truck | None = None,
    *,
    neighbours: bool = False,
) -> float:
    """Factor by which all driving could be slower, with the groups that are best then.

    For more than a few combines, if all are served, only the groups given are looked at.

    Args:
        groups: From `assign_combines`; if these do not serve all, there are no better ones.
        fleet, carts, truck, neighbours: As there.
    """
    if _worst(groups) < ENOUGH or fleet.size > _FEW:
        return _worst(groups)
    return max(map(_worst, _assignments(fleet, carts, truck, neighbours)))


def _assignments(
    fleet: Fleet, carts: int, truck: Truck | None, neighbours: bool
) -> Iterator[Groups]:
    """Groups that are worth a try: one visit to each a round, then any, then carts that share."""
    require_count("carts", carts)

    @cache
    def order_of(combines: Group) -> Group:
        return shortest_tour(fleet, combines)

    @cache
    def scale_of(combines: Group) -> float:
        return best_round(fleet, order_of(combines), truck)[1]

    @cache
    def group_of(combines: Group, shared_by: int = 1) -> CartGroup:
        order = order_of(combines)
        best = best_visits(fleet, order, truck, shared_by)
        return CartGroup(order=order, best=best, carts=shared_by)

    def best_split(scale: Callable[[Group], float], splits: Iterable[Split]) -> Split:
        return max(
            splits,
            key=lambda split: (
                sorted(round(scale(group), 9) for group in split),
                -sum(group[-1] - group[0] for group in split),
            ),
        )

    everyone, most = tuple(range(fleet.size)), min(carts, fleet.size)
    all_once = fleet.size <= (_ALL_SPLITS if truck is None else _ALL_SPLITS_WITH_TRUCK)
    splits = _splits if all_once and not neighbours else _neighbour_splits
    yield tuple(group_of(group) for group in best_split(scale_of, splits(everyone, most)))
    few = fleet.size <= (_ANY_ORDER if truck is None else _ANY_ORDER_WITH_TRUCK)
    if few and 1 < most < fleet.size:
        again = best_split(lambda group: group_of(group).travel_scale, splits(everyone, most))
        yield tuple(group_of(group) for group in again)
    if carts > 1 and fleet.size <= _SHARED:
        for count in range(1, min(carts, fleet.size + 1)):
            for split, numbers in product(
                _neighbour_splits(everyone, count), _shares(carts, count)
            ):
                yield tuple(
                    group_of(group, number) for group, number in zip(split, numbers, strict=True)
                )


def _worst(groups: Groups) -> float:
    return min(group.travel_scale for group in groups)


def _shares(carts: int, groups: int) -> Iterator[tuple[int, ...]]:
    """Every way to divide all carts among groups, at least one to each."""
    for cuts in combinations(range(1, carts), groups - 1):
        edges = (0, *cuts, carts)
        yield tuple(after - before for before, after in pairwise(edges))


def _splits(combines: Group, carts: int) -> Iterator[Split]:
    """Every way to split into exactly `carts` groups; the first holds the first combine."""
    if carts == 1:
        yield (combines,)
        return
    first, rest = combines[0], combines[1:]
    for size in range(len(combines) - carts + 1):
        for chosen in combinations(rest, size):
            others = tuple(n for n in rest if n not in chosen)
            for split in _splits(others, carts - 1):
                yield ((first, *chosen), *split)


def _neighbour_splits(combines: Group, carts: int) -> Iterator[Split]:
    """Every way to cut a row of combines into `carts` pieces."""
    for cuts in combinations(range(1, len(combines)), carts - 1):
        edges = (0, *cuts, len(combines))
        yield tuple(combines[edges[i] : edges[i + 1]] for i in range(carts))


@dataclass(frozen=True)
class Remedies:
    """For each input the factor at which there is just a schedule; nan: there is none at any.

    For a schedule that is feasible the factors say how far each input may go.

    Attributes:
        factors: Name of an input to its factor, 0 or infinite where any will do. Travel times
            and fill rates may have at most that factor, the others must have at least that.
        combines: How many of the combines, from the first on, the carts can serve.
        carts: How many carts it takes to serve all, up to one for each combine; 0: that is too few.
        carts_bound: How many carts it takes at least, for any strategy.
    """

    factors: dict[str, float]
    combines: int
    carts: int
    carts_bound: int


def find_remedies(
    fleet: Fleet,
    carts: int = 1,
    truck: Truck | None = None,
    serves: Callable[[Fleet, Round], bool] = can_keep_up,
) -> Remedies:
    """For each input alone the change that turns the answer, by bisection of the exact condition.

    Combines stay with their carts, except where the number of either changes.

    Args:
        fleet: The combines.
        carts: How many there are.
        truck: Where carts of finite capacity unload, if anywhere.
        serves: Whether visits are good enough; it may ask for more than that no tank runs over.
    """
    groups = assign_combines(fleet, carts, truck)
    # For each group, visits that work for some change; they may work for others.
    known = [_rounds_of(fleet, group, truck) for group in groups]

    def least(
        change: Callable[[float], tuple[Fleet, Truck | None] | None],
        span: tuple[float, float],
    ) -> float:
        """The smallest factor from which on there is a schedule, of a span of factors."""

        def works(factor: float, search: bool) -> bool:
            changed = change(factor)
            return changed is not None and all(
                _is_served(*changed, group, rounds, search, serves)
                for group, rounds in zip(groups, known, strict=True)
            )

        low, high = span
        return _threshold(works, max(low, 1 / _FARTHEST), min(high, _FARTHEST))

    def scaled(name: str, factor: float) -> Fleet:
        values = tuple(factor * value for value in getattr(fleet, name))
        return replace(fleet, **{name: values})

    def faster(factor: float) -> tuple[Fleet, Truck | None]:
        rows = tuple(tuple(time / factor for time in row) for row in fleet.travel_times)
        return replace(fleet, travel_times=rows), truck

    def slower_filling(factor: float) -> tuple[Fleet, Truck | None] | None:
        most = max(f / u for f, u in zip(fleet.fill_rates, fleet.unload_rates, strict=True))
        return (scaled("fill_rates", 1 / factor), truck) if most < factor else None

    def quicker_unloading(factor: float) -> tuple[Fleet, Truck | None] | None:
        most = max(f / u for f, u in zip(fleet.fill_rates, fleet.unload_rates, strict=True))
        return (scaled("unload_rates", factor), truck) if most < factor else None

    least_filling, most_filling = _span(fleet.fill_rates)
    longest = max(max(row) for row in fleet.travel_times)
    factors = {
        "travel_time": _inverse(least(faster, (longest / MOST, math.inf))),
        "capacity": least(
            lambda factor: (scaled("capacities", factor), truck), _span(fleet.capacities)
        ),
        "fill_rate": _inverse(least(slower_filling, (1 / most_filling, 1 / least_filling))),
        "unload_rate": least(quicker_unloading, _span(fleet.unload_rates)),
    }
    if truck is not None:
        room, away = truck.cart_capacity, truck.travel_time
        factors["cart_capacity"] = least(
            lambda factor: (fleet, replace(truck, cart_capacity=factor * room)), _span((room,))
        )
        factors["truck_travel_time"] = _inverse(
            least(
                lambda factor: (fleet, replace(truck, travel_time=away / factor)),
                (away / MOST, math.inf),
            )
        )
    return Remedies(
        factors=factors,
        combines=_combines_served(fleet, carts, truck, serves),
        carts=_carts_needed(fleet, truck, serves),
        carts_bound=least_carts(fleet, truck),
    )


def is_feasible(
    fleet: Fleet,
    carts: int,
    truck: Truck | None,
    serves: Callable[[Fleet, Round], bool] = can_keep_up,
) -> bool:
    """Whether some split of the combines leaves every cart time enough to drive.

    Args:
        fleet, carts, truck, serves: As of `find_remedies`.
    """
    if is_excluded(fleet, carts, truck):
        return False
    groups = assign_combines(fleet, carts, truck)
    return all(
        group.travel_scale >= ENOUGH
        and any(serves(fleet, each) for each in _rounds_of(fleet, group, truck))
        for group in groups
    )


def _rounds_of(fleet: Fleet, group: CartGroup, truck: Truck | None) -> list[Round]:
    """Visits that are tried for a group: the best, and one to each combine a round."""
    once = [] if group.carts > 1 else [best_round(fleet, group.order, truck)[0]]
    return [group.best.round, *(each for each in once if each != group.best.round)]


def _span(values: Sequence[float]) -> tuple[float, float]:
    """The smallest and the largest factor that leave all values in the range allowed."""
    return LEAST / min(values), MOST / max(values)


def _inverse(factor: float) -> float:
    return 1 / factor if factor else math.inf


def _is_served(
    fleet: Fleet,
    truck: Truck | None,
    group: CartGroup,
    known: list[Round],
    search: bool,
    serves: Callable[[Fleet, Round], bool],
) -> bool:
    """Whether carts can serve a group with visits that are known, or others that are found.

    Args:
        fleet: The combines as they are changed.
        truck: The truck as it is changed.
        group: The combines that are served, and by how many carts.
        known: Visits that are known; those found are added.
        search: Whether to look for others.
        serves: Whether visits are good enough.
    """
    for each in known:
        again = round_of(fleet, each.combines, each.trips, truck, each.carts)
        if serves(fleet, again):
            return True
    if not search:
        return False
    found = visits_that_serve(fleet, group.order, truck, group.carts)
    if found is None or not serves(fleet, found):
        return False
    known.append(found)
    return True


def _threshold(works: Callable[[float, bool], bool], least: float, most: float) -> float:
    """The smallest factor that works, if all larger ones do; nan: none works, 0: even `least` does.

    With the visits that are known it is exact; others are only looked for where they would make it
    smaller by `ACCURACY`.

    Args:
        works: Whether a factor works, with the visits that are known or (second argument) others.
        least, most: The smallest and largest factor that are tried; around 1.
    """
    low, high = 1.0, 1.0
    if works(1.0, True):
        while works(low, True):
            if low <= least:
                return 0.0
            low, high = max(low / 2, least), low
    elif not works(most, True):
        return math.nan
    else:
        while not works(high, True):
            low, high = high, min(high * 2, most)
    while True:
        lowest = low
        while high - lowest > _PRECISION * high:
            middle = (lowest + high) / 2
            if middle in (lowest, high):
                break
            lowest, high = (lowest, middle) if works(middle, False) else (middle, high)
        smaller = (1.0 - ACCURACY) * high
        if smaller <= low or not works(smaller, True):
            return high
        high = smaller


def _combines_served(
    fleet: Fleet, carts: int, truck: Truck | None, serves: Callable[[Fleet, Round], bool]
) -> int:
    """How many combines from the first on the carts can serve."""
    served = 0
    while served < fleet.size and is_feasible(fleet.part(range(served + 1)), carts, truck, serves):
        served += 1
    return served


def _carts_needed(fleet: Fleet, truck: Truck | None, serves: Callable[[Fleet, Round], bool]) -> int:
    """The smallest number of carts that serve all, up to one for each combine; 0: none does."""
    counts = range(1, fleet.size + 1)
    return next((count for count in counts if is_feasible(fleet, count, truck, serves)), 0)
