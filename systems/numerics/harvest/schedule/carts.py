"""Several carts: which combines each of them serves.

Carts do not wait for one another, so that a split is as good as its worst group: by how much the
driving of that group's cart could be slower. With one visit to each combine a round every split
is tried up to ten combines (six with trips to a truck, where each group takes a linear programme
for every number of visits to a trip); more are split into neighbours. Where none of these serves
all, every split of a few combines is tried again with visits in any order, and then carts share
what a split gives them: neighbours that several carts serve one after another.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations, pairwise

from .best_visits import BestVisits, best_visits
from .fleet import Fleet, Truck, require_count
from .limits import best_round
from .tours import shortest_tour

Group = tuple[int, ...]
Split = tuple[Group, ...]
_ALL_SPLITS, _ALL_SPLITS_WITH_TRUCK = 10, 6
_ANY_ORDER, _ANY_ORDER_WITH_TRUCK, _SHARED = 6, 4, 8


@dataclass(frozen=True)
class CartGroup:
    """One cart's combines, or those of several that follow one another.

    Attributes:
        order: In which it serves them, if each once a round.
        best: The visits with which its driving could be slowest.
        carts: How many carts share them.
    """

    order: Group
    best: BestVisits
    carts: int = 1

    @property
    def travel_scale(self) -> float:
        """By which factor its driving could be slower; less than 1: there is no schedule."""
        return self.best.scale


def assign_combines(
    fleet: Fleet, carts: int, truck: Truck | None = None, *, neighbours: bool = False
) -> tuple[CartGroup, ...]:
    """The split of the combines among at most `carts` carts whose worst group is best.

    Carts share combines only where none of the splits without that serves all. Among equals the
    one whose next worst group is better; then neighbours in a group.

    Args:
        fleet: The combines.
        carts: How many there are at most.
        truck: Where carts of finite capacity unload.
        neighbours: Only groups of combines that follow one another, so that carts keep out of
            each other's way.

    Raises:
        InvalidInput: There are no carts.
    """
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
    found = tuple(group_of(group) for group in best_split(scale_of, splits(everyone, most)))
    few = fleet.size <= (_ANY_ORDER if truck is None else _ANY_ORDER_WITH_TRUCK)
    if few and 1 < most < fleet.size and _worst(found) < 1.0:
        again = best_split(lambda group: group_of(group).travel_scale, splits(everyone, most))
        found = tuple(group_of(group) for group in again)
    if carts > 1 and fleet.size <= _SHARED and _worst(found) < 1.0:
        shared = (
            tuple(group_of(group, number) for group, number in zip(split, numbers, strict=True))
            for count in range(1, min(carts, fleet.size + 1))
            for split in _neighbour_splits(everyone, count)
            for numbers in _shares(carts, count)
        )
        found = max((found, *shared), key=_worst)
    return found


def _worst(groups: tuple[CartGroup, ...]) -> float:
    return min(group.travel_scale for group in groups)


def _shares(carts: int, groups: int) -> Iterator[tuple[int, ...]]:
    """Every way to give each group at least one of the carts, and all of them to some."""
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
