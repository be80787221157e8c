"""A roadmap for carts: poses on lines of the field, joined by arcs and straights.

Lines are what carts may follow: round the field on the margin and on the headland, round holes, and
along swaths. Nodes are poses on them, in both directions; edges are Dubins paths between near ones,
which end straight, so that the trailer comes into line. An edge opens once all ground under tractor
and trailer has been cut; this time is computed beforehand.
"""

import heapq
import math
from collections.abc import Sequence
from typing import NamedTuple, Self

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from ...compiled import compiled
from ...planning.car_paths import dubins_between
from ...planning.trailer import half_angle_map, half_angles
from ..machines import Cart
from ..paths import cornering_limits
from .cart_motion import trailer_poses
from .cut_times import OpenGround, opens, opens_along
from .traffic import cart_boxes

# Radii of arcs that are tried, in least turning radii; the quickest drivable word is taken.
RADII = (4.0, 2.0, 1.3)
# Straight end of each edge, on which the trailer comes into line, in trailer lengths.
STRAIGHT = 1.2
# Largest angle of the trailer on an edge, and at its end [rad].
BENT, BENT_AT_END = 1.2, 0.35
# Least spacing of nodes on lines [m], and about the most nodes, both directions counted.
SPACING, MOST = 14.0, 3600
# Straight-line reach of edges [m], the most edges that leave a node, and how many of the nearest
# nodes are candidates for them.
FAR, CHOICES, NEAREST = 42.0, 9, 40
# How many of the words that compete with one another are checked against the ground.
RIVALS = 3
# Way between samples of an edge [m].
SAMPLE_WAY = 2.0
# A cart that turns by less between two samples sweeps only ground that is under it at these [rad].
STRAIGHT_ON = 0.02
# Time from when ground is cut until it counts as open [s].
AFTER_CUT = 5.0


class Edges(NamedTuple):
    """Short paths, each of four pieces of constant curvature, and samples along them.

    Attributes:
        source, target: Numbers of nodes, shape (E,).
        poses: Where pieces begin and end, shape (E, 5, 3) [m], [m], [rad].
        lengths: Of the pieces, shape (E, 4) [m].
        duration: Driving time at the speeds that curvatures allow, shape (E,) [s].
        opens: When all ground under it is open, shape (E,) [s].
        circle: Middle and radius of a circle round all outlines on it, shape (E, 3) [m].
        first: Number of the first sample of each, and their total number, shape (E + 1,).
        tractor, trailer: Poses at the samples, shape (S, 3).
        since: Time from the beginning of the edge to each sample, shape (S,) [s].
    """

    source: np.ndarray
    target: np.ndarray
    poses: np.ndarray
    lengths: np.ndarray
    duration: np.ndarray
    opens: np.ndarray
    circle: np.ndarray
    first: np.ndarray
    tractor: np.ndarray
    trailer: np.ndarray
    since: np.ndarray


# Columns of edges that have a row for each sample.
SAMPLED = ("tractor", "trailer", "since")


class Roadmap(NamedTuple):
    """Poses and the edges between them.

    Attributes:
        nodes: Poses of the tractor, shape (n, 3) [m], [m], [rad].
        opens: When the ground under a cart that stands in line at a node is open, shape (n,) [s].
        edges: Between the nodes.
        reach: Largest distance between nodes that an edge joins [m].
    """

    nodes: np.ndarray
    opens: np.ndarray
    edges: Edges
    reach: float


