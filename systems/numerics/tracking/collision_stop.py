"""Steps cut short, so that round robots never touch; the gaps between them, and who goes first.

Safety comes from one rule, which needs no agreement: **a step may use up half of the gap to
anybody**. Two robots that both keep it stay apart at every moment of the step, whatever else they
do and however they are numbered: along the line between their centres each comes closer by at most
half of the gap, and the distance along that line is never more than their true distance.
`collision_avoidance` chooses velocities with foresight, and then applies this rule.

The gap may be shared unequally if both robots know it: near each other, a robot with the right of
way may use up all of it, and one that yields nothing.

A robot that moves much slower than it wishes is waiting. In a group of teammates close to one
another, the one that has waited longest gets a turn, if that is long enough; of several, the one
nearest to the other team. The others make room for it, see `collision_avoidance`. A turn has a
fixed length: otherwise it would end with the first step that it allows. Then it is the next
robot's turn.

Source: the half of a gap is the reciprocity of van den Berg, Guy, Lin and Manocha, "Reciprocal
n-body collision avoidance" (ISRR 2009), on a fixed line instead of a chosen one; the rest is ours.
"""

import math

import numpy as np

from ..compiled import compiled, kernel
from ..geometry.edge_index import EdgeIndex
from ..geometry.wall_sliding import first_contact, stop_team
from .mobile_agents import clip_symmetric, drive_step

# Gaps below which a right of way counts, in steps: half of a wider gap has room for a full step at
# top speed of both robots.
NEAR = 4.0

# Gap that two bodies always keep, in parts of the sum of their radii: well above rounding.
MARGIN = 1e-6


@kernel
def half_gap_part(
    x: float,
    y: float,
    dx: float,
    dy: float,
    ox: float,
    oy: float,
    contact: float,
    rank: int,
    near: float,
) -> float:
    """Largest part in [0, 1] of a step (dx, dy) within its share of the gap to a robot (kernel).

    The share is one half. In gaps below `near` it is the whole gap for a robot with the right of
    way, and nothing for one that yields.

    Args:
        x, y: Where the step begins [m].
        dx, dy: The step [m].
        ox, oy: The other robot [m].
        contact: Distance of the centres at which the bodies touch [m]; 0: no bodies.
        rank: 1 with the right of way, -1 for one that yields, else 0.
        near: Gap below which `rank` counts, the same for both; at least four steps [m].

    Returns:
        The part; 1 for a step that leads away. It is also 1 for two robots at the same point,
        because no direction is defined.
    """
    rx, ry = ox - x, oy - y
    distance = math.sqrt(rx * rx + ry * ry)
    if contact <= 0.0 or distance == 0.0:
        return 1.0
    towards = (rx * dx + ry * dy) / distance
    gap = max(distance - contact * (1.0 + MARGIN), 0.0)
    allowed = gap * (0.5 * (1 + rank) if gap < near else 0.5)
    return allowed / towards if towards > allowed else 1.0


@compiled
def clear_parts(
    positions: np.ndarray,
    steps: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
    first: np.ndarray,
    rank: int,
    near: float,
) -> np.ndarray:
    """The part of each robot's straight step that uses up no more than its share of any gap.

    Robots that all take their parts at the same time, each at constant speed, do not touch one
    another on the way. Robots that overlap come apart or stay where they are.

    Args:
        positions: Of the team, shape (2 n,) [m].
        steps: Of the team, shape (2 n,) [m].
        radii: Of the team, shape (n,) [m]. Two robots whose radii sum to zero have no bodies.
        others: Positions of robots that keep the same rule, or stand, shape (2 m,) [m].
        other_radii: Theirs, shape (m,) [m].
        first: Who has the right of way over the others of its team, shape (n,), bool.
        rank: 1 for a team that has the right of way over the other robots, -1 for one that yields
            to them, 0 among equals.
        near: Gap below which that counts, the same for all [m]; see `half_gap_part`.

    Returns:
        Shape (n,), each in [0, 1].
    """
    count = len(radii)
    parts = np.ones(count)
    for i in range(count):
        x, y, dx, dy = positions[2 * i], positions[2 * i + 1], steps[2 * i], steps[2 * i + 1]
        for j in range(count):
            if j != i:
                ox, oy = positions[2 * j], positions[2 * j + 1]
                mine = int(first[i]) - int(first[j])
                part = half_gap_part(x, y, dx, dy, ox, oy, radii[i] + radii[j], mine, near)
                parts[i] = min(parts[i], part)
        for j in range(len(other_radii)):
            ox, oy = others[2 * j], others[2 * j + 1]
            part = half_gap_part(x, y, dx, dy, ox, oy, radii[i] + other_radii[j], rank, near)
            parts[i] = min(parts[i], part)
    return parts


