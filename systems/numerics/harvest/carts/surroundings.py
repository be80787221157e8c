"""What carts plan among: combines that drive, ground that opens, ways over it, windows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from ..field.field import Field
from ..machines.cart import Cart
from ..machines.combine import Combine, CombineSize, size_of
from ..paths.timed_path import TimedPath
from .cut_times import CutTimes, OpenGround, cut_times, free_cells, opened
from .roadmap import earliest_arrivals, field_lines, make_roadmap, reopened
from .routes import RoutePlanner, make_planner
from .stops import ended
from .traffic import Traffic, combine_traffic
from .visit_choice import Beginnings
from .windows import Window, find_windows

# How far apart two poses of opposite headings are, when those alike are looked for [m].
LIKE = 10.0
# Time between beginnings of a visit that are looked at [s].
LOOKED = 5.0
# Arrivals are looked up for departures so far apart [s].
OFTEN = 10.0
# Between what a plan had and what is left of it when combines are later [m].
SAME = 1e-3


@dataclass(frozen=True, eq=False)
class CartSurroundings:
    """What carts plan among.

    Attributes:
        team: The combines, N of one size.
        cart: One of the equal carts.
        plans: Of the combines.
        cut: When they cut the ground.
        free: Cells on which carts may be at some time, shape (rows, columns).
        ground: From when on they may be there.
        combines: By time.
        planner: Of routes.
        tree: Of the nodes of its roadmap, as points that are near where poses are alike.
        until: What is done later than that is not known [s].
    """

    team: Sequence[Combine]
    cart: Cart
    plans: list[TimedPath]
    cut: CutTimes
    free: np.ndarray
    ground: OpenGround
    combines: Traffic
    planner: RoutePlanner
    tree: KDTree
    until: float = np.inf

    @cached_property
    def size(self) -> CombineSize:
        """Of the combines."""
        return size_of(self.team)

    @cached_property
    def windows(self) -> list[Window]:
        """All of them."""
        return find_windows(self.team, self.cart, self.plans, self.ground, self.combines)

    @cached_property
    def beginnings(self) -> Beginnings:
        """Of visits in windows."""
        spans = [np.arange(w.begin, w.end, LOOKED) for w in self.windows]
        number = np.repeat(np.arange(len(spans)), [len(span) for span in spans])
        poses = [
            w.lane.path.pose_at(w.lane.stations(self.plans[w.combine].station_at(span)))
            for w, span in zip(self.windows, spans, strict=True)
        ]
        times = np.concatenate([np.zeros(0), *spans])
        order = np.argsort(times, kind="stable")
        return Beginnings(
            times,
            np.array([w.combine for w in self.windows], dtype=int)[number],
            number,
            np.array([w.end for w in self.windows])[number],
            self.nodes_near(np.concatenate([np.zeros((0, 3)), *poses])),
        ).chosen(order)

    def nodes_near(self, poses: np.ndarray) -> np.ndarray:
        """The node of the roadmap that is most like each pose, shape (n,)."""
        return np.asarray(self.tree.query(_places(poses))[1])

    def arrivals(self, node: int, time: float) -> np.ndarray:
        """The earliest times at all nodes from one of them, shape (n,) [s]."""
        late = OFTEN * round(time / OFTEN)
        if (node, late) not in self._arrivals:
            self._arrivals[node, late] = earliest_arrivals(self.planner.roadmap, node, late)
        return self._arrivals[node, late] + (time - late)

    @cached_property
    def _arrivals(self) -> dict[tuple[int, float], np.ndarray]:
        return {}


def make_surroundings(
    field: Field,
    team: Sequence[Combine],
    cart: Cart,
    swaths: Sequence[np.ndarray],
    trucks: np.ndarray,
    plans: list[TimedPath],
) -> CartSurroundings:
    """Look at a field for the first time.

    Args:
        field: The field.
        team: The combines, N of one size.
        cart: One of the equal carts.
        swaths: Lines that carts may follow in the field, points of each (n, 2) [m].
        trucks: Poses of the tractor at them, shape (K, 3).
        plans: Of all combines.
    """
    size = size_of(team)
    cut = cut_times(field, size, plans)
    free = free_cells(field, cut)
    ground = opened(free, cut)
    roadmap = make_roadmap(ground, cart, field_lines(field, size, swaths))
    combines = combine_traffic(size, plans)
    planner = make_planner(ground, cart, roadmap, combines, trucks)
    tree = KDTree(_places(roadmap.nodes))
    return CartSurroundings(team, cart, plans, cut, free, ground, combines, planner, tree)


def changed_surroundings(
    world: CartSurroundings,
    field: Field,
    trucks: np.ndarray,
    plans: list[TimedPath],
    until: float = np.inf,
) -> tuple[CartSurroundings, float]:
    """Look at a field when combines have other times.

    Args:
        world: As it was.
        field: The field.
        trucks: Poses of the tractor at them, shape (K, 3).
        plans: Of all combines, on the same paths.
        until: What they do later is not looked at [s].

    Returns:
        The world, and since when it is another one [s].
    """
    plans = [ended(plan, until) for plan in plans]
    since = _first_difference(world.plans, plans)
    if since == np.inf:
        return replace(world, until=until), since
    cut = cut_times(field, world.size, plans, world.cut, since)
    ground = opened(world.free, cut)
    roadmap = reopened(world.planner.roadmap, ground, world.cart, since)
    combines = combine_traffic(world.size, plans, world.combines, since)
    planner = make_planner(ground, world.cart, roadmap, combines, trucks, world.planner, since)
    # The nodes, and so their tree, are the same ones.
    after = replace(
        world,
        plans=plans,
        cut=cut,
        ground=ground,
        combines=combines,
        planner=planner,
        until=until,
    )
    return after, since


def _places(poses: np.ndarray) -> np.ndarray:
    """Points that are near where poses are alike, shape (n, 4) [m]."""
    turned = LIKE * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    return np.hstack([poses[:, :2], turned])


def _first_difference(before: list[TimedPath], after: list[TimedPath]) -> float:
    """When machines begin to be elsewhere than they were to be [s]."""
    times = np.arange(0.0, max(plan.end for plan in [*before, *after]) + 2.0, 1.0)
    differs = np.zeros(len(times), dtype=bool)
    for old, new in zip(before, after, strict=True):
        differs |= np.abs(old.station_at(times) - new.station_at(times)) > SAME
    return float(times[np.argmax(differs)]) - 1.0 if differs.any() else np.inf