def make_roadmap(ground: OpenGround, cart: Cart, lines: Sequence[np.ndarray]) -> Roadmap:
    """Make a roadmap: nodes on lines, and edges between them.

    Args:
        ground: When each cell of the ground opens to carts.
        cart: One of the equal carts.
        lines: Points of each line, shape (m, 2) [m].
    """
    total = sum(float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in lines)
    spacing = max(SPACING, 2 * total / MOST)
    places = [_poses_on(line, spacing) for line in lines]
    ahead = np.concatenate(places)
    nodes = np.concatenate([ahead, ahead + np.array([0.0, 0.0, math.pi])])
    line = np.concatenate([np.full(len(each), k) for k, each in enumerate(places)])
    line = np.concatenate([line, line + len(places)])
    opens = node_opens(ground, cart, nodes)
    kept = opens < np.inf
    nodes, opens, line = nodes[kept], opens[kept], line[kept]
    reach = max(FAR, 2.2 * spacing)
    pairs = KDTree(nodes[:, :2]).query_pairs(reach, output_type="ndarray")
    source, target = np.concatenate([pairs, pairs[:, ::-1]]).T
    near = _likely(nodes[source], nodes[target], source)
    source, target = source[near], target[near]
    rivals = source * (line.max() + 1) + line[target]
    words = _words(cart, nodes[source], nodes[target], rivals)
    # Keep from each node the quickest edge to each line, and of those the quickest few. For most
    # nodes the quickest words give enough of them: slower words are tried for the others only.
    rank = _ranks(source[words.pair], words.duration)
    edges = _driven(ground, cart, nodes[source], None, words.chosen(rank < 2 * CHOICES))
    for low, high in ((2 * CHOICES, 4 * CHOICES), (4 * CHOICES, np.inf)):
        edges = take_edges(edges, _first_of_each(rivals[edges.source], edges.duration, 1))
        enough = np.bincount(source[edges.source], minlength=len(nodes)) >= CHOICES
        chosen = (rank >= low) & (rank < high) & ~enough[source[words.pair]]
        more = _driven(ground, cart, nodes[source], None, words.chosen(chosen))
        edges = joined_edges([edges, more])
    edges = take_edges(edges, _first_of_each(rivals[edges.source], edges.duration, 1))
    edges = edges._replace(
        source=source[edges.source].astype(np.int64), target=target[edges.target].astype(np.int64)
    )
    edges = take_edges(edges, _first_of_each(edges.source, edges.duration, CHOICES))
    return _without_dead_ends(Roadmap(nodes, opens, edges, reach))


def _without_dead_ends(roadmap: Roadmap) -> Roadmap:
    """The largest strongly connected part of a roadmap: every node leads to every other one."""
    nodes, opens, edges, reach = roadmap
    links = csr_array(
        (np.ones(len(edges.source)), (edges.source, edges.target)), shape=(len(nodes), len(nodes))
    )
    part = connected_components(links, connection="strong")[1]
    kept = part == np.bincount(part).argmax() if len(nodes) else part > 0
    number = np.cumsum(kept) - 1
    edges = take_edges(edges, np.flatnonzero(kept[edges.source] & kept[edges.target]))
    edges = edges._replace(source=number[edges.source], target=number[edges.target])
    return Roadmap(nodes[kept], opens[kept], edges, reach)


def reopened(roadmap: Roadmap, ground: OpenGround, cart: Cart, since: float) -> Roadmap:
    """The same roadmap after the times at which ground opens have changed.

    Args:
        roadmap: The roadmap before.
        ground: When each cell of the ground opens to carts.
        cart: One of the equal carts.
        since: Edges that opened by then still do so at the same times [s].
    """
    edges = roadmap.edges
    later = np.flatnonzero(edges.opens > since)
    opens = edges.opens.copy()
    opens[later] = _edge_opens(ground, cart, edges, later)
    nodes = node_opens(ground, cart, roadmap.nodes)
    return roadmap._replace(opens=nodes, edges=edges._replace(opens=opens))


def earliest_arrivals(roadmap: Roadmap, node: int, time: float) -> np.ndarray:
    """Earliest arrival times at all nodes, without regard to other machines, shape (n,) [s].

    Args:
        roadmap: With nodes and edges.
        node: Where the cart is.
        time: When it is there [s].
    """
    edges = roadmap.edges
    labels = np.full(len(roadmap.nodes), np.inf)
    labels[node] = time
    _spread(labels, *_by_node(edges.source, edges.target, len(labels)), edges.opens, edges.duration)
    return labels


