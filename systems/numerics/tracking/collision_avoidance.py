"""Motion of round robots with foresight: they turn aside, make room, and take turns.

That no two ever touch is the rule of `collision_stop`. That rule alone would leave robots in front
of one another. So before it, velocities are chosen with foresight: a robot turns aside, to the
nearer side, where another is in its way within a second, and teammates yield to one another: their
velocities are moved, by the least total change, to where nobody closes in on a teammate faster than
their gap allows. A robot that stands is then pushed along by one that wants to pass. Teammates that
hold each other up take turns, see `turn_taking`: the one whose turn it is turns aside for the other
team only, as if its teammates were not there, and counts for more than they do when they yield.
Otherwise one that stands between a teammate and another team's robot would see no way out on either
side. Robots that keep a promise have the right of way: they go as they wish, and stop only where a
gap is used up; their teammates, and the other team where it yields, make room for them. Everything
is a function of relative positions alone, so it turns, mirrors and renumbers with the team. Walls
are kept off by `wall_sliding`.
"""

import math
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, kernel
from ..geometry.edge_index import END, START, TOLERANCE, EdgeIndex, point_is_free
from ..geometry.wall_sliding import SKIN, slide
from .collision_stop import clear_parts

# A robot that is this near to being met turns aside [s].
FORESIGHT = 1.0

# For this long a way aside must be clear of walls [s].
WALL_FORESIGHT = 0.5

# Turns that are tried, of this size each [rad], up to a little beyond a right angle.
TURN, TURNS = math.pi / 18.0, 11

# Teammates close the gap between them no faster than in this time [s].
CLOSING_TIME = 0.15

# Rounds of the common projection; more change velocities by less than a hundredth.
ROUNDS = 60

# Gap that robots would rather keep, in parts of the distance at which they touch: without it one
# that turns, but not quite aside, could not move at all.
ROOM = 0.03

# By how much a robot counts for more when it is its turn.
PRECEDENCE = 30.0

# By how much a robot with the right of way counts for more.
RIGHT_OF_WAY = 1e6

# A team that yields keeps as far from the other as that goes in this time, where it can [s].
YIELDING_TIME = 0.5

# Walls that a robot heeds when it yields; `slide` heeds all.
WALLS = 8


@compiled
def avoid(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
    turns: np.ndarray,
    first: np.ndarray,
    rank: int,
    near: float,
    room: float,
    top_speed: float,
    period: float,
) -> np.ndarray:
    """Velocities near the desired ones that, held for a period, touch nobody and no wall.

    Args:
        edges, frame, starts, items, probes: The arrays of an EdgeIndex of where centres may be,
            shapes as there, one by one: Numba takes them so in a fraction of the time.
        positions: Of the team, shape (2 n,) [m].
        velocities: Desired, shape (2 n,) [m/s].
        radii: Of the team, shape (n,) [m].
        others: Positions of the other robots, which keep the rule of `clear_parts` too, shape
            (2 m,) [m].
        other_radii: Theirs, shape (m,) [m].
        turns: How much longer it is the turn of each, from `take_turns`, shape (n,) [s].
        first, rank, near: Who has the right of way, as in `clear_parts`.
        room: Gap that a team that yields would rather keep to the other robots [m].
        top_speed: Of the team [m/s].
        period: For how long velocities are held [s].

    Returns:
        Shape (2 n,) [m/s]. Where nobody is near they are the desired ones, slid along walls.
    """
    region = EdgeIndex(edges, frame, starts, items, probes)
    count = len(radii)
    chosen = velocities.copy()
    if _someone_is_near(positions, radii, others, other_radii, top_speed, room):
        wished = np.empty_like(velocities)
        for i in range(count):
            vx, vy = velocities[2 * i], velocities[2 * i + 1]
            speed = math.sqrt(vx * vx + vy * vy)
            scale = top_speed / speed if speed > top_speed else 1.0
            wished[2 * i], wished[2 * i + 1] = scale * vx, scale * vy
        turn = (turns > 0.0) & ~first
        weights = np.where(first, RIGHT_OF_WAY, np.where(turn, PRECEDENCE, 1.0))
        # First those whose turn it is; the others then see where these go.
        for now in (True, False):
            for i in range(count):
                if first[i]:
                    chosen[2 * i], chosen[2 * i + 1] = wished[2 * i], wished[2 * i + 1]
                elif turn[i] == now:
                    chosen[2 * i], chosen[2 * i + 1] = _turned_aside(
                        region, i, positions, wished, turn, first, radii, others, other_radii
                    )
            for i in range(count):
                if turn[i]:
                    wished[2 * i], wished[2 * i + 1] = chosen[2 * i], chosen[2 * i + 1]
        _yield_to_teammates(
            region,
            positions,
            chosen,
            radii,
            others,
            other_radii,
            weights,
            first,
            near,
            room if rank < 0 else 0.0,
            top_speed,
        )
    steps = np.empty_like(velocities)
    for k in range(0, len(velocities), 2):
        x, y = positions[k], positions[k + 1]
        steps[k], steps[k + 1] = slide(region, x, y, period * chosen[k], period * chosen[k + 1])
    parts = clear_parts(positions, steps, radii, others, other_radii, first, rank, near)
    safe = np.empty_like(velocities)
    for i in range(count):
        safe[2 * i] = parts[i] * steps[2 * i] / period
        safe[2 * i + 1] = parts[i] * steps[2 * i + 1] / period
    return safe


