"""Whether machines moved as machines can: accelerations, turns, jumps, and what they say of speed.

All is taken from poses. The mean velocity between two samples is the way of the constant twist by
the time, and the acceleration the difference of two such by the time from the middle of the one to
the middle of the other: the mean of what it really was, and never more than its greatest.
"""

import math
from typing import NamedTuple

import numpy as np

from .faults import AuditFault, faults_where
from .harvest_log import HarvestLog, Machine, Site
from .twists import continuous

# Samples may be so far apart [s].
PERIOD = 0.5

# Beyond these a pose has jumped: tyres on soil hold half of g, and nothing on a field is faster, or
# turns so fast [m/s^2], [m/s], [rad/s].
JUMP_ACCELERATION, JUMP_SPEED, JUMP_RATE = 5.0, 30.0, 1.5

# What is stated may be exceeded so much where a sample falls between two pieces of a path: as a
# part, [m/s^2], [rad], across the heading [m].
PART, SLACK_ACCELERATION, SLACK_TURN, SLACK_ACROSS = 0.02, 0.05, 0.02, 0.01

# Between the speed that is logged and that of the poses, beyond what half a period's acceleration
# changes [m/s].
SLACK_SPEED = 0.1

# Of a combine whose acceleration is not stated, to judge its logged speed by [m/s^2].
USUAL_ACCELERATION = 1.0

# A trailer's hitch may be off where it is on all other poses [m].
SLACK_HITCH = 0.05


class Motion(NamedTuple):
    """How a machine moved between each two samples.

    Attributes:
        speed: Along the mean heading, negative backwards, shape (T - 1,) [m/s].
        across: Way to the left of the mean heading, shape (T - 1,) [m].
        turn: Shape (T - 1,) [rad].
        along_acceleration: At the samples between, 0 at both ends, shape (T,) [m/s^2].
        across_acceleration: Speed by turn rate, shape (T - 1,) [m/s^2].
        jolt: Of the velocity as a vector, at the samples, 0 at both ends, shape (T,) [m/s^2].
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
    # Of a twist along a circle the chord has the mean heading, and the way is longer by this.
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

    The hitch is a length behind the tractor's axle and another before the trailer's. Both are
    taken as those that fit at most samples: by least squares, and again without the worst tenth.
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
    """Greatest accelerations of combines and carts, and whatever moved as it cannot.

    Returns:
        Figures by name, None where there is no such machine, and faults.
    """
    time = log.time
    faults = faults_where(
        "samples too far apart",
        (),
        np.diff(time),
        PERIOD * (1 + 1e-6),
        "s",
        time,
        lambda k: float(time[k]),
    )
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
        faults += faults_where(
            "trailer off its hitch", (f"cart {k}",), off, SLACK_HITCH, "m", time, _at(time)
        )
    figures = {
        "combine_acceleration": _greatest([each.along_acceleration for each in combines]),
        "combine_lateral_acceleration": _greatest([each.across_acceleration for each in combines]),
        "cart_acceleration": _greatest([each.along_acceleration for each in carts]),
        "cart_lateral_acceleration": _greatest([each.across_acceleration for each in carts]),
    }
    return figures, faults


def _greatest(arrays: list[np.ndarray]) -> float | None:
    return max((float(np.abs(each).max()) for each in arrays), default=None)


def _at(time: np.ndarray):
    return lambda k: float(time[k])


def _of_samples(values: np.ndarray) -> np.ndarray:
    """For each interval the greater of the values at its two samples, shape (T,) -> (T - 1,)."""
    return np.maximum(np.abs(values[:-1]), np.abs(values[1:]))


def _jumps(
    name: str, which: str, motion: Motion, across: float, time: np.ndarray
) -> list[AuditFault]:
    """What no machine can do.

    Args:
        name: Of the machine.
        which: "trailer " of one, else nothing.
        motion: Of its axle.
        across: Its greatest acceleration across [m/s^2].
        time: Of the samples, shape (T,) [s].
    """
    lasts, at, who = np.diff(time), _at(time), (name,)
    jolts = _of_samples(motion.jolt)
    speeds, rates = np.abs(motion.speed), np.abs(motion.turn) / lasts
    # From one bend into the opposite one amid two samples, the axle ends beside the mean heading by
    # v^2 dt^2 / 4 R.
    beside = across * lasts**2 / 4 + SLACK_ACROSS
    return [
        *faults_where(f"{which}pose jumps", who, jolts, JUMP_ACCELERATION, "m/s^2", time, at),
        *faults_where(f"{which}speed", who, speeds, JUMP_SPEED, "m/s", time, at),
        *faults_where(f"{which}turn rate", who, rates, JUMP_RATE, "rad/s", time, at),
        *faults_where(f"{which}moves sideways", who, np.abs(motion.across), beside, "m", time, at),
    ]


def _limits(name: str, motion: Motion, machine: Machine, time: np.ndarray) -> list[AuditFault]:
    lasts, at, who = np.diff(time), _at(time), (name,)
    lateral = min(machine.lateral_acceleration, JUMP_ACCELERATION)
    faults = _jumps(name, "", motion, lateral, time)
    along = _of_samples(motion.along_acceleration)
    for kind, amounts, limit in (
        ("acceleration along", along, machine.acceleration),
        ("acceleration across", np.abs(motion.across_acceleration), machine.lateral_acceleration),
    ):
        if math.isfinite(limit):
            most = limit * (1 + PART) + SLACK_ACCELERATION
            faults += faults_where(kind, who, amounts, most, "m/s^2", time, at)
    if machine.turning_radius > 0:
        # Where the gear changes amid two samples the ways cancel, but the turns add up.
        speeds = np.abs(motion.speed)
        padded = np.concatenate([[0.0], speeds, [0.0]])
        fastest = np.maximum(np.maximum(padded[:-2], padded[2:]), speeds)
        most = fastest * lasts / machine.turning_radius * (1 + PART) + SLACK_TURN
        faults += faults_where("turn", who, np.abs(motion.turn), most, "rad", time, at)
    return faults


def _logged_speed(
    name: str, motion: Motion, machine: Machine, logged: np.ndarray, time: np.ndarray
) -> list[AuditFault]:
    lasts = np.diff(time)
    said = (np.abs(logged[:-1]) + np.abs(logged[1:])) / 2
    usual = machine.acceleration if math.isfinite(machine.acceleration) else USUAL_ACCELERATION
    off = np.abs(said - np.abs(motion.speed))
    most = SLACK_SPEED + usual * lasts / 2
    return faults_where("speed differs from poses", (name,), off, most, "m/s", time, _at(time))