def opens_to(roadmap: Roadmap, nodes: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """Times from which each node has a way to at least one of some goals, shape (n,) [s].

    Args:
        roadmap: With nodes and edges.
        nodes: Numbers of the nodes that are goals, shape (k,).
        closed: Whether each edge may not be used, shape (E,).
    """
    edges = roadmap.edges
    labels = np.full(len(roadmap.nodes), np.inf)
    labels[nodes] = -np.inf
    none = np.zeros(len(edges.source))
    opens = np.where(closed, np.inf, edges.opens)
    _spread(labels, *_by_node(edges.target, edges.source, len(labels)), opens, none)
    return labels


def _by_node(
    leaving: np.ndarray, reaching: np.ndarray, count: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Edges sorted by the node that they leave, the first of each node, and where they lead."""
    order = np.argsort(leaving, kind="stable")
    return order, np.searchsorted(leaving[order], np.arange(count + 1)), reaching


@compiled
def _spread(labels, order, first, reaching, opens, duration):
    """Lower labels by Dijkstra's algorithm; an edge is left as soon as it is open."""
    heap = [(0.0, np.int64(-1)) for _ in range(0)]
    for n in range(len(labels)):
        if labels[n] < np.inf:
            heapq.heappush(heap, (labels[n], np.int64(n)))
    while len(heap) > 0:
        label, n = heapq.heappop(heap)
        if label > labels[n]:
            continue
        for k in range(first[n], first[n + 1]):
            e = order[k]
            there = max(label, opens[e]) + duration[e]
            if there < labels[reaching[e]]:
                labels[reaching[e]] = there
                heapq.heappush(heap, (there, np.int64(reaching[e])))


def node_opens(ground: OpenGround, cart: Cart, nodes: np.ndarray) -> np.ndarray:
    """When the ground under carts that stand in line is open, shape (n,) [s].

    Args:
        ground: When each cell of the ground opens to carts.
        cart: One of the equal carts.
        nodes: Poses of the tractor, shape (n, 3).
    """
    boxes = cart_boxes(cart)
    behind = trailer_poses(nodes, np.zeros(len(nodes)), cart)
    latest = np.maximum(opens_along(ground, boxes[0], nodes), opens_along(ground, boxes[1], behind))
    return latest + AFTER_CUT


class _Words(NamedTuple):
    """Arcs and straights that join pairs of poses, not yet checked against the ground.

    Attributes:
        pair: Number of the pair, shape (w,).
        curvatures, lengths: Of the pieces, shape (w, 4) [1/m], [m].
        duration: Shape (w,) [s].
    """

    pair: np.ndarray
    curvatures: np.ndarray
    lengths: np.ndarray
    duration: np.ndarray

    def chosen(self, which: np.ndarray) -> Self:
        """Some of them."""
        return self._make(each[which] for each in self)


def connect(
    ground: OpenGround, cart: Cart, starts: np.ndarray, betas: np.ndarray, ends: np.ndarray
) -> Edges:
    """Connect pairs of poses by edges, where there is one that a cart can drive.

    Args:
        ground: When each cell of the ground opens to carts.
        cart: One of the equal carts.
        starts: Poses, shape (p, 3).
        betas: Angles of the trailer at the starts, shape (p,) [rad].
        ends: Poses, shape (p, 3).

    Returns:
        The quickest edge of each pair that has one; source and target are the number of the pair.
    """
    words = _words(cart, starts, ends, np.arange(len(starts)))
    edges = _driven(ground, cart, starts, betas, words)
    return take_edges(edges, _first_of_each(edges.source, edges.duration, 1))


def _words(cart: Cart, starts: np.ndarray, ends: np.ndarray, rivals: np.ndarray) -> _Words:
    """The quickest few words in each group of pairs; `rivals` numbers the groups, shape (p,)."""
    lead = STRAIGHT * cart.length
    before = ends.copy()
    before[:, 0] -= lead * np.cos(ends[:, 2])
    before[:, 1] -= lead * np.sin(ends[:, 2])
    apart = np.hypot(*(ends - starts)[:, :2].T)
    pairs, curvatures, lengths = [], [], []
    for ratio in RADII:
        radius = ratio * cart.turning_radius
        turns, ways = dubins_between(starts, before, radius)
        # A word that turns far more than it has to goes round in a circle.
        most = apart * 1.3 + 0.9 * math.pi * radius * (ratio == RADII[-1]) + 1.0
        sane = np.flatnonzero(ways.sum(axis=1) + lead < most)
        pairs.append(sane)
        curvatures.append(np.column_stack([turns[sane] / radius, np.zeros(len(sane))]))
        lengths.append(np.column_stack([ways[sane], np.full(len(sane), lead)]))
    pair, bends, ways = (np.concatenate(each) for each in (pairs, curvatures, lengths))
    speeds = cornering_limits(bends, cart.speed, cart.lateral_acceleration)
    words = _Words(pair, bends, ways, (ways / speeds).sum(axis=1))
    return words.chosen(_first_of_each(rivals[pair], words.duration, RIVALS))


def _driven(
    ground: OpenGround, cart: Cart, starts: np.ndarray, betas: np.ndarray | None, words: _Words
) -> Edges:
    """Edges of those words that a cart can drive; source and target are the number of the pair."""
    pair = words.pair
    bent = np.zeros(len(pair)) if betas is None else betas[pair]
    edges = _sampled(cart, starts[pair], bent, words.curvatures, words.lengths)
    edges = take_edges(edges, np.flatnonzero(edges.opens < np.inf))
    edges = edges._replace(opens=_edge_opens(ground, cart, edges, np.arange(len(edges.opens))))
    edges = take_edges(edges, np.flatnonzero(edges.opens < np.inf))
    return edges._replace(source=pair[edges.source], target=pair[edges.target])


def joined_edges(parts: Sequence[Edges]) -> Edges:
    """Several edges as one."""
    columns = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in Edges._fields
        if name != "first"
    }
    counts = np.concatenate([np.diff(part.first) for part in parts])
    return Edges(first=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64), **columns)