@kernel
def _someone_is_near(
    positions: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
    top_speed: float,
    room: float,
) -> bool:
    """Whether foresight can matter to anybody."""
    count = len(radii)
    for i in range(count):
        for j in range(i):
            contact = radii[i] + radii[j]
            reach = contact + 2.0 * top_speed * FORESIGHT
            dx = positions[2 * i] - positions[2 * j]
            dy = positions[2 * i + 1] - positions[2 * j + 1]
            if contact > 0.0 and dx * dx + dy * dy < reach * reach:
                return True
        for j in range(len(other_radii)):
            contact = radii[i] + other_radii[j]
            reach = contact + max(top_speed * FORESIGHT, room)
            dx = positions[2 * i] - others[2 * j]
            dy = positions[2 * i + 1] - others[2 * j + 1]
            if contact > 0.0 and dx * dx + dy * dy < reach * reach:
                return True
    return False


@kernel
def _meeting_time(rx: float, ry: float, wx: float, wy: float, contact: float) -> float:
    """When two discs touch first [s], the other at r [m], we at velocity w towards it [m/s]."""
    towards = rx * wx + ry * wy
    if towards <= 0.0 or contact <= 0.0:
        return np.inf
    excess = rx * rx + ry * ry - contact * contact
    if excess <= 0.0:
        return 0.0
    square = wx * wx + wy * wy
    discriminant = towards * towards - square * excess
    if discriminant < 0.0:
        return np.inf
    return excess / (towards + math.sqrt(discriminant))


@kernel
def _first_meeting(
    i: int,
    vx: float,
    vy: float,
    positions: np.ndarray,
    wished: np.ndarray,
    turn: np.ndarray,
    first: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
) -> tuple[float, float, float]:
    """When robot i, at velocity v, meets somebody first [s], and where that one is from it [m].

    Teammates are taken to move as they wish, the others to stand; whose turn it is heeds no
    teammate but those whose turn it is too, and those with the right of way.
    """
    soonest, soonest_x, soonest_y = np.inf, 0.0, 0.0
    x, y = positions[2 * i], positions[2 * i + 1]
    for j in range(len(radii)):
        if j != i and (turn[j] >= turn[i] or first[j]):
            rx, ry = positions[2 * j] - x, positions[2 * j + 1] - y
            wx, wy = vx - wished[2 * j], vy - wished[2 * j + 1]
            time = _meeting_time(rx, ry, wx, wy, radii[i] + radii[j])
            if time < soonest:
                soonest, soonest_x, soonest_y = time, rx, ry
    for j in range(len(other_radii)):
        rx, ry = others[2 * j] - x, others[2 * j + 1] - y
        time = _meeting_time(rx, ry, vx, vy, radii[i] + other_radii[j])
        if time < soonest:
            soonest, soonest_x, soonest_y = time, rx, ry
    return soonest, soonest_x, soonest_y


