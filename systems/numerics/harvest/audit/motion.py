"""Machines in motion: constant twists between samples, and whether machines can move like that.

Accelerations, turns and jumps are all computed from poses, and the logged speed is checked against
them. The mean velocity between two samples is the way of the constant twist divided by the time.
The acceleration is the difference of two such velocities divided by the time between the middles of
their intervals: a mean of the real acceleration, and so never more than its maximum.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from .harvest_log import AuditFault, HarvestLog, Machine, Site, faults_where

# Longest time between two samples [s].
PERIOD = 0.5

# Beyond these a pose has jumped: tyres on soil hold half of g, and nothing on a field is faster, or
# turns so fast [m/s^2], [m/s], [rad/s].
JUMP_ACCELERATION, JUMP_SPEED, JUMP_RATE = 5.0, 30.0, 1.5

# By how much stated limits may be exceeded where a sample falls between two pieces of a path:
# relative [-], [m/s^2], [rad], across the heading [m].
PART, SLACK_ACCELERATION, SLACK_TURN, SLACK_ACROSS = 0.02, 0.05, 0.02, 0.01

# Tolerance between the logged speed and that of the poses, beyond what acceleration can change in
# half a period [m/s].
SLACK_SPEED = 0.1

# Acceleration assumed for a combine that states none, to judge its logged speed by [m/s^2].
USUAL_ACCELERATION = 1.0

# How far a trailer may be from where its hitch holds it [m].
SLACK_HITCH = 0.05


@dataclass(frozen=True, eq=False)
class MovingOutline:
    """A polygon that moves with a machine.

    Points and poses refer to the middle of the points' bounding box. They may, since a constant
    twist of a machine is the same twist for every frame that is fixed to it.

    Attributes:
        machine: Whose outline it is, as "combine 0".
        points: Corners, counterclockwise, shape (m, 2) [m].
        poses: x, y, theta at the samples, theta continuous, shape (T, 3) [m], [m], [rad].
        reach: Distance of the farthest corner from the middle [m].
    """

    machine: str
    points: np.ndarray
    poses: np.ndarray
    reach: float


def continuous(poses: np.ndarray) -> np.ndarray:
    """Poses with unwrapped headings, which turn the shorter way each time, shape (T, 3)."""
    return np.column_stack([poses[:, :2], np.unwrap(poses[:, 2])])


def moving_outline(machine: str, points: np.ndarray, poses: np.ndarray) -> MovingOutline:
    """An outline that moves with a machine, in a frame at the outline's own middle.

    Args:
        machine: Whose it is.
        points: Corners in the frame of the machine's pose, shape (m, 2) [m].
        poses: Of the machine at the samples, shape (T, 3).
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    x, y, theta = continuous(poses).T
    c, s = np.cos(theta), np.sin(theta)
    at = [x + c * middle[0] - s * middle[1], y + s * middle[0] + c * middle[1], theta]
    inner = np.ascontiguousarray(points - middle)
    return MovingOutline(machine, inner, np.column_stack(at), float(np.hypot(*inner.T).max()))


def machines_in_motion(log: HarvestLog, site: Site) -> dict[str, list[MovingOutline]]:
    """The outlines of every machine by its name, combines first."""
    moving: dict[str, list[MovingOutline]] = {}

    def add(name: str, machine: Machine, front: np.ndarray, rear: np.ndarray) -> None:
        moving[name] = [
            moving_outline(name, machine.front, front),
            moving_outline(name, machine.rear, rear),
        ]

    for n, combine in enumerate(site.combines):
        add(f"combine {n}", combine, log.combine_pose[:, n], log.combine_pose[:, n])
    for k, cart in enumerate(site.carts):
        add(f"cart {k}", cart, log.tractor_pose[:, k], log.trailer_pose[:, k])
    return moving


