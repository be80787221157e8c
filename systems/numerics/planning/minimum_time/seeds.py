"""Paths to start the solver from: every word of a car, and with obstacles ways round them."""

import heapq
import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely

from ...geometry.world import World
from ..arc_words.quickest import quickest_word, word_path
from ..car_paths import CarPath, dubins_paths, reeds_shepp_paths
from ..plan import TrailerPath
from ..trailer import Trailer, trailer_rates
from .problem import Problem

# Routes keep this many times the clearance away, so that the solver starts in free space; and those
# through passages that are too narrow for that.
_EXTRA, _TIGHT = 1.1, 1.02


def detours(
    world: World,
    clearance: float,
    start: Sequence[float],
    end: Sequence[float],
    extra: float = _EXTRA,
) -> list[np.ndarray]:
    """Routes along corners of the obstacles, the shortest first.

    For every corner there is the shortest route through it; of routes with no obstacle between
    them, the shortest is kept.

    Args:
        world: With the obstacles.
        clearance: Least distance from them [m]; less where the ends are nearer.
        start: x, y [m].
        end: x, y [m].
        extra: How many times the clearance routes keep from obstacles at their corners.

    Returns:
        Polylines from start to end, shape (n, 2) each; empty if there is no way.
    """
    free = world.polygon.buffer(-extra * clearance, join_style="mitre")
    corners = np.unique(shapely.get_coordinates(free), axis=0)
    nodes = np.vstack([np.array([start, end], dtype=float), corners])
    one, other = np.triu_indices(len(nodes), 1)
    lines = np.asarray(shapely.linestrings(np.stack([nodes[one], nodes[other]], axis=1)))
    # An end may be nearer to a wall than the clearance: lines from there only keep out of it.
    area = free.buffer(1e-6 * world.size)
    snug = np.logical_not(shapely.covers(area, shapely.points(nodes)))
    out = shapely.covers(world.polygon, lines)
    legal = np.where(snug[one] | snug[other], out, shapely.covers(area, lines))
    lengths = np.full((len(nodes), len(nodes)), np.inf)
    lengths[one[legal], other[legal]] = lengths[other[legal], one[legal]] = shapely.length(
        lines[legal]
    )
    from_start, before = _shortest(lengths, 0)
    from_end, after = _shortest(lengths, 1)
    routes: dict[tuple[int, ...], float] = {}
    for via in np.argsort(from_start + from_end).tolist():
        total = float(from_start[via] + from_end[via])
        if math.isfinite(total):
            route = [*_chain(before, via)[::-1], *_chain(after, via)[1:]]
            if len(set(route)) == len(route):
                routes.setdefault(tuple(route), total)
    kept: list[np.ndarray] = []
    for route in sorted(routes, key=lambda route: routes[route]):
        line = nodes[list(route)]
        if all(_obstacle_between(world, line, each) for each in kept):
            kept.append(line)
    return kept


def _obstacle_between(world: World, line: np.ndarray, other: np.ndarray) -> bool:
    """Whether two routes with the same ends enclose something that is not free."""
    loop = np.vstack([line, other[-2:0:-1]])
    if len(loop) < 3:
        return False
    enclosed = shapely.make_valid(shapely.Polygon(loop))
    return enclosed.difference(world.polygon).area > 1e-6 * world.free_area


def _shortest(lengths: np.ndarray, source: int) -> tuple[np.ndarray, list[int]]:
    """Dijkstra's distances from a node, and the node before each on the way."""
    best, before = np.full(len(lengths), np.inf), [-1] * len(lengths)
    best[source] = 0.0
    queue = [(0.0, source)]
    while queue:
        distance, node = heapq.heappop(queue)
        if distance > best[node]:
            continue
        for next_node in np.flatnonzero(np.isfinite(lengths[node])).tolist():
            longer = distance + float(lengths[node, next_node])
            if longer < best[next_node]:
                best[next_node], before[next_node] = longer, node
                heapq.heappush(queue, (longer, next_node))
    return best, before


def _chain(before: list[int], node: int) -> list[int]:
    """From a node back to the source."""
    chain = [node]
    while before[chain[-1]] >= 0:
        chain.append(before[chain[-1]])
    return chain


# Number of samples of a seed.
_SAMPLES = 80
# Most Reeds-Shepp words (there can be over forty), most ways round obstacles, and most words at the
# end of each way.
_REEDS_SHEPP_WORDS = 12
_DETOURS = 2
_LOOPS = 3