@kernel
def _turned_aside(
    region: EdgeIndex,
    i: int,
    positions: np.ndarray,
    wished: np.ndarray,
    turn: np.ndarray,
    first: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
) -> tuple[float, float]:
    """The wish of robot i, turned as little as it takes to meet nobody soon; else as it is."""
    vx, vy = wished[2 * i], wished[2 * i + 1]
    if vx == 0.0 and vy == 0.0:
        return 0.0, 0.0
    time, rx, ry = _first_meeting(
        i, vx, vy, positions, wished, turn, first, radii, others, other_radii
    )
    if time >= FORESIGHT:
        return vx, vy
    # First to the side on which the other is not.
    side = 1.0 if vx * ry - vy * rx <= 0.0 else -1.0
    for k in range(1, TURNS + 1):
        cosine, sine = math.cos(k * TURN), math.sin(k * TURN)
        for sign in (side, -side):
            ux, uy = cosine * vx - sign * sine * vy, sign * sine * vx + cosine * vy
            time, _, _ = _first_meeting(
                i, ux, uy, positions, wished, turn, first, radii, others, other_radii
            )
            if time < FORESIGHT:
                continue
            dx, dy = WALL_FORESIGHT * ux, WALL_FORESIGHT * uy
            sx, sy = slide(region, positions[2 * i], positions[2 * i + 1], dx, dy)
            if sx * ux + sy * uy > 0.9 * (dx * ux + dy * uy):
                return ux, uy
    return vx, vy


class Constraints(NamedTuple):
    """Half-planes n . (v_first - v_second) >= rate for velocities.

    Attributes:
        normals: Unit vectors n, shape (c, 2).
        rates: Shape (c,) [m/s].
        first, second: Numbers of the robots, shape (c,); a second of -1 does not move.
    """

    normals: np.ndarray
    rates: np.ndarray
    first: np.ndarray
    second: np.ndarray


@compiled
def _yield_to_teammates(
    region: EdgeIndex,
    positions: np.ndarray,
    velocities: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
    weights: np.ndarray,
    fixed: np.ndarray,
    near: float,
    room: float,
    top_speed: float,
) -> None:
    """Move velocities, by the least weighted square, to where gaps close no faster than they may.

    n . (v_i - v_j) >= -(gap - room) / CLOSING_TIME between teammates, half of that towards others,
    and -distance / CLOSING_TIME towards the walls beside robots that are near somebody. Those of
    `fixed` robots stay as they are; `near` is the room towards them, and `room` that towards
    others, if these are more than usual.
    """
    count, strangers = len(radii), len(other_radii)
    most = count * (count - 1) // 2 + count * (strangers + WALLS)
    constraints = Constraints(
        np.empty((most, 2)),
        np.empty(most),
        np.empty(most, dtype=np.int64),
        np.empty(most, dtype=np.int64),
    )
    total = 0
    crowded = np.zeros(count, dtype=np.bool_)
    reach = 2.0 * top_speed * CLOSING_TIME
    for i in range(count):
        x, y = positions[2 * i], positions[2 * i + 1]
        for j in range(i):
            dx, dy = x - positions[2 * j], y - positions[2 * j + 1]
            contact = radii[i] + radii[j]
            clear = near if fixed[i] or fixed[j] else 0.0
            far, both = reach + clear, fixed[i] and fixed[j]
            if not both and _keep_gap(constraints, total, dx, dy, contact, far, clear, i, j):
                crowded[i] = crowded[j] = True
                total += 1
        for j in range(strangers):
            dx, dy = x - others[2 * j], y - others[2 * j + 1]
            contact, far = radii[i] + other_radii[j], max(reach, room)
            if not fixed[i] and _keep_gap(constraints, total, dx, dy, contact, far, room, i, -1):
                crowded[i] = True
                total += 1
    if total == 0:
        return
    for i in range(count):
        if (
            crowded[i]
            and not fixed[i]
            and point_is_free(region, positions[2 * i], positions[2 * i + 1])
        ):
            total = _keep_walls(constraints, total, region, positions, i, 0.5 * reach)
    before = velocities.copy()
    _project(velocities, weights, constraints, total)
    for i in range(count):
        if fixed[i]:
            velocities[2 * i], velocities[2 * i + 1] = before[2 * i], before[2 * i + 1]
        vx, vy = velocities[2 * i], velocities[2 * i + 1]
        speed = math.sqrt(vx * vx + vy * vy)
        if speed > top_speed:
            velocities[2 * i] *= top_speed / speed
            velocities[2 * i + 1] *= top_speed / speed


