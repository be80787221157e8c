"""Moving machines as boxes sampled in time, and how near a box comes to them."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ..machines import Cart, CombineSize, cart_outline, combine_outline
from ..paths import TimedPath
from .cart_motion import CartMotion, poses_along

# Time between samples [s].
SAMPLE = 0.25


class Traffic(NamedTuple):
    """Moving boxes, sampled at equal time steps; after the last sample they stand still.

    Attributes:
        boxes: Rear, front and half width of each in the frame of its pose, shape (B, 3) [m].
        poses: x, y, theta, shape (B, T, 3) [m], [m], [rad].
        middles: x, y of the middle of each box, shape (B, T, 2) [m].
        sway: Half of the farthest that a corner moves to a neighbouring sample, shape (B, T) [m].
        quickest: Highest speed of the middle of each box, shape (B,) [m/s].
        machine: Number of the machine that each belongs to: combines first, then carts; (B,).
        begin: Time of the first sample [s].
    """

    boxes: np.ndarray
    poses: np.ndarray
    middles: np.ndarray
    sway: np.ndarray
    quickest: np.ndarray
    machine: np.ndarray
    begin: float


def box_of(corners: np.ndarray) -> np.ndarray:
    """Rear, front and half width of a box that is symmetric about its x axis, shape (3,) [m].

    Args:
        corners: Corners of the box, shape (4, 2) [m].
    """
    return np.array([corners[:, 0].min(), corners[:, 0].max(), corners[:, 1].max()])


def cart_boxes(cart: Cart) -> np.ndarray:
    """Boxes of the tractor and of the trailer, shape (2, 3) [m]."""
    return np.array([box_of(corners) for corners in cart_outline(cart)])


def combine_traffic(
    combine: CombineSize,
    plans: Sequence[TimedPath],
    before: Traffic | None = None,
    since: float = 0.0,
) -> Traffic:
    """Traffic of the combines, header and body each, from time 0 until the last one has stopped.

    Args:
        combine: The size of the combines.
        plans: Of all combines.
        before: Traffic of earlier plans that are the same until `since`; it is reused until then.
        since: The time until which the plans are the same [s].
    """
    boxes = [box_of(corners) for corners in combine_outline(combine)]
    end = max((plan.end for plan in plans), default=0.0)
    count = len(np.arange(0.0, end + 2 * SAMPLE, SAMPLE))
    # The last sample that is kept is computed again: the sway of the first new one depends on it.
    kept = 0
    if before is not None:
        kept = min(max(int(since / SAMPLE) - 2, 0), before.poses.shape[1] - 1, count - 1)
    first = max(kept - 1, 0)
    times = SAMPLE * np.arange(first, count)
    poses = [plan.pose_at(times) for plan in plans]
    later = _traffic(
        [box for _ in plans for box in boxes],
        [each for each in poses for _ in boxes],
        [number for number in range(len(plans)) for _ in boxes],
    )
    if before is None or kept == 0:
        return later
    return later._replace(
        poses=np.hstack([before.poses[:, :kept], later.poses[:, kept - first :]]),
        middles=np.hstack([before.middles[:, :kept], later.middles[:, kept - first :]]),
        sway=np.hstack([before.sway[:, :kept], later.sway[:, kept - first :]]),
        quickest=np.maximum(before.quickest, later.quickest),
    )


def cart_traffic(
    cart: Cart, motions: Sequence[Sequence[CartMotion]], first: int, begin: float = 0.0
) -> Traffic:
    """Traffic of carts, tractor and trailer each, from a moment until the last one has stopped.

    Args:
        cart: One of the equal carts.
        motions: Of each cart at least one, in order; between and after them it stands.
        first: Number of the first cart among all machines.
        begin: First moment, a multiple of the time between samples [s].
    """
    boxes = cart_boxes(cart)
    end = max((each[-1].timed.end for each in motions), default=0.0)
    times = np.arange(begin, max(begin, end) + 2 * SAMPLE, SAMPLE)
    poses = [each for one in motions for each in poses_along(one, times)]
    return _traffic(
        [box for _ in motions for box in boxes],
        poses,
        [first + number for number in range(len(motions)) for _ in boxes],
    )._replace(begin=begin)


def joined(first: Traffic, second: Traffic) -> Traffic:
    """Join two traffics that begin at the same time."""
    count = max(first.poses.shape[1], second.poses.shape[1])

    def filled(values: np.ndarray, last: bool) -> np.ndarray:
        missing = count - values.shape[1]
        pad = [(0, 0), (0, missing)] + [(0, 0)] * (values.ndim - 2)
        if last:
            return np.pad(values, pad, mode="edge")
        return np.pad(values, pad)

    return Traffic(
        np.concatenate([first.boxes, second.boxes]),
        np.concatenate([filled(first.poses, True), filled(second.poses, True)]),
        np.concatenate([filled(first.middles, True), filled(second.middles, True)]),
        np.concatenate([filled(first.sway, False), filled(second.sway, False)]),
        np.concatenate([first.quickest, second.quickest]),
        np.concatenate([first.machine, second.machine]),
        first.begin,
    )


def during(traffic: Traffic, begin: float, end: float) -> Traffic:
    """Cut a traffic to a span of time; before its first and after its last sample it stands.

    Args:
        traffic: The traffic.
        begin, end: Multiples of the time between samples [s].
    """
    first = round((begin - traffic.begin) / SAMPLE)
    count = round((end - begin) / SAMPLE) + 1
    known = traffic.poses.shape[1]
    at = np.clip(np.arange(first, first + count), 0, known - 1)
    # Unlike an index, `take` keeps the rows of a machine together in memory.
    return traffic._replace(
        poses=traffic.poses.take(at, axis=1),
        middles=traffic.middles.take(at, axis=1),
        sway=traffic.sway.take(at, axis=1),
        begin=begin,
    )


def without(traffic: Traffic, machine: int) -> Traffic:
    """A traffic without one machine."""
    kept = traffic.machine != machine
    columns = {name: getattr(traffic, name)[kept] for name in Traffic._fields if name != "begin"}
    return Traffic(begin=traffic.begin, **columns)


def _traffic(boxes: list, poses: list, machine: list) -> Traffic:
    sizes = np.array(boxes, dtype=float).reshape(-1, 3)
    places = np.array(poses) if boxes else np.zeros((0, 1, 3))
    x, y, theta = np.moveaxis(places, -1, 0)
    c, s = np.cos(theta), np.sin(theta)
    longest = np.zeros(x.shape)
    for end in (0, 1):
        for side in (1.0, -1.0):
            ahead, aside = sizes[:, end, None], side * sizes[:, 2, None]
            moved = np.hypot(
                np.diff(x + c * ahead - s * aside, axis=1),
                np.diff(y + s * ahead + c * aside, axis=1),
            )
            longest[:, 1:] = np.maximum(longest[:, 1:], moved)
            longest[:, :-1] = np.maximum(longest[:, :-1], moved)
    ahead = (sizes[:, 0] + sizes[:, 1])[:, None] / 2
    middles = np.stack([x + c * ahead, y + s * ahead], axis=-1)
    moved = np.hypot(*np.moveaxis(np.diff(middles, axis=1), -1, 0))
    quickest = moved.max(axis=1, initial=0.0) / SAMPLE
    numbers = np.array(machine, dtype=np.int64)
    return Traffic(sizes, places, middles, longest / 2, quickest, numbers, 0.0)


@kernel
def gap_between(first, pose, second, other):
    """Distance between two boxes; zero if they overlap [m].

    Args:
        first, second: Rear, front and half width of each, in the frame of its pose [m].
        pose, other: Their poses, shape (3,) [m], [m], [rad].
    """
    c0, s0, c1, s1 = math.cos(pose[2]), math.sin(pose[2]), math.cos(other[2]), math.sin(other[2])
    along, across = other[0] - pose[0], other[1] - pose[1]
    near, apart = np.inf, False
    for turn in range(2):
        # Corners of the one in the frame of the other.
        if turn == 0:
            a, b, ca, sa, cb, sb, dx, dy = first, second, c0, s0, c1, s1, along, across
        else:
            a, b, ca, sa, cb, sb, dx, dy = second, first, c1, s1, c0, s0, -along, -across
        px, py = ca * dx + sa * dy, ca * dy - sa * dx
        cr, sr = ca * cb + sa * sb, ca * sb - sa * cb
        low_x = low_y = np.inf
        high_x = high_y = -np.inf
        for k in range(4):
            ahead = b[1] if k % 2 else b[0]
            aside = b[2] if k // 2 else -b[2]
            x, y = px + cr * ahead - sr * aside, py + sr * ahead + cr * aside
            low_x, high_x = min(low_x, x), max(high_x, x)
            low_y, high_y = min(low_y, y), max(high_y, y)
            off_x = max(a[0] - x, x - a[1], 0.0)
            off_y = max(abs(y) - a[2], 0.0)
            near = min(near, math.sqrt(off_x * off_x + off_y * off_y))
        if low_x > a[1] or high_x < a[0] or low_y > a[2] or high_y < -a[2]:
            apart = True
    return near if apart else 0.0


@kernel
def _mark_blocked(traffic, boxes, first, second, gap, begin, step, blocked):
    """Mark the moments at which a standing cart would be too near to the traffic.

    Between two consecutive unmarked moments it is never too near either.

    Args:
        traffic: The other machines.
        boxes: Of tractor and trailer, shape (2, 3) [m].
        first, second: Poses of tractor and trailer, shape (3,).
        gap: Least distance; half of what the others move between two moments is added [m].
        begin: First moment [s].
        step: Time between moments, a multiple of the traffic's [s].
        blocked: Set to True at the marked moments, shape (n,).
    """
    # One circle round tractor and trailer: a quick test by which most moments are free.
    ahead, behind = (boxes[0, 0] + boxes[0, 1]) / 2, (boxes[1, 0] + boxes[1, 1]) / 2
    x0, y0 = first[0] + math.cos(first[2]) * ahead, first[1] + math.sin(first[2]) * ahead
    x1, y1 = second[0] + math.cos(second[2]) * behind, second[1] + math.sin(second[2]) * behind
    middle_x, middle_y = (x0 + x1) / 2, (y0 + y1) / 2
    size0 = math.hypot((boxes[0, 1] - boxes[0, 0]) / 2, boxes[0, 2])
    size1 = math.hypot((boxes[1, 1] - boxes[1, 0]) / 2, boxes[1, 2])
    reach = math.hypot(x1 - x0, y1 - y0) / 2 + max(size0, size1) + gap
    last = traffic.poses.shape[1] - 1
    stride = round(step / SAMPLE)
    since = round((begin - traffic.begin) / SAMPLE)
    for b in range(len(traffic.boxes)):
        other = traffic.boxes[b]
        size = math.hypot((other[1] - other[0]) / 2, other[2]) + reach
        k = 0
        while k < len(blocked):
            at = since + k * stride
            held = min(max(at, 0), last)
            dx = traffic.middles[b, held, 0] - middle_x
            dy = traffic.middles[b, held, 1] - middle_y
            sway = traffic.sway[b, held] * stride
            far = math.sqrt(dx * dx + dy * dy) - size - sway
            if far > 0.0:
                if at >= last:
                    break
                k += max(1, int(far / (traffic.quickest[b] * step + 1e-9)))
                continue
            if not blocked[k] or at >= last:
                pose = traffic.poses[b, held]
                for part in range(2):
                    own = first if part == 0 else second
                    if gap_between(boxes[part], own, other, pose) < gap + sway:
                        blocked[k] = True
                        if at >= last:
                            blocked[k:] = True
            if at >= last:
                break
            k += 1


@compiled
def blocked_along(traffic, boxes, first, second, gap, begin, step, count):
    """Moments at which a tractor or its trailer would be too near to the traffic.

    Args:
        traffic: The others.
        boxes: Of the tractor and the trailer, shape (2, 3) [m].
        first, second: Poses of the tractor and the trailer at some stations, shape (n, 3).
        gap: Least distance; half of what the others move between two moments is added [m].
        begin: First moment [s].
        step: Time between moments [s].
        count: Number of moments.

    Returns:
        Whether it is too near, at each station and moment, shape (n, count).
    """
    blocked = np.zeros((len(first), count), dtype=np.bool_)
    for k in range(len(first)):
        _mark_blocked(traffic, boxes, first[k], second[k], gap, begin, step, blocked[k])
    return blocked


@compiled
def least_gaps(traffic, boxes, first, second, times):
    """Least distance of a tractor and its trailer to the traffic at some moments.

    Args:
        traffic: The others.
        boxes: Of the tractor and the trailer, shape (2, 3) [m].
        first, second: Poses of the tractor and the trailer at the moments, shape (n, 3).
        times: The moments; the samples nearest to them count, shape (n,) [s].

    Returns:
        Shape (n,) [m]; infinite where nothing is within 60 m of the tractor.
    """
    found = np.full(len(times), np.inf)
    last = traffic.poses.shape[1] - 1
    for k in range(len(times)):
        at = min(max(round((times[k] - traffic.begin) / SAMPLE), 0), last)
        for b in range(len(traffic.boxes)):
            pose = traffic.poses[b, at]
            if math.hypot(pose[0] - first[k, 0], pose[1] - first[k, 1]) > 60.0:
                continue
            for part in range(2):
                own = first[k] if part == 0 else second[k]
                near = gap_between(boxes[part], own, traffic.boxes[b], pose)
                found[k] = min(found[k], near)
    return found