def poses_between(poses: np.ndarray, number: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Poses between samples.

    Args:
        poses: At the samples, with continuous headings, shape (T, 3).
        number: Of the sample before, below T - 1, shape (n,).
        share: Of the time to the next sample that has passed, in [0, 1], shape (n,).

    Returns:
        Shape (n, 3).
    """
    begin, step = poses[number], poses[number + 1] - poses[number]
    half = step[:, 2] / 2
    way = np.hypot(step[:, 0], step[:, 1]) / np.sinc(half / np.pi)
    # The chord of the first part of an arc leans less than the chord of the whole.
    direction = np.arctan2(step[:, 1], step[:, 0]) - half * (1 - share)
    chord = way * share * np.sinc(half * share / np.pi)
    moved = np.column_stack([chord * np.cos(direction), chord * np.sin(direction)])
    return np.column_stack([begin[:, :2] + moved, begin[:, 2] + 2 * half * share])


def polygons_at(outline: MovingOutline, number: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Shapely polygons of an outline between samples, shape (n,).

    Args:
        outline: In motion.
        number: Of the sample before, below T - 1, shape (n,).
        share: Of the time to the next sample that has passed, in [0, 1], shape (n,).
    """
    x, y, theta = poses_between(outline.poses, number, share).T
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    px, py = outline.points.T
    corners = np.stack([x[:, None] + c * px - s * py, y[:, None] + s * px + c * py], axis=-1)
    return np.asarray(shapely.polygons(corners))


class Motion(NamedTuple):
    """How a machine moved between each two samples.

    Attributes:
        speed: Along the mean heading, negative backwards, shape (T - 1,) [m/s].
        across: Way to the left of the mean heading, shape (T - 1,) [m].
        turn: Shape (T - 1,) [rad].
        along_acceleration: At the samples between, 0 at both ends, shape (T,) [m/s^2].
        across_acceleration: Speed times turn rate, shape (T - 1,) [m/s^2].
        jolt: Size of the velocity vector's change per time, at the samples, 0 at both ends, shape
            (T,) [m/s^2].
    """

    speed: np.ndarray
    across: np.ndarray
    turn: np.ndarray
    along_acceleration: np.ndarray
    across_acceleration: np.ndarray
    jolt: np.ndarray


def motion_of(poses: np.ndarray, time: np.ndarray) -> Motion:
    """How a machine moved, by its poses, shape (T, 3), at times, shape (T,)."""
    steps, lasts = np.diff(continuous(poses), axis=0), np.diff(time)
    turn = steps[:, 2]
    middle = poses[:-1, 2] + turn / 2
    c, s = np.cos(middle), np.sin(middle)
    # The chord of a twist along a circle has the mean heading; the arc is longer by this factor.
    along = (steps[:, 0] * c + steps[:, 1] * s) / np.sinc(turn / (2 * np.pi))
    speed = along / lasts
    apart = (lasts[1:] + lasts[:-1]) / 2
    velocity = steps[:, :2] / lasts[:, None]
    jolt = np.hypot(*np.diff(velocity, axis=0).T) / apart
    return Motion(
        speed,
        steps[:, 1] * c - steps[:, 0] * s,
        turn,
        np.concatenate([[0.0], np.diff(speed) / apart, [0.0]]),
        speed * turn / lasts,
        np.concatenate([[0.0], jolt, [0.0]]),
    )


def hitch_errors(tractor: np.ndarray, trailer: np.ndarray) -> np.ndarray:
    """How far a trailer is from where its hitch holds it, shape (T, 3) twice -> (T,) [m].

    The hitch is one length behind the tractor's axle and another ahead of the trailer's. Both are
    fitted to most of the samples: by least squares, and again without the worst tenth.
    """
    apart = tractor[:, :2] - trailer[:, :2]
    ahead = [np.column_stack([np.cos(p[:, 2]), np.sin(p[:, 2])]) for p in (tractor, trailer)]
    columns = np.stack(ahead, axis=2)
    kept = np.ones(len(apart), dtype=bool)
    errors = np.zeros(len(apart))
    for _ in range(3):
        lengths = np.linalg.lstsq(columns[kept].reshape(-1, 2), apart[kept].ravel(), rcond=None)[0]
        errors = np.hypot(*(apart - columns @ lengths).T)
        kept = errors <= np.quantile(errors, 0.9)
    return errors


def motion_faults(log: HarvestLog, site: Site) -> tuple[dict[str, float | None], list[AuditFault]]:
    """Greatest accelerations of combines and carts, and faults where one moves as it cannot.

    Returns:
        Figures by name, None where there is no such machine, and faults.
    """
    time = log.time
    longest = PERIOD * (1 + 1e-6)
    faults = faults_where("samples too far apart", (), np.diff(time), longest, "s", time)
    combines, carts = [], []
    for n, machine in enumerate(site.combines):
        motion = motion_of(log.combine_pose[:, n], time)
        combines.append(motion)
        faults += _limits(f"combine {n}", motion, machine, time)
        faults += _logged_speed(f"combine {n}", motion, machine, log.combine_speed[:, n], time)
    for k, machine in enumerate(site.carts):
        motion = motion_of(log.tractor_pose[:, k], time)
        carts.append(motion)
        faults += _limits(f"cart {k}", motion, machine, time)
        trailer = motion_of(log.trailer_pose[:, k], time)
        faults += _jumps(f"cart {k}", "trailer ", trailer, JUMP_ACCELERATION, time)
        errors = hitch_errors(log.tractor_pose[:, k], log.trailer_pose[:, k])
        off = np.maximum(errors[:-1], errors[1:])
        faults += faults_where("trailer off its hitch", (f"cart {k}",), off, SLACK_HITCH, "m", time)
    figures = {
        "combine_acceleration": _greatest([each.along_acceleration for each in combines]),
        "combine_lateral_acceleration": _greatest([each.across_acceleration for each in combines]),
        "cart_acceleration": _greatest([each.along_acceleration for each in carts]),
        "cart_lateral_acceleration": _greatest([each.across_acceleration for each in carts]),
    }
    return figures, faults


def _greatest(arrays: list[np.ndarray]) -> float | None:
    return max((float(np.abs(each).max()) for each in arrays), default=None)


def _of_samples(values: np.ndarray) -> np.ndarray:
    """For each interval the greater of the values at its two samples, shape (T,) -> (T - 1,)."""
    return np.maximum(np.abs(values[:-1]), np.abs(values[1:]))


def _jumps(
    name: str, which: str, motion: Motion, across: float, time: np.ndarray
) -> list[AuditFault]:
    """Faults where a machine moves as no machine can.

    Args:
        name: Of the machine.
        which: "trailer " for a trailer, else empty.
        motion: Of its axle.
        across: Its greatest acceleration across [m/s^2].
        time: Of the samples, shape (T,) [s].
    """
    lasts, who = np.diff(time), (name,)
    jolts = _of_samples(motion.jolt)
    speeds, rates = np.abs(motion.speed), np.abs(motion.turn) / lasts
    # If one bend changes into the opposite one between two samples, the axle ends beside the mean
    # heading by v^2 dt^2 / 4 R.
    beside = across * lasts**2 / 4 + SLACK_ACROSS
    return [
        *faults_where(f"{which}pose jumps", who, jolts, JUMP_ACCELERATION, "m/s^2", time),
        *faults_where(f"{which}speed", who, speeds, JUMP_SPEED, "m/s", time),
        *faults_where(f"{which}turn rate", who, rates, JUMP_RATE, "rad/s", time),
        *faults_where(f"{which}moves sideways", who, np.abs(motion.across), beside, "m", time),
    ]


def _limits(name: str, motion: Motion, machine: Machine, time: np.ndarray) -> list[AuditFault]:
    lasts, who = np.diff(time), (name,)
    lateral = min(machine.lateral_acceleration, JUMP_ACCELERATION)
    faults = _jumps(name, "", motion, lateral, time)
    along = _of_samples(motion.along_acceleration)
    for kind, amounts, limit in (
        ("acceleration along", along, machine.acceleration),
        ("acceleration across", np.abs(motion.across_acceleration), machine.lateral_acceleration),
    ):
        if math.isfinite(limit):
            most = limit * (1 + PART) + SLACK_ACCELERATION
            faults += faults_where(kind, who, amounts, most, "m/s^2", time)
    if machine.turning_radius > 0:
        # If the gear changes between two samples, the ways cancel but the turns add up.
        speeds = np.abs(motion.speed)
        padded = np.concatenate([[0.0], speeds, [0.0]])
        fastest = np.maximum(np.maximum(padded[:-2], padded[2:]), speeds)
        most = fastest * lasts / machine.turning_radius * (1 + PART) + SLACK_TURN
        faults += faults_where("turn", who, np.abs(motion.turn), most, "rad", time)
    return faults


def _logged_speed(
    name: str, motion: Motion, machine: Machine, logged: np.ndarray, time: np.ndarray
) -> list[AuditFault]:
    lasts = np.diff(time)
    said = (np.abs(logged[:-1]) + np.abs(logged[1:])) / 2
    usual = machine.acceleration if math.isfinite(machine.acceleration) else USUAL_ACCELERATION
    off = np.abs(said - np.abs(motion.speed))
    most = SLACK_SPEED + usual * lasts / 2
    return faults_where("speed differs from poses", (name,), off, most, "m/s", time)