def default_seeds(problem: Problem) -> list[list[TrailerPath]]:
    """Groups of seeds from a start to the centre of a goal; each is tried if those before it fail.

    In the open: the words of Dubins, and with reverse the shortest words of Reeds and Shepp; into a
    box also the quickest word of three arcs, which may only just enter it. With
    obstacles: those words that stay in the world; and the shortest ways round the obstacles, as
    plain polylines, which the solver bends until the cart can follow them, and as chains of Dubins
    paths. The next group ends the chains with longer Dubins words, so that there are loops in which
    the trailer can swing in.
    """
    trailer, obstacles, discs = problem.trailer, problem.obstacles, problem.discs
    radius = trailer.radius
    first, last = tuple(problem.start[:3].tolist()), problem.goal.state[:3]
    paths = dubins_paths(first, last, radius)
    if trailer.reverse:
        paths += reeds_shepp_paths(first, last, radius)[:_REEDS_SHEPP_WORDS]
    betas = float(problem.start[3]), problem.goal.state[3]
    seeds = [seed_along([path], trailer, betas) for path in paths]
    if obstacles is None or discs is None:
        width, height = problem.goal.tolerance[:2]
        if width > 0 and height > 0 and math.isfinite(width + height):
            word = quickest_word(trailer, problem.start, problem.goal)
            seeds += [] if word is None else [word_path(trailer, problem.start, word)]
        return [seeds]
    area = obstacles.polygon
    seeds = [each for each in seeds if area.covers(shapely.LineString(each.states[:, :2]))]
    loops = []
    for route in _routes(obstacles, max(discs.radii), first[:2], last[:2]):
        if len(route) > 2:
            chain = _dubins_chain(route, first, last, radius)
            seeds.append(_polyline(route, first, last, trailer, betas))
            seeds.append(seed_along(chain, trailer, betas))
            endings = dubins_paths(chain[-1].start, last, radius)[1:_LOOPS]
            loops += [seed_along([*chain[:-1], end], trailer, betas) for end in endings]
    return [seeds, loops]


def _routes(
    world: World, clearance: float, start: Sequence[float], end: Sequence[float]
) -> list[np.ndarray]:
    """The shortest detours, and shorter ones than the last of these through tight passages."""
    routes = detours(world, clearance, start, end)[:_DETOURS]
    tight = detours(world, clearance, start, end, _TIGHT)[:_DETOURS]
    others = [
        each for each in tight if all(_obstacle_between(world, each, known) for known in routes)
    ]
    return routes + others


def seed_along(
    pieces: Sequence[CarPath], trailer: Trailer, betas: tuple[float, float]
) -> TrailerPath:
    """Drive along paths of a car, one after the other.

    If all pieces are driven forwards, the trailer's angle is integrated. Backwards it would fold,
    so its angle is then interpolated linearly between the two values of `betas`.

    Args:
        pieces: The paths.
        trailer: Which drives.
        betas: At the start and at the end [rad].
    """
    states, controls, durations = [], [], []
    total = sum(path.length for path in pieces)
    for path in pieces:
        # Samples in proportion, and a switch between two samples rather than beside one.
        count = max(4, round(_SAMPLES * path.length / max(total, 1e-9)))
        ways = path.length * np.arange(count + 1) / count
        poses = path.poses(ways)
        states.append(poses[:-1])
        middles = 0.5 * (ways[1:] + ways[:-1])
        piece = np.searchsorted(np.cumsum(np.abs(path.lengths)), middles).clip(
            max=len(path.lengths) - 1
        )
        direction = np.sign(path.lengths)[piece]
        turns = np.array(path.turns)[piece] * trailer.turn_rate
        controls.append(np.column_stack([direction * trailer.speed, direction * turns]))
        durations.append(np.full(count, path.length / count / trailer.speed))
    last = np.array([pieces[-1].end])
    poses, held, steps = np.vstack([*states, last]), np.vstack(controls), np.concatenate(durations)
    poses[:, 2] = np.unwrap(poses[:, 2])
    if (held[:, 0] > 0).all():
        beta = _towed(betas[0], held, steps, trailer)
    else:
        beta = np.linspace(*betas, len(poses))
    return TrailerPath(np.append(0.0, np.cumsum(steps)), np.column_stack([poses, beta]), held)


def _towed(beta: float, controls: np.ndarray, steps: np.ndarray, trailer: Trailer) -> np.ndarray:
    """The trailer's angle at the ends of steps, by the midpoint rule."""
    angles = [beta]
    for (v, omega), step in zip(controls.tolist(), steps.tolist(), strict=True):
        middle = beta + step / 2 * trailer_rates(0.0, beta, v, omega, trailer)[3]
        beta += step * trailer_rates(0.0, middle, v, omega, trailer)[3]
        angles.append(beta)
    return np.array(angles)


def _dubins_chain(
    route: np.ndarray, first: Sequence[float], last: Sequence[float], radius: float
) -> list[CarPath]:
    """The shortest Dubins path from each point of a route to the next, heading past its corners."""
    along = [math.atan2(dy, dx) for dx, dy in (route[2:] - route[:-2]).tolist()]
    poses = [
        tuple(first),
        *((*point, angle) for point, angle in zip(route[1:-1].tolist(), along, strict=True)),
        tuple(last),
    ]
    return [dubins_paths(one, other, radius)[0] for one, other in pairwise(poses)]


def _polyline(
    route: np.ndarray,
    first: Sequence[float],
    last: Sequence[float],
    trailer: Trailer,
    betas: tuple[float, float],
) -> TrailerPath:
    """A route at full speed, turned on the spot at its corners."""
    steps = np.diff(route, axis=0)
    ways = np.append(0.0, np.cumsum(np.hypot(*steps.T)))
    at = np.linspace(0.0, ways[-1], _SAMPLES + 1)
    points = np.column_stack([np.interp(at, ways, column) for column in route.T])
    leg = np.searchsorted(ways, at[1:-1], side="right").clip(1, len(steps)) - 1
    headings = np.unwrap([first[2], *np.arctan2(steps[:, 1], steps[:, 0])[leg], last[2]])
    states = np.column_stack([points, headings, np.linspace(*betas, _SAMPLES + 1)])
    return TrailerPath(at / trailer.speed, states, np.tile([trailer.speed, 0.0], (_SAMPLES, 1)))