@compiled
def stop_at_robots(
    poses: np.ndarray,
    commands: np.ndarray,
    limits: np.ndarray,
    period: float,
    horizon: float,
    radii: np.ndarray,
    others: np.ndarray,
    other_radii: np.ndarray,
    first: np.ndarray,
    rank: int,
    near: float,
) -> np.ndarray:
    """Commands of unicycles, slowed so that no gap is used up by more than its share.

    Args:
        poses: Shape (3 n,) [m], [m], [rad].
        commands: Shape (2 n,) [m/s], [rad/s].
        limits: Top speed and top turn rate, shape (2,) [m/s], [rad/s].
        period: For how long commands are held [s].
        horizon: Time in which half of a gap may be used up [s], the period or longer.
        radii, others, other_radii, first, rank, near: As in `clear_parts`.

    Returns:
        Shape (2 n,), within the limits; turn rates are kept.
    """
    safe = clip_symmetric(commands.reshape((-1, 2)), limits)
    steps = (drive_step(poses, commands, limits, period) - poses) * (horizon / period)
    flat = steps.reshape((-1, 3))[:, :2].copy().reshape((-1,))
    positions = poses.reshape((-1, 3))[:, :2].copy().reshape((-1,))
    parts = clear_parts(positions, flat, radii, others, other_radii, first, rank, near)
    for i in range(len(parts)):
        safe[i, 0] *= parts[i]
    return safe.reshape((-1,))


@compiled
def stop_at_walls(
    edges: np.ndarray,
    frame: np.ndarray,
    starts: np.ndarray,
    items: np.ndarray,
    probes: np.ndarray,
    poses: np.ndarray,
    commands: np.ndarray,
    limits: np.ndarray,
    period: float,
) -> np.ndarray:
    """Commands of unicycles, slowed so that each step ends before the first wall.

    A robot that a wall stops while it turns away from that wall turns faster if it can reach the
    wall's direction within this step: the step then runs along the wall. With a turn rate
    proportional to the remaining angle the turn would never end, and the robot would stand still.

    Args:
        edges, frame, starts, items, probes: Arrays of an EdgeIndex of where centres may be, shapes
            as there; passed one by one because that is much faster in Numba.
        poses, commands, limits, period: As in `stop_at_robots`.

    Returns:
        Shape (2 n,), within the limits; other turn rates are kept.
    """
    index = EdgeIndex(edges, frame, starts, items, probes)
    # Apply the plant's limits first, so that the step checked is the step that it will take.
    safe = clip_symmetric(commands.reshape((-1, 2)), limits)
    steps = drive_step(poses, commands, limits, period) - poses
    parts = stop_team(index, poses, steps)
    for i in range(len(parts)):
        if parts[i] < 1.0:
            pose, rate = poses[3 * i : 3 * i + 3].copy(), safe[i, 1]
            turn = _turn_to_wall(index, pose, steps[3 * i], steps[3 * i + 1])
            faster = rate + 2.0 * turn / period
            if turn * rate > 0.0 and abs(faster) <= limits[1]:
                step = drive_step(pose, np.array([safe[i, 0], faster]), limits, period) - pose
                part = stop_team(index, pose, step)[0]
                if part > parts[i]:
                    safe[i, 1], parts[i] = faster, part
        safe[i, 0] *= parts[i]
    return safe.reshape((-1,))


@kernel
def _turn_to_wall(index: EdgeIndex, pose: np.ndarray, dx: float, dy: float) -> float:
    """Angle from a step (dx, dy) to the nearer direction of the first wall in its way [rad]."""
    _, tx, ty = first_contact(index, pose[0], pose[1], dx, dy)
    side = 1.0 if dx * tx + dy * ty >= 0.0 else -1.0
    return math.atan2(side * (dx * ty - dy * tx), side * (dx * tx + dy * ty))