@kernel
def _keep_gap(
    constraints: Constraints,
    at: int,
    dx: float,
    dy: float,
    contact: float,
    reach: float,
    room: float,
    i: int,
    j: int,
) -> bool:
    """Write the constraint of robot i, at (dx, dy) from another, if that one is within reach."""
    distance = math.sqrt(dx * dx + dy * dy)
    gap = distance - contact
    if contact <= 0.0 or distance == 0.0 or gap >= reach:
        return False
    share = 1.0 if j >= 0 else 0.5
    constraints.normals[at, 0], constraints.normals[at, 1] = dx / distance, dy / distance
    constraints.rates[at] = -share * (max(gap, 0.0) - max(ROOM * contact, room)) / CLOSING_TIME
    constraints.first[at], constraints.second[at] = i, j
    return True


@kernel
def _keep_walls(
    constraints: Constraints,
    total: int,
    region: EdgeIndex,
    positions: np.ndarray,
    i: int,
    reach: float,
) -> int:
    """Write the constraints of robot i towards walls within reach; return how many there are."""
    edges, skin = region.edges, SKIN * region.frame[TOLERANCE]
    x, y = positions[2 * i], positions[2 * i + 1]
    last = total + WALLS
    for e in range(len(edges)):
        ex, ey = edges[e, END] - edges[e, START], edges[e, END + 1] - edges[e, START + 1]
        px, py = x - edges[e, START], y - edges[e, START + 1]
        along = min(1.0, max(0.0, (px * ex + py * ey) / (ex * ex + ey * ey)))
        dx, dy = px - along * ex, py - along * ey
        distance = math.sqrt(dx * dx + dy * dy)
        # Only walls on whose free side the robot is: thin ones have two.
        if 0.0 < distance < reach and ex * py - ey * px > 0.0 and total < last:
            constraints.normals[total, 0] = dx / distance
            constraints.normals[total, 1] = dy / distance
            constraints.rates[total] = -max(distance - skin, 0.0) / CLOSING_TIME
            constraints.first[total], constraints.second[total] = i, -1
            total += 1
    return total


@compiled
def _project(
    velocities: np.ndarray, weights: np.ndarray, constraints: Constraints, total: int
) -> None:
    """Project velocities on the first `total` constraints, in place, by Hildreth's method.

    All multipliers are raised or lowered at once, which needs more rounds than one after the
    other, but knows no order.
    """
    normals, rates, first, second = constraints
    degree = np.zeros(len(velocities) // 2)
    for c in range(total):
        degree[first[c]] += 1.0
        if second[c] >= 0:
            degree[second[c]] += 1.0
    multipliers, raised = np.zeros(total), np.empty(total)
    for _ in range(ROUNDS):
        for c in range(total):
            i, j = first[c], second[c]
            speed = normals[c, 0] * velocities[2 * i] + normals[c, 1] * velocities[2 * i + 1]
            mobility = degree[i] / weights[i]
            if j >= 0:
                speed -= normals[c, 0] * velocities[2 * j] + normals[c, 1] * velocities[2 * j + 1]
                mobility += degree[j] / weights[j]
            raised[c] = max(multipliers[c] + (rates[c] - speed) / mobility, 0.0)
        # Where nothing changes, nothing would in further rounds.
        settled = True
        for c in range(total):
            change = raised[c] - multipliers[c]
            if change == 0.0:
                continue
            settled = False
            multipliers[c] = raised[c]
            i, j = first[c], second[c]
            velocities[2 * i] += change * normals[c, 0] / weights[i]
            velocities[2 * i + 1] += change * normals[c, 1] / weights[i]
            if j >= 0:
                velocities[2 * j] -= change * normals[c, 0] / weights[j]
                velocities[2 * j + 1] -= change * normals[c, 1] / weights[j]
        if settled:
            break
