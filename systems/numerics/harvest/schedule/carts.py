"""Several carts: which combines each of them serves.

Carts do not wait for one another, so that a split is as good as its worst group: by how much the
driving of that group's cart could be slower. Up to ten combines every split is tried (six with
trips to a truck, where each group takes a linear programme for every number of visits to a
trip); more are split into neighbours.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations

from .fleet import Fleet, Truck, require_count
from .limits import best_round
from .rounds import Round
from .tours import shortest_tour

Group = tuple[int, ...]
_ALL_SPLITS, _ALL_SPLITS_WITH_TRUCK = 10, 6


@dataclass(frozen=True)
class CartGroup:
    """One cart's combines.

    Attributes:
        order: In which it serves them.
        round: Its visits.
        travel_scale: By which factor its driving could be slower; less than 1: no schedule.
    """

    order: Group
    round: Round
    travel_scale: float


def assign_combines(
    fleet: Fleet, carts: int, truck: Truck | None = None, *, neighbours: bool = False
) -> tuple[CartGroup, ...]:
    """The split of the combines among at most `carts` carts whose worst group is best.

    Among equals the one whose next worst group is better; then neighbours in a group.

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
    def group_of(combines: Group) -> CartGroup:
        order = shortest_tour(fleet, combines)
        round_, scale = best_round(fleet, order, truck)
        return CartGroup(order=order, round=round_, travel_scale=scale)

    def worth(split: tuple[Group, ...]) -> tuple[list[float], int]:
        scales = sorted(round(group_of(group).travel_scale, 9) for group in split)
        return scales, -sum(group[-1] - group[0] for group in split)

    everyone = tuple(range(fleet.size))
    most = _ALL_SPLITS if truck is None else _ALL_SPLITS_WITH_TRUCK
    splits = _splits if fleet.size <= most and not neighbours else _neighbour_splits
    best = max(splits(everyone, min(carts, fleet.size)), key=worth)
    return tuple(group_of(group) for group in best)


def _splits(combines: Group, carts: int) -> Iterator[tuple[Group, ...]]:
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


def _neighbour_splits(combines: Group, carts: int) -> Iterator[tuple[Group, ...]]:
    """Every way to cut a row of combines into `carts` pieces."""
    for cuts in combinations(range(1, len(combines)), carts - 1):
        edges = (0, *cuts, len(combines))
        yield tuple(combines[edges[i] : edges[i + 1]] for i in range(carts))
