"""What carts plan among: combines that drive and stop, ground that opens, ways over it, windows."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely
from scipy.spatial import KDTree

from ..field.field import Field
from ..machines import MIDDLE, STANDING, Cart, Combine, CombineSize, box_middle, size_of
from ..paths import TimedPath
from .cart_motion import trailer_poses
from .cart_plan import Supply, ended
from .cut_times import GAP, CutTimes, OpenGround, cut_times, free_cells, opened
from .roadmap import SPACING, earliest_arrivals, make_roadmap, node_opens, reopened
from .routes import RoutePlanner, make_planner
from .tanks import Tank, make_tanks
from .traffic import Traffic, combine_traffic, least_gaps
from .visit_choice import Beginnings
from .windows import BETWEEN, Window, beside, find_windows

# Distance of the outermost line from the outer edge of the margin, and of the other line from the
# middle of the margin, towards the field: it leads past carts that stand at their trucks [m].
EDGE, INNER = 2.4, 1.2
# Weight of headings where similar poses are sought: opposite ones are twice as far apart [m].
LIKE = 10.0
# Time between the beginnings of a visit that are considered [s].
LOOKED = 5.0
# Arrivals are computed for departures that are multiples of this [s].
OFTEN = 10.0
# A machine whose planned station changes by no more than this counts as being where it was [m].
SAME = 1e-3

# Part of the auger's reach that is relied on: carts are a little off their paths.
SURE = 0.98

# Where the trailer's box may be beside a standing combine, whose auger swings: to its left and
# ahead, in units of the usual distance, and the box's heading relative to the combine [rad].
PLACES = np.array(
    [(1.0, 0.0, 0.0)]
    + [
        (left, ahead, quarter * math.pi / 4)
        for left in (1.0, 1.5, 0.6, -1.0, -1.5, -0.6)
        for quarter in (0, 4, 2, 6, 1, 3, 5, 7)
        for ahead in (0.0, 0.8, -0.8, 1.4, -1.6)
        if 0.9 < math.hypot(left, ahead) < SURE * STANDING
    ]
)


@dataclass(frozen=True, eq=False)
class CartSurroundings:
    """What carts plan among.

    Attributes:
        team: The combines, N of one size.
        cart: One of the equal carts.
        supply: Crop and trucks.
        plans: Of the combines.
        cut: When they cut the ground.
        free: Cells on which carts may be at some time, shape (rows, columns).
        ground: When each of these cells opens to carts.
        combines: Traffic of the combines.
        planner: Planner of routes.
        tree: Of the nodes of its roadmap, as points that are near one another if poses are similar.
        until: What combines do after this time is not known [s].
    """

    team: Sequence[Combine]
    cart: Cart
    supply: Supply
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
        """Size of the combines."""
        return size_of(self.team)

    @cached_property
    def tanks(self) -> list[Tank]:
        """Tanks of the combines, before any visit."""
        ends = [plan.end for plan in self.plans]
        return make_tanks(self.team, self.cut, self.supply.density, ends)

    @cached_property
    def windows(self) -> list[Window]:
        """All windows of all combines."""
        return find_windows(self.team, self.cart, self.plans, self.ground, self.combines)

    @cached_property
    def beginnings(self) -> Beginnings:
        """When visits in windows can begin."""
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
        """The node of the roadmap that is most similar to each pose, shape (n,)."""
        return np.asarray(self.tree.query(_places(poses))[1])

    def arrivals(self, node: int, time: float) -> np.ndarray:
        """Approximate earliest arrival times at all nodes from one of them, shape (n,) [s]."""
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
    supply: Supply,
    plans: list[TimedPath],
) -> CartSurroundings:
    """Make the surroundings for a field.

    Args:
        field: The field.
        team: The combines, N of one size.
        cart: One of the equal carts.
        swaths: Lines that carts may follow in the field, points of each (n, 2) [m].
        supply: Crop and trucks.
        plans: Of all combines.
    """
    size = size_of(team)
    cut = cut_times(field, size, plans)
    free = free_cells(field, cut)
    ground = opened(free, cut)
    roadmap = make_roadmap(ground, cart, field_lines(field, size, swaths))
    combines = combine_traffic(size, plans)
    planner = make_planner(ground, cart, roadmap, combines, supply.trucks)
    tree = KDTree(_places(roadmap.nodes))
    return CartSurroundings(team, cart, supply, plans, cut, free, ground, combines, planner, tree)


def changed_surroundings(
    world: CartSurroundings, field: Field, plans: list[TimedPath], until: float = np.inf
) -> tuple[CartSurroundings, float]:
    """Update the surroundings when combines have other times.

    Args:
        world: The surroundings before.
        field: The field.
        plans: Of all combines, on the same paths.
        until: What they do after this time is ignored [s].

    Returns:
        The new surroundings, and the time from which on they differ [s].
    """
    plans = [ended(plan, until) for plan in plans]
    since = first_difference(world.plans, plans)
    if since == np.inf:
        return replace(world, until=until), since
    cut = cut_times(field, world.size, plans, world.cut, since)
    ground = opened(world.free, cut)
    roadmap = reopened(world.planner.roadmap, ground, world.cart, since)
    combines = combine_traffic(world.size, plans, world.combines, since)
    trucks = world.supply.trucks
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


def field_lines(
    field: Field, combine: CombineSize, swaths: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """Lines that carts may follow: on the margin, on the headland, round holes, along swaths.

    Args:
        field: The field.
        combine: The width of its header is that of headland rounds.
        swaths: Points of the middle line of each, shape (n, 2) [m].

    Returns:
        Points of each, shape (n, 2); a closed line ends where it begins.
    """
    wide = combine.header_width
    outline = field.outline
    inner = max(field.margin / 2 - INNER, EDGE)
    ways = {inner, field.margin - EDGE} if field.margin > 2 * EDGE else set()
    regions = [outline.buffer(way, join_style="round") for way in sorted(ways)]
    regions += [outline.buffer(-(k + 0.5) * wide, join_style="mitre") for k in range(2)]
    regions += [each.buffer(wide / 2 + 1.0) for each in field.obstacles]
    lines = [np.asarray(line, dtype=float) for line in swaths]
    for region in regions:
        for part in shapely.get_parts(region):
            if not part.is_empty and part.exterior.length > 4 * SPACING:
                lines.append(np.asarray(part.exterior.coords)[:, :2])
    return lines


def _places(poses: np.ndarray) -> np.ndarray:
    """Points that are near one another if poses are similar, shape (n, 4) [m]."""
    turned = LIKE * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    return np.hstack([poses[:, :2], turned])


def first_difference(before: list[TimedPath], after: list[TimedPath]) -> float:
    """When machines begin to deviate from their earlier plans; infinite if never [s]."""
    times = np.arange(0.0, max(plan.end for plan in [*before, *after]) + 2.0, 1.0)
    differs = np.zeros(len(times), dtype=bool)
    for old, new in zip(before, after, strict=True):
        differs |= np.abs(old.station_at(times) - new.station_at(times)) > SAME
    return float(times[np.argmax(differs)]) - 1.0 if differs.any() else np.inf


def is_in_reach(combine: CombineSize, cart: Cart, pose: np.ndarray, state: np.ndarray) -> bool:
    """Whether the auger of a standing combine surely reaches a cart, whose trailer may be bent.

    Args:
        combine, cart: The two machines.
        pose: Of the combine, shape (3,).
        state: Of the cart: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
    """
    x, y, _ = box_middle(state, cart.length, cart.hitch_offset)
    away = math.hypot(x - pose[0], y - pose[1])
    return away <= SURE * STANDING * beside(combine, cart).left


def standing_poses(
    world: CartSurroundings, pose: np.ndarray, time: float, others: Traffic | None = None
) -> np.ndarray:
    """Poses of the tractor in which the auger of a standing combine reaches, shape (n, 3).

    Args:
        world: What carts plan among.
        pose: Of the combine, shape (3,).
        time: When the ground has to be open and other machines clear; infinite: at the end of all
            plans [s].
        others: Other carts.
    """
    cart = world.cart
    reach = beside(world.size, cart).left
    forth = cart.hitch_offset + cart.length * (1.0 - MIDDLE)
    c, s = math.cos(pose[2]), math.sin(pose[2])
    left, ahead, turn = PLACES.T
    course = pose[2] + turn
    x = pose[0] + reach * (c * ahead - s * left) + forth * np.cos(course)
    y = pose[1] + reach * (s * ahead + c * left) + forth * np.sin(course)
    every = np.column_stack([x, y, course])
    opens = node_opens(world.ground, cart, every)
    every = every[(opens <= time) & (opens < np.inf)]
    behind = trailer_poses(every, np.zeros(len(every)), cart)
    times = np.full(len(every), min(time, 1e7))
    fits = np.ones(len(every), dtype=bool)
    for traffic in (world.combines, others):
        if traffic is not None:
            gaps = least_gaps(traffic, world.planner.boxes, every, behind, times)
            fits &= gaps >= GAP + BETWEEN
    return every[fits]
