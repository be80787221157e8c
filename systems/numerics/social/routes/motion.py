"""How robots in the maze drive by their infrared sensors: wandering, following, keeping apart.

Common agents wander: straight on until something is near, then turn, and on. "we let them move
forward in every time instant till obstacle is met", "estimate the relative location of the obstacle
... and let common agent turn before collision" (Zhang 2014, 2.3.4.3). How far they turn is ours: by
a random angle, and farther until the way is free.

The pursuer follows a route, and leaves it for a while where a robot is in the way. It knows its
pose and the map, so it knows what its sensors ought to say of the walls. A range that is shorter
than that is another robot: the pursuer takes the direction nearest to its own that avoids it and
stays in the free region, and comes back to the route behind it ("deviate from original path based
on the measurements of sensors"; the law is ours).

A guard keeps robots that sense each other from touching. One that drives a distance s at an angle a
from the direction to another closes the gap between them by at most s cos(a). So each may close
half of the gap, and both together close it at most entirely. A robot that only drives forwards and
senses its whole front closes no gap that it does not sense. This guard is ours too.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...checked import Checked, NonNegative, Positive
from ...compiled import compiled
from ...errors import require
from ...geometry.edge_index import EdgeIndex, point_is_free
from ...geometry.segment_sight import segment_is_clear
from .infrared import InfraredRing


@dataclass(frozen=True, kw_only=True)
class WanderingLaw(Checked):
    """What an agent does about what it feels.

    Attributes:
        speed: Straight on [m/s].
        turn_rate: On the spot [rad/s].
        turn_range: A range ahead at which it stops and turns [m].
        least_turn, greatest_turn: Between which the angle of a turn is drawn [rad].
        centring: Curvature of its way per difference of the outer ranges [rad/m^2].

    Raises:
        InvalidInput: A number is out of its range.
    """

    speed: Positive = 0.1
    turn_rate: Positive = 1.0
    turn_range: Positive = 0.1
    least_turn: Positive = math.radians(40)
    greatest_turn: float = math.radians(150)
    centring: Positive = 20.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            self.greatest_turn >= self.least_turn,
            "greatest_turn",
            f"be at least least_turn, {self.least_turn:g} rad",
            self.greatest_turn,
        )


def wander(
    law: WanderingLaw,
    ring: InfraredRing,
    turns: np.ndarray,
    ranges: np.ndarray,
    draws: np.ndarray,
    period: float,
) -> tuple[np.ndarray, np.ndarray]:
    """One period of every agent.

    Args:
        law: Parameters.
        ring: The sensors.
        turns: Remaining turn of each agent, left positive, shape (n,) [rad]; 0: straight on.
        ranges: Infrared ranges, shape (n, sensors) [m].
        draws: A random number from [0, 1) for each agent, shape (n,).
        period: For how long commands are held [s].

    Returns:
        What is left to turn after the period, shape (n,) [rad], and speed and turn rate for the
        period, shape (n, 2) [m/s], [rad/s].
    """
    bearings = np.array(ring.bearings)
    ahead = ranges[:, np.abs(bearings) < math.radians(45)].min(axis=1, initial=ring.reach)
    left = ranges[:, bearings > 0].sum(axis=1)
    right = ranges[:, bearings < 0].sum(axis=1)
    blocked = ahead < law.turn_range
    # Where both sides are alike the draw decides, too.
    side = np.where(
        left > right, 1.0, np.where(left < right, -1.0, np.where(draws < 0.5, -1.0, 1.0))
    )
    drawn = law.least_turn + draws * (law.greatest_turn - law.least_turn)
    # A turn keeps its direction; if the way is still blocked when it ends, it is prolonged.
    turns = np.where(blocked & (turns == 0.0), side * drawn, turns)
    step = law.turn_rate * period
    rates = np.clip(turns, -step, step) / period
    rest = turns - rates * period
    rest = np.where((rest == 0.0) & (turns != 0.0) & blocked, np.sign(turns) * step, rest)
    moving = turns == 0.0
    outer = law.speed * law.centring * (ranges[:, 0] - ranges[:, -1])
    rates = np.where(moving, np.clip(outer, -law.turn_rate, law.turn_rate), rates)
    return rest, np.column_stack([np.where(moving, law.speed, 0.0), rates])


# Number of directions tried all round the robot, and how far one must be free [m].
_DIRECTIONS, _PROBE = 72, 0.12
# A range is unexplained if it is shorter than the map's by this [m].
_SURPRISE = 0.02
# What it costs to change the side on which robots are passed [rad].
_CHANGE = math.radians(60)


@dataclass(frozen=True, kw_only=True)
class FollowingLaw(Checked):
    """How the pursuer goes along its route.

    Attributes:
        speed: [m/s].
        turn_rate: Greatest [rad/s].
        gain: Turn rate per heading error [1/s].
        lookahead: How far along the route it aims [m].
        stand_off: What is left of the route where it stops [m].
        wary_range: A robot nearer than that is avoided, from rim to rim [m].
        passing_gap: What is left between the rims when passing [m].

    Raises:
        InvalidInput: A number is out of its range.
    """

    speed: Positive = 0.2
    turn_rate: Positive = 2.0
    gain: Positive = 4.0
    lookahead: Positive = 0.12
    stand_off: NonNegative = 0.35
    wary_range: Positive = 0.18
    passing_gap: NonNegative = 0.03


@dataclass(frozen=True, eq=False)
class Progress:
    """Where a robot is along a route, shape (m, 2) [m].

    Attributes:
        arc: Arc length at the route's point nearest to the robot, never less than before [m].
        rest: Length from there to the end of the route [m].
        aim: Point to drive to now, shape (2,) [m].
        in_sight: Whether the straight way to `aim` is free.
    """

    arc: float
    rest: float
    aim: np.ndarray
    in_sight: bool


def progress_along(
    index: EdgeIndex, route: np.ndarray, position: np.ndarray, arc: float, lookahead: float
) -> Progress:
    """Find a robot's place along a route, and what to aim at.

    Args:
        index: Edges of the free region.
        route: Corners, shape (m, 2), m >= 1 [m].
        position: Of the robot, shape (2,) [m].
        arc: Where it was along the route [m].
        lookahead: How far beyond its place it aims; less if that point is out of sight [m].
    """
    starts, steps = route[:-1], np.diff(route, axis=0)
    lengths = np.hypot(*steps.T)
    before = np.concatenate([[0.0], np.cumsum(lengths)])
    nearest, place = math.inf, float(before[-1])
    for k in np.flatnonzero((lengths > 0) & (before[1:] >= arc)):
        t = float(np.dot(position - starts[k], steps[k])) / lengths[k] ** 2
        t = min(max(t, (arc - before[k]) / lengths[k], 0.0), 1.0)
        distance = float(np.hypot(*(starts[k] + t * steps[k] - position)))
        if distance < nearest:
            nearest, place = distance, float(before[k] + t * lengths[k])
    rest = float(before[-1]) - place
    aim = point_at(route, place)
    for share in (1.0, 0.75, 0.5, 0.25, 0.0):
        aim = point_at(route, place + share * lookahead)
        if segment_is_clear(index, *map(float, position), *map(float, aim)):
            return Progress(place, rest, aim, True)
    return Progress(place, rest, aim, False)


def point_at(route: np.ndarray, arc: float) -> np.ndarray:
    """The point of a route, shape (m, 2), at an arc length from its start, its ends beyond [m]."""
    lengths = np.hypot(*np.diff(route, axis=0).T)
    before = np.concatenate([[0.0], np.cumsum(lengths)])
    return np.array([np.interp(arc, before, route[:, 0]), np.interp(arc, before, route[:, 1])])


def deviation(
    law: FollowingLaw,
    ring: InfraredRing,
    index: EdgeIndex,
    pose: np.ndarray,
    wish: float,
    ranges: np.ndarray,
    expected: np.ndarray,
    radius: float,
    side: float,
) -> tuple[float | None, float]:
    """Find the direction nearest to the wanted one that avoids robots and walls.

    Args:
        law: Parameters.
        ring: The sensors.
        index: Edges of the free region.
        pose: Of the robot, shape (3,) [m], [m], [rad].
        wish: Direction in which it would go [rad].
        ranges: What its sensors say, shape (sensors,) [m].
        expected: What they would say of the walls alone, shape (sensors,) [m].
        radius: Of every robot [m].
        side: Side of the wanted direction to which it last turned, as a number: 1 left, -1 right,
            0 neither.

    Returns:
        The direction [rad], None if there is none, and its side.
    """
    surprising = (ranges < law.wary_range) & (ranges < expected - _SURPRISE)
    if not surprising.any():
        return wish, 0.0
    x, y, heading = map(float, pose)
    offsets = np.linspace(-math.pi, math.pi, _DIRECTIONS, endpoint=False)
    costs = np.abs(offsets) + np.where(offsets * side < 0, _CHANGE, 0.0)
    for k in np.argsort(costs, kind="stable"):
        direction = wish + float(offsets[k])
        blocked = False
        for sensor in np.flatnonzero(surprising):
            between = math.remainder(direction - heading - ring.bearings[sensor], 2 * math.pi)
            distance = float(ranges[sensor]) + 2 * radius
            spread = math.asin(min((2 * radius + law.passing_gap) / distance, 1.0))
            blocked = blocked or abs(between) < spread
        ahead = x + _PROBE * math.cos(direction), y + _PROBE * math.sin(direction)
        free = segment_is_clear(index, x, y, *ahead) or not point_is_free(index, x, y)
        if free and not blocked:
            return direction, float(np.sign(offsets[k]))
    return None, side


def drive_towards(law: FollowingLaw, heading: float, direction: float | None) -> np.ndarray:
    """Speed and turn rate, shape (2,) [m/s], [rad/s]: turn, and drive by the part that is ahead.

    Without a direction the robot waits.

    Args:
        law: Parameters.
        heading: Of the robot [rad].
        direction: Where to [rad].
    """
    if direction is None:
        return np.zeros(2)
    error = math.remainder(direction - heading, 2 * math.pi)
    rate = min(max(law.gain * error, -law.turn_rate), law.turn_rate)
    return np.array([law.speed * max(math.cos(error), 0.0) ** 2, rate])


@compiled
def guarded_commands(
    commands: np.ndarray,
    ranges: np.ndarray,
    bearings: np.ndarray,
    half: float,
    margin: float,
    period: float,
) -> np.ndarray:
    """Reduce the speeds of commands so that no two robots touch within a period.

    Args:
        commands: Speed and turn rate of each robot, shape (n, 2) [m/s], [rad/s]; speeds below
            zero become zero.
        ranges: Of each robot's sensors, from the rim, shape (n, sensors) [m].
        bearings: Of the sensors, shape (sensors,) [rad].
        half: Half of a cone's angle [rad].
        margin: Gap that is left between robots [m].
        period: For how long a command is held, along a straight chord [s].

    Returns:
        Shape (n, 2); turn rates are kept.
    """
    safe = commands.copy()
    for i in range(len(commands)):
        speed = max(commands[i, 0], 0.0)
        # The chord driven in a period deviates from the heading by half of the turn.
        turned = abs(0.5 * period * commands[i, 1])
        for k in range(len(bearings)):
            beside = max(abs(bearings[k]) - half - turned, 0.0)
            closing = np.cos(min(beside, np.pi))
            if closing > 0.0:
                room = max(0.5 * (ranges[i, k] - margin), 0.0)
                speed = min(speed, room / (closing * period))
        safe[i, 0] = speed
    return safe