def _first_of_each(group: np.ndarray, value: np.ndarray, most: int) -> np.ndarray:
    """Numbers of the `most` least values in each group."""
    return np.flatnonzero(_ranks(group, value) < most)


def _ranks(group: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Rank of each value within its group, from 0 for the least, shape (n,)."""
    order = np.lexsort([value, group])
    ranks = np.empty(len(order), dtype=np.int64)
    ranks[order] = np.arange(len(order)) - np.searchsorted(group[order], group[order])
    return ranks


def take_edges(edges: Edges, chosen: np.ndarray) -> Edges:
    """Some edges with their samples.

    Args:
        edges: All of them.
        chosen: Numbers of those that are taken, shape (k,).
    """
    counts = np.diff(edges.first)[chosen]
    first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    samples = np.arange(first[-1]) + np.repeat(edges.first[:-1][chosen] - first[:-1], counts)
    columns = {
        name: getattr(edges, name)[samples if name in SAMPLED else chosen]
        for name in Edges._fields
        if name != "first"
    }
    return Edges(first=first, **columns)


def _poses_on(line: np.ndarray, spacing: float) -> np.ndarray:
    """Poses along a line, at its ends too where it is open, shape (n, 3)."""
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    count = max(1, round(way[-1] / spacing))
    at = np.linspace(0.0, way[-1], count + 1)
    closed = bool(np.allclose(line[0], line[-1]))
    ahead, behind = at + 2.0, at - 2.0
    if closed:
        at, ahead, behind = at[:-1], ahead[:-1] % way[-1], behind[:-1] % way[-1]

    def point(ways: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(ways, way, column) for column in line.T])

    course = point(ahead) - point(behind)
    return np.column_stack([point(at), np.arctan2(course[:, 1], course[:, 0])])


def near_nodes(roadmap: Roadmap, poses: np.ndarray, *, onto: bool) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of a pose and a node that an edge may join.

    Args:
        roadmap: With nodes.
        poses: Of a tractor, shape (n, 3).
        onto: Whether edges lead to the nodes, or from them.

    Returns:
        Numbers of poses and of nodes, shape (p,) each.
    """
    nodes = roadmap.nodes
    far = np.hypot(*(poses[:, None, :2] - nodes[None, :, :2]).transpose(2, 0, 1))
    pose, node = np.nonzero(far < max(roadmap.reach, 1.5 * FAR))
    ends = (poses[pose], nodes[node]) if onto else (nodes[node], poses[pose])
    likely = _likely(*ends, pose)
    return pose[likely], node[likely]


def _likely(starts: np.ndarray, ends: np.ndarray, group: np.ndarray) -> np.ndarray:
    """Numbers of the nearest pairs in each group that an edge can join without going in a circle.

    The second pose is ahead of the first or beside it, not behind it.
    """
    dx, dy = (ends - starts)[:, :2].T
    apart = np.hypot(dx, dy)
    ahead = (dx * np.cos(starts[:, 2]) + dy * np.sin(starts[:, 2])) / (apart + 1e-9)
    into = (dx * np.cos(ends[:, 2]) + dy * np.sin(ends[:, 2])) / (apart + 1e-9)
    turned = np.abs(np.remainder(ends[:, 2] - starts[:, 2] + np.pi, 2 * np.pi) - np.pi)
    # Straight on and gently aside; quarter turns; and turns back, to what is beside.
    fits = (ahead > 0.3) & (into > 0.3) & (turned < 2.4)
    fits |= (turned > 2.0) & (ahead > -0.3) & (ahead < 0.9) & (apart < 28.0)
    chosen = np.flatnonzero(fits & (apart > 4.0))
    return chosen[_first_of_each(group[chosen], apart[chosen], NEAREST)]


def _sampled(
    cart: Cart, starts: np.ndarray, betas: np.ndarray, curvatures: np.ndarray, lengths: np.ndarray
) -> Edges:
    """Edges with samples from curvatures and lengths, not yet checked against the ground."""
    count = len(starts)
    poses = np.empty((count, 5, 3))
    pairs = np.empty((count, 5, 2))
    poses[:, 0], pairs[:, 0] = starts, half_angles(betas)
    for k in range(4):
        poses[:, k + 1] = _moved(poses[:, k], curvatures[:, k], lengths[:, k])
        maps = half_angle_map(cart.trailer, 1.0, curvatures[:, k], lengths[:, k])
        pairs[:, k + 1] = np.einsum("nij,nj->ni", maps, pairs[:, k])
        pairs[:, k + 1] /= np.hypot(*pairs[:, k + 1].T)[:, None]
    speeds = cornering_limits(curvatures, cart.speed, cart.lateral_acceleration)
    ends = np.concatenate([np.zeros((count, 1)), np.cumsum(lengths, axis=1)], axis=1)
    clock = np.concatenate([np.zeros((count, 1)), np.cumsum(lengths / speeds, axis=1)], axis=1)
    samples = np.ceil(ends[:, -1] / SAMPLE_WAY).astype(np.int64) + 1
    first = np.concatenate([[0], np.cumsum(samples)]).astype(np.int64)
    edge = np.repeat(np.arange(count), samples)
    share = (np.arange(first[-1]) - first[edge]) / (samples[edge] - 1)
    at = share * ends[edge, -1]
    piece = np.clip((at[:, None] >= ends[edge, 1:-1]).sum(axis=1), 0, 3)
    driven = at - ends[edge, piece]
    bend = curvatures[edge, piece]
    tractor = _moved(poses[edge, piece], bend, driven)
    maps = half_angle_map(cart.trailer, 1.0, bend, driven)
    pair = np.einsum("nij,nj->ni", maps, pairs[edge, piece])
    beta = np.remainder(2 * np.arctan2(pair[:, 0], pair[:, 1]) + np.pi, 2 * np.pi) - np.pi
    trailer = trailer_poses(tractor, beta, cart)
    since = clock[edge, piece] + driven / speeds[edge, piece]
    bent = np.zeros(count)
    np.maximum.at(bent, edge, np.abs(beta))
    last = np.abs(beta[first[1:] - 1]) if count else np.zeros(0)
    bad = (bent > np.maximum(BENT, np.abs(betas) + 1e-9)) | (last > BENT_AT_END)
    middle = np.column_stack(
        [(tractor[:, 0] + trailer[:, 0]) / 2, (tractor[:, 1] + trailer[:, 1]) / 2]
    )
    low, high = np.full((count, 2), np.inf), np.full((count, 2), -np.inf)
    np.minimum.at(low, edge, middle)
    np.maximum.at(high, edge, middle)
    size = np.hypot(cart.length + cart.hitch_offset, cart.width) + 0.5
    circle = np.column_stack([(low + high) / 2, np.hypot(*(high - low).T) / 2 + size])
    number = np.arange(count)
    duration = clock[:, -1]
    opens = np.where(bad, np.inf, -np.inf)
    return Edges(
        number, number, poses, lengths, duration, opens, circle, first, tractor, trailer, since
    )


def _edge_opens(ground: OpenGround, cart: Cart, edges: Edges, chosen: np.ndarray) -> np.ndarray:
    """When the ground under some edges is open, shape (n,) [s]."""
    boxes = cart_boxes(cart)
    return _opens_under(ground, boxes, edges.first, edges.tractor, edges.trailer, chosen)


@compiled
def _opens_under(ground, boxes, first, tractor, trailer, chosen):
    found = np.empty(len(chosen))
    for i in range(len(chosen)):
        latest = -np.inf
        last = first[chosen[i] + 1] - 1
        # In bends a corner may swing out between two samples: the pose halfway is checked too.
        for half in range(2 * first[chosen[i]], 2 * last + 1):
            k, after = half // 2, (half + 1) // 2
            if k < after and abs(tractor[after, 2] - tractor[k, 2]) < STRAIGHT_ON:
                continue
            for poses, box in ((tractor, boxes[0]), (trailer, boxes[1])):
                x, y = (poses[k, 0] + poses[after, 0]) / 2, (poses[k, 1] + poses[after, 1]) / 2
                theta = (poses[k, 2] + poses[after, 2]) / 2
                latest = max(latest, opens(ground, box, x, y, theta))
            if latest == np.inf:
                break
        found[i] = latest + AFTER_CUT
    return found


def _moved(poses: np.ndarray, curvatures: np.ndarray, ways: np.ndarray) -> np.ndarray:
    bend = curvatures * ways
    chord = ways * np.sinc(bend / (2 * np.pi))
    middle = poses[:, 2] + bend / 2
    return poses + np.column_stack([chord * np.cos(middle), chord * np.sin(middle), bend])