def pair_gaps(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Gap between the bodies of each pair [m], negative where they overlap.

    Args:
        positions: Of all robots, shape (..., N, 2) [m].
        radii: Theirs, shape (N,) [m].

    Returns:
        Shape (..., N (N - 1) / 2); pairs in the order of `numpy.triu_indices`.
    """
    first, second = np.triu_indices(len(radii), 1)
    offsets = positions[..., first, :] - positions[..., second, :]
    return np.hypot(offsets[..., 0], offsets[..., 1]) - radii[first] - radii[second]


def gaps_between_samples(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Least gap of each pair between consecutive samples, with straight motion in between [m].

    Args:
        positions: Shape (T, N, 2) [m].
        radii: Shape (N,) [m].

    Returns:
        Shape (T - 1, N (N - 1) / 2).
    """
    first, second = np.triu_indices(len(radii), 1)
    offsets = positions[:, first] - positions[:, second]
    start, change = offsets[:-1], np.diff(offsets, axis=0)
    square = np.einsum("tpk,tpk->tp", change, change)
    towards = -np.einsum("tpk,tpk->tp", start, change)
    moment = np.clip(np.divide(towards, square, out=np.zeros_like(square), where=square > 0), 0, 1)
    nearest = start + moment[..., None] * change
    return np.hypot(nearest[..., 0], nearest[..., 1]) - radii[first] - radii[second]


def count_contacts(gaps: np.ndarray) -> int:
    """Count how often a pair that did not overlap before begins to overlap.

    Args:
        gaps: Over time, from `gaps_between_samples`, shape (T, pairs) [m].
    """
    overlaps = gaps < 0.0
    return int(overlaps[:1].sum() + (overlaps[1:] & ~overlaps[:-1]).sum())


# Gaps along a path, for choosing among paths. A path is sampled, so a gap may be a little less
# between two samples. `collision_stop` is what guarantees that robots do not touch.

# Number of samples along a path.
SAMPLES = 9


def gap_to_runners(
    start: np.ndarray,
    end: np.ndarray,
    seconds: tuple[float, float],
    runners: np.ndarray,
    contacts: np.ndarray,
    top_speed: float,
) -> float:
    """Least gap on a path to robots that may move anywhere [m]; negative if they may be hit.

    Args:
        start, end: Of the path, shape (2,) [m].
        seconds: Times at which the robot starts and arrives [s].
        runners: Positions of the others at time 0, shape (m, 2) [m].
        contacts: Distance at which bodies touch, shape (m,) [m].
        top_speed: Of the others; 0 if they stand [m/s].
    """
    if len(runners) == 0:
        return np.inf
    parts = np.linspace(0.0, 1.0, SAMPLES)
    times = seconds[0] + parts * (seconds[1] - seconds[0])
    path = start + parts[:, None] * (end - start)
    apart = np.hypot(*(path[:, None] - runners).T)
    return float((apart - contacts[:, None] - top_speed * times).min())


def gap_to_paths(
    start: np.ndarray, end: np.ndarray, paths: np.ndarray, contacts: np.ndarray
) -> float:
    """Least gap between a path and the straight paths of others, regardless of timing [m].

    Args:
        start, end: Of the path, shape (2,) [m].
        paths: Starts and ends of the others, shape (k, 4) [m].
        contacts: Distance at which bodies touch, shape (k,) [m].
    """
    if len(paths) == 0:
        return np.inf
    points = start + np.linspace(0.0, 1.0, SAMPLES)[:, None] * (end - start)
    low, way = paths[:, :2], paths[:, 2:] - paths[:, :2]
    length = np.maximum((way**2).sum(axis=1), 1e-300)
    along = np.clip(((points[:, None] - low) * way).sum(axis=2) / length, 0.0, 1.0)
    apart = np.hypot(*(points[:, None] - low - along[:, :, None] * way).T)
    return float((apart - contacts[:, None]).min())


# A robot's waiting time grows below the first part of its desired speed, and is reset above the
# second.
WAITING, GOING = 0.1, 0.5

# After waiting this long a robot may have a turn [s].
PATIENCE = 0.6

# Length of a turn [s]: a wheeled robot turns about in one second, and then leaves.
TURN_LENGTH = 1.5

# Teammates with a smaller gap hold each other up, in parts of the distance at which they touch.
HOLDS_UP = 0.15


@compiled
def still_waiting(
    waiting: np.ndarray,
    before: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    period: float,
) -> np.ndarray:
    """For how long each robot has been kept from moving as desired.

    Args:
        waiting: Waiting times at the last sample, shape (n,) [s].
        before, positions: Positions at the last sample and now, shape (2 n,) [m].
        velocities: Desired, shape (2 n,) [m/s].
        period: Between samples [s].

    Returns:
        Shape (n,) [s]; zero for a robot that makes progress, or has a desired speed of zero.
    """
    longer = np.zeros(len(waiting))
    for i in range(len(waiting)):
        dx, dy = positions[2 * i] - before[2 * i], positions[2 * i + 1] - before[2 * i + 1]
        moved = math.sqrt(dx * dx + dy * dy) / period
        wish = math.sqrt(velocities[2 * i] ** 2 + velocities[2 * i + 1] ** 2)
        if moved < WAITING * wish:
            longer[i] = waiting[i] + period
        elif moved < GOING * wish:
            longer[i] = waiting[i]
    return longer


@compiled
def take_turns(
    turns: np.ndarray,
    waiting: np.ndarray,
    positions: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    period: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Whose turn it is among teammates that hold each other up.

    Args:
        turns: Time left of each robot's turn at the last sample, shape (n,) [s].
        waiting: For how long each has waited, from `still_waiting`, shape (n,) [s].
        positions: Of the team, shape (2 n,) [m].
        radii: Of the team, shape (n,) [m].
        others: Positions of the robots of the other team, shape (2 m,) [m].
        period: Between samples [s].

    Returns:
        The turns now, one in each group of teammates at a time, and the waiting times, zero for
        those whose turn it is; shapes (n,) [s].
    """
    count = len(turns)
    left, waited = np.maximum(turns - period, 0.0), waiting.copy()
    # A remainder of less than half a period is a rounding error.
    left[left < 0.5 * period] = 0.0
    if waited.max() >= PATIENCE:
        group, nearest = _groups(positions, radii), _nearness(positions, others)
        going = left > 0.0
        for i in range(count):
            first = waited[i] >= PATIENCE
            for j in range(count):
                if j != i and group[j] == group[i]:
                    before = waiting[j] > waiting[i] or (
                        waiting[j] == waiting[i]
                        and (nearest[j] < nearest[i] or (nearest[j] == nearest[i] and j < i))
                    )
                    first = first and not going[j] and not before
            if first and not going[i]:
                left[i] = TURN_LENGTH
    waited[left > 0.0] = 0.0
    return left, waited


@compiled
def _groups(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """A label for each robot, equal for robots connected by a chain of small gaps, shape (n,)."""
    count = len(radii)
    group = np.arange(count)
    for i in range(count):
        for j in range(i):
            dx = positions[2 * i] - positions[2 * j]
            dy = positions[2 * i + 1] - positions[2 * j + 1]
            reach = (1.0 + HOLDS_UP) * (radii[i] + radii[j])
            if dx * dx + dy * dy < reach * reach:
                joined, label = group[i], group[j]
                for k in range(count):
                    if group[k] == joined:
                        group[k] = label
    return group


@compiled
def _nearness(positions: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Squared distance of each robot from the nearest of the other team, shape (n,) [m^2]."""
    count = len(positions) // 2
    nearest = np.full(count, np.inf)
    # Without another team, the robot farthest from the middle of its team goes first.
    if len(others) == 0:
        for i in range(count):
            dx = positions[2 * i] - positions[::2].mean()
            dy = positions[2 * i + 1] - positions[1::2].mean()
            nearest[i] = -(dx * dx + dy * dy)
    for i in range(count):
        for j in range(len(others) // 2):
            dx = positions[2 * i] - others[2 * j]
            dy = positions[2 * i + 1] - others[2 * j + 1]
            nearest[i] = min(nearest[i], dx * dx + dy * dy)
    return nearest
