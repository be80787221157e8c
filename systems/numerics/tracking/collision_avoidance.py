"""Motion of round robots with foresight: they turn aside, make room, and take turns.

The rule of `collision_stop` guarantees that no two robots touch, but alone it would leave robots
blocked in front of one another. So velocities are first chosen with foresight. A robot turns aside,
to the nearer side, if it would meet another within a second. Teammates yield to one another: their
velocities are changed, as little as possible in total, so that nobody approaches a teammate faster
than their gap allows. A standing robot is then pushed along by one that wants to pass. Teammates
that hold each other up take turns, see `take_turns`: the one whose turn it is turns aside for the
other team only, as if its teammates were not there, and has a greater weight when they yield.
Otherwise a robot between a teammate and another team's robot would find no way out on either side.
Robots that keep a promise have the right of way: they keep their desired velocity, and stop only
where a gap is used up; their teammates, and the other team if it yields, make room for them.
Everything is a function of relative positions alone, so it does not depend on rotation, mirroring
or numbering. `wall_sliding` keeps robots out of walls.
"""

import math
from typing import NamedTuple

import numpy as np

from ..compiled import compiled, kernel
from ..geometry.edge_index import END, START, TOLERANCE, EdgeIndex, point_is_free
from ..geometry.wall_sliding import SKIN, slide
from .collision_stop import clear_parts

# A robot turns aside if it would meet another within this time [s].
FORESIGHT = 1.0

# Time for which a way aside must be clear of walls [s].
WALL_FORESIGHT = 0.5

# Size [rad] and number of the turns that are tried, up to a little beyond a right angle.
TURN, TURNS = math.pi / 18.0, 11

# Shortest time in which teammates may close the gap between them [s].
CLOSING_TIME = 0.15

# Rounds of the common projection; more change velocities by less than a hundredth.
ROUNDS = 60

# Gap that robots prefer to keep, in parts of the distance at which they touch: without it a robot
# that does not turn quite aside could not move at all.
ROOM = 0.03

# Weight of a robot whose turn it is, relative to the others.
PRECEDENCE = 30.0

# Weight of a robot with the right of way.
RIGHT_OF_WAY = 1e6

# A yielding team keeps, where it can, as far from the other team as that moves in this time [s].
YIELDING_TIME = 0.5

# Most walls that are considered when a robot yields; `slide` considers all.
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
    """Velocities near the desired ones that, held for a period, touch no robot and no wall.

    Args:
        edges, frame, starts, items, probes: Arrays of an EdgeIndex of where centres may be, shapes
            as there; passed one by one because that is much faster in Numba.
        positions: Of the team, shape (2 n,) [m].
        velocities: Desired, shape (2 n,) [m/s].
        radii: Of the team, shape (n,) [m].
        others: Positions of the other robots, which keep the rule of `clear_parts` too, shape
            (2 m,) [m].
        other_radii: Of the other robots, shape (m,) [m].
        turns: Time left of each robot's turn, from `take_turns`, shape (n,) [s].
        first, rank, near: Who has the right of way, as in `clear_parts`.
        room: Gap that a yielding team prefers to keep to the other robots [m].
        top_speed: Of the team [m/s].
        period: For how long velocities are held [s].

    Returns:
        Shape (2 n,) [m/s]. If nobody is near, these are the desired velocities, slid along walls.
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
        # Those whose turn it is choose first; the others then know their velocities.
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
    """Whether any two robots are so near that foresight can change a velocity."""
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
    """Time until two discs touch [s]; the other disc is at r [m], our relative velocity w [m/s]."""
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
    """Time until robot i, at velocity v, meets a robot [s], and that robot's relative position [m].

    Teammates are assumed to move at their desired velocities, the others to stand. A robot whose
    turn it is ignores teammates except those whose turn it is too, or with the right of way.
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
    """Desired velocity of robot i, turned as little as needed to meet nobody soon, if possible."""
    vx, vy = wished[2 * i], wished[2 * i + 1]
    if vx == 0.0 and vy == 0.0:
        return 0.0, 0.0
    time, rx, ry = _first_meeting(
        i, vx, vy, positions, wished, turn, first, radii, others, other_radii
    )
    if time >= FORESIGHT:
        return vx, vy
    # Try the side away from the other robot first.
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
        first, second: Numbers of the robots, shape (c,); second is -1 for v_second = 0.
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
    """Change velocities in place, by least weighted squares, so that no gap closes too fast.

    n . (v_i - v_j) >= -(gap - room) / CLOSING_TIME between teammates, half of that towards others,
    and -distance / CLOSING_TIME towards walls, for robots that are near somebody. Velocities of
    `fixed` robots are not changed. The gap to keep is `near` towards these, and `room` towards
    others, where that is more than usual.
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
    """Write the constraint of robot i, at (dx, dy) from another; False if that is out of reach."""
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
        # Only edges on whose free side the robot is: thin walls have two edges.
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

    All multipliers are updated at once. That needs more rounds than updating them one after the
    other, but does not depend on their order.
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
        # If nothing changes in this round, nothing will in later ones.
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
