"""Words: paths of three pieces, arc straight arc or arc arc arc, each driven in either gear.

Where the circles are tells the headings at which the pieces meet, whatever the gears are; an arc
that is driven forwards through an angle a can as well be driven backwards through 2 pi - a. So
there are 32 words with a straight and 32 of arcs alone. Those of Dubins are among them, those of
three pieces of Reeds and Shepp, and the fishtail turn (an arc forwards, a straight backwards, an
arc forwards).
"""

import math

import numpy as np

from ...compiled import compiled, kernel

# Words from one pose to another, at most.
WORD_COUNT = 64

# An arc that is shorter than this, or as near to a whole turn, is none [rad].
NO_ARC = 1e-9


@kernel
def write_words(x, y, theta, turns, lengths):
    """Write all words from the origin, heading along x, to a pose; the radius is 1.

    Args:
        x, y, theta: The pose [radii], [radii], [rad].
        turns: Where the pieces' turns are written, 1 left, 0 straight, -1 right; shape (64, 3).
        lengths: Where their lengths are written, negative backwards; shape (64, 3) [radii].

    Returns:
        How many words there are.
    """
    count = 0
    for first in (1, -1):
        for last in (1, -1):
            dx = x - last * math.sin(theta)
            dy = y + last * math.cos(theta) - first
            square = dx * dx + dy * dy
            apart = last - first
            # Touching circles, of which rounding would make crossing ones, count as touching.
            rest = square - apart * apart
            if rest >= -1e-12:
                way = math.sqrt(max(rest, 0.0))
                course = math.atan2(dy, dx)
                for gear in (1, -1):
                    heading = course - math.atan2(float(apart), gear * way)
                    count = _write_gears(
                        count, turns, lengths, first, 0, last, heading, gear * way, theta - heading
                    )
            if first == last and square <= 16.0:
                course = math.atan2(dy, dx)
                lean = math.acos(min(math.sqrt(square) / 4, 1.0))
                for side in (1, -1):
                    # The middle circle's centre lies to one side of the line of the others'.
                    heading = course + side * lean + first * math.pi / 2
                    turned = math.pi - 2 * side * lean
                    count = _write_gears(
                        count,
                        turns,
                        lengths,
                        first,
                        -first,
                        first,
                        heading,
                        turned,
                        theta - heading - turned,
                    )
    return count


@kernel
def _write_gears(count, turns, lengths, first, middle, last, begin, between, end):
    """All gears of one word; begin, between and end are changes of heading, or the straight."""
    for begin_gear in (1, -1):
        a = _arc(first * begin, begin_gear)
        for middle_gear in (1, -1):
            if middle == 0:
                if middle_gear < 0:
                    break
                b = between
            else:
                b = _arc(middle * between, middle_gear)
            for end_gear in (1, -1):
                c = _arc(last * end, end_gear)
                # An arc of no length has no gear.
                if (a == 0.0 and begin_gear < 0) or (c == 0.0 and end_gear < 0):
                    continue
                if middle != 0 and b == 0.0 and middle_gear < 0:
                    continue
                turns[count, 0], turns[count, 1], turns[count, 2] = first, middle, last
                lengths[count, 0], lengths[count, 1], lengths[count, 2] = a, b, c
                count += 1
    return count


@kernel
def _arc(angle, gear):
    """The way round a circle in a gear that turns by an angle, but for whole turns."""
    ahead = angle % math.tau
    if ahead < NO_ARC or ahead > math.tau - NO_ARC:
        return 0.0
    return ahead if gear > 0 else ahead - math.tau


@kernel
def driving_time(lengths, count, speed, acceleration, before, after):
    """Time that pieces take, with what stopping and starting costs, also before and after [s].

    A stop between ways that are long enough costs speed / acceleration; half of it is counted where
    the machine brakes and half where it starts. A way between two stops may be too short for the
    full speed.

    Args:
        lengths: Of the pieces, negative backwards; shape (at least count,) [m].
        count: How many of them there are.
        speed: [m/s].
        acceleration: [m/s^2].
        before: Gear in which the machine arrives at full speed, 0: it stands.
        after: The same of how it goes on.
    """
    half = speed / (2 * acceleration)
    time, gear, run, stops = 0.0, before, 0.0, 1 if before == 0 else 0
    for k in range(count + 1):
        if k < count and lengths[k] == 0.0:
            continue
        following = after if k == count else (1 if lengths[k] > 0 else -1)
        if following != gear:
            if gear != 0:
                time += _run_time(run, stops + 1, half, speed, acceleration)
            stops, run, gear = 1, 0.0, following
        if k < count:
            run += abs(lengths[k])
    if gear != 0:
        time += _run_time(run, stops, half, speed, acceleration)
    return time


@kernel
def _run_time(way, stops, half, speed, acceleration):
    if stops == 2 and way * acceleration < speed * speed:
        return 2 * math.sqrt(way / acceleration)
    return way / speed + stops * half


@compiled
def _times(starts, goals, radius, speed, acceleration, before, after):
    turns, lengths = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    times = np.empty(len(starts))
    for k in range(len(starts)):
        dx = (goals[k, 0] - starts[k, 0]) / radius
        dy = (goals[k, 1] - starts[k, 1]) / radius
        c, s = math.cos(starts[k, 2]), math.sin(starts[k, 2])
        count = write_words(
            c * dx + s * dy, c * dy - s * dx, goals[k, 2] - starts[k, 2], turns, lengths
        )
        best = np.inf
        for word in range(count):
            for piece in range(3):
                lengths[word, piece] *= radius
            time = driving_time(lengths[word], 3, speed, acceleration, before, after)
            best = min(best, time)
        times[k] = best
    return times


def word_times(
    starts: np.ndarray,
    goals: np.ndarray,
    radius: float,
    speed: float,
    acceleration: float,
    gears: tuple[int, int] = (1, 1),
) -> np.ndarray:
    """Time of the quickest word of each pair of poses, shape (n,) [s].

    Args:
        starts: x, y, theta, shape (n, 3) [m], [m], [rad].
        goals: The same.
        radius: Of the arcs [m].
        speed: [m/s].
        acceleration: [m/s^2].
        gears: In which the machine arrives at the start at full speed and goes on from the goal;
            0: it stands there.
    """
    pair = np.broadcast_arrays(np.asarray(starts, dtype=float), np.asarray(goals, dtype=float))
    first, second = (np.ascontiguousarray(each.reshape(-1, 3)) for each in pair)
    return _times(first, second, radius, speed, acceleration, *gears).reshape(pair[0].shape[:-1])
