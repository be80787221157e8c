"""Words: paths of three pieces, arc straight arc or arc arc arc, each driven in either gear.

The positions of the circles give the headings at which the pieces meet, whatever the gears are; an
arc that is driven forwards through an angle a can as well be driven backwards through 2 pi - a. So
there are 32 words with a straight and 32 of arcs alone. They include those of Dubins, those of
three pieces of Reeds and Shepp, and the fishtail turn (an arc forwards, a straight backwards, an
arc forwards).

**On the ground.** The quickest word is taken on which the outline, with its swing, stays on the
ground all along. Between two poses the outline sweeps no more than the convex hull of both
outlines, but for the heights of arcs above their chords, which short steps keep small. Hulls are
compared with the ground's edges only where discs leave a doubt.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from ..machines import convex_hull
from .borders import CROP_CELL, RASTER_ERROR, border_distance, cuts_edge

# Words from one pose to another, at most.
WORD_COUNT = 64

# An arc that is shorter than this, or as near to a whole turn, is none [rad].
NO_ARC = 1e-9

# How deep an outline may reach over a border: machines drive along borders [m].
TOUCH = 0.01

# How far an arc of the outline's farthest point may stand out of its chord [m].
_ARC_HEIGHT = 0.004

# Longest step on a straight, and spacing of the poses that are looked at first [m].
_STRAIGHT_STEP = 2.0
_FIRST_LOOK = 2.5

# Straights before and after a word, negative backwards [radii]; the first is none.
RUNS = np.array([0.0, 0.5, 1.0, 2.0, -0.5, -1.0, -2.0])

# Pieces of such a way: a straight, a word, a straight.
PIECES = 5

# Words with straights before or after them that are compared with the ground.
_MOST_CHECKS = 1000


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
    """Length of the arc that turns by an angle, but for whole turns, in a gear; the radius is 1."""
    ahead = angle % math.tau
    if ahead < NO_ARC or ahead > math.tau - NO_ARC:
        return 0.0
    return ahead if gear > 0 else ahead - math.tau


@kernel
def driving_time(lengths, count, speed, acceleration, before, after):
    """Time that pieces take, with the cost of stops and starts, also before and after them [s].

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


@kernel
def quickest_time(motion, start, goal, before, after, turns, lengths):
    """Time of the quickest word from one pose to another, where nothing is in the way [s].

    Args:
        motion: Of the machine.
        start: x, y, theta, shape (3,) [m], [m], [rad].
        goal: The same.
        before: Gear in which the machine arrives at full speed, 0: it stands.
        after: The same of how it goes on.
        turns, lengths: Space to work in, shape (64, 3) each.
    """
    dx, dy = (goal[0] - start[0]) / motion.radius, (goal[1] - start[1]) / motion.radius
    c, s = math.cos(start[2]), math.sin(start[2])
    count = write_words(c * dx + s * dy, c * dy - s * dx, goal[2] - start[2], turns, lengths)
    least = np.inf
    for word in range(count):
        for piece in range(3):
            lengths[word, piece] *= motion.radius
        time = driving_time(lengths[word], 3, motion.speed, motion.acceleration, before, after)
        least = min(least, time)
    return least


@compiled
def quickest_times(motion, starts, goals):
    """Times of the quickest words between poses, with forward drives before and after them.

    Args:
        motion: Of the machine.
        starts, goals: x, y, theta, shape (n, 3) [m], [m], [rad].

    Returns:
        Shape (n,) [s].
    """
    turns, lengths = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    times = np.empty(len(starts))
    for k in range(len(starts)):
        times[k] = quickest_time(motion, starts[k], goals[k], 1, 1, turns, lengths)
    return times


@kernel
def stays_on_ground(site, pose, curvatures, lengths, count, room):
    """Whether the outline stays on the ground, and the body off standing crop, all along a path.

    Nothing of the outline is farther than TOUCH + 0.005 m beyond a border where the answer is yes.

    Args:
        site: Ground, standing crop and outline.
        pose: x, y, theta of the start, shape (3,) [m], [m], [rad].
        curvatures: Of the pieces, shape (at least count,) [1/m].
        lengths: Of the pieces, negative backwards; shape (at least count,) [m].
        count: How many pieces there are.
        room: Space to work in, shape (2, 20, 2).
    """
    if border_distance(site.borders, pose[0], pose[1]) < -RASTER_ERROR:
        return False
    if not _may_stay(site.borders, site.footprint, pose, curvatures, lengths, count):
        return False
    x, y, theta = pose[0], pose[1], pose[2]
    if not _clear(site, x, y, theta, 0.0, 0.0, room):
        return False
    for piece in range(count):
        length, curvature = lengths[piece], curvatures[piece]
        if length == 0.0:
            continue
        longest = _STRAIGHT_STEP
        if curvature != 0.0:
            farthest = site.footprint.reach + 1 / abs(curvature)
            longest = min(longest, math.sqrt(8 * _ARC_HEIGHT / farthest) / abs(curvature))
        steps = math.ceil(abs(length) / longest)
        step = length / steps
        for _ in range(steps):
            if not _clear(site, x, y, theta, step, curvature, room):
                return False
            x, y, theta = drive(x, y, theta, step, curvature)
    return True


@kernel
def drive(x, y, theta, way, curvature):
    """Pose after an arc or a straight.

    Args:
        x, y, theta: Pose before [m], [m], [rad].
        way: Negative backwards [m].
        curvature: Positive to the left on the way forwards [1/m].
    """
    half = curvature * way / 2
    chord = way * (math.sin(half) / half if half != 0.0 else 1.0)
    return (
        x + chord * math.cos(theta + half),
        y + chord * math.sin(theta + half),
        theta + 2 * half,
    )


@kernel
def _may_stay(borders, footprint, pose, curvatures, lengths, count):
    """Quick test at some poses: False if a disc inside of the outline is over the border."""
    x, y, theta = pose[0], pose[1], pose[2]
    for piece in range(count):
        steps = math.ceil(abs(lengths[piece]) / _FIRST_LOOK)
        if steps == 0:
            continue
        step = lengths[piece] / steps
        for _ in range(steps):
            x, y, theta = drive(x, y, theta, step, curvatures[piece])
            c, s = math.cos(theta), math.sin(theta)
            for disc in range(len(footprint.inside)):
                ahead, left = footprint.inside[disc, 0], footprint.inside[disc, 1]
                away = border_distance(borders, x + c * ahead - s * left, y + s * ahead + c * left)
                if away + RASTER_ERROR < footprint.inside[disc, 2] - TOUCH:
                    return False
    return True


@kernel
def _clear(site, x, y, theta, step, curvature, room):
    """Whether one step from a pose is clear, and the pose that it leads to as well."""
    borders, footprint, crop = site.borders, site.footprint, site.crop
    nx, ny, heading = drive(x, y, theta, step, curvature)
    c, s = math.cos(heading), math.sin(heading)
    for part in range(len(footprint.corners)):
        ahead, left = footprint.around[part, 0], footprint.around[part, 1]
        away = border_distance(borders, nx + c * ahead - s * left, ny + s * ahead + c * left)
        # A disc round the part moves with its middle, which is no faster than this.
        moved = abs(step) * (1 + abs(curvature) * math.hypot(ahead, left))
        if away - RASTER_ERROR >= footprint.around[part, 2] + moved:
            continue
        if away + RASTER_ERROR <= 0.0 or _hull_cut(
            borders, footprint, part, x, y, theta, nx, ny, heading, room
        ):
            return False
    rows, columns = crop.shape
    for point in range(len(footprint.body)):
        ahead, left = footprint.body[point, 0], footprint.body[point, 1]
        i = math.floor((nx + c * ahead - s * left - site.crop_origin[0]) / CROP_CELL)
        j = math.floor((ny + s * ahead + c * left - site.crop_origin[1]) / CROP_CELL)
        if 0 <= i < columns and 0 <= j < rows and crop[j, i]:
            return False
    return True


@kernel
def _hull_cut(borders, footprint, part, x, y, theta, nx, ny, heading, room):
    """Whether an edge comes into the hull of a part at two poses."""
    points, hull = room[0], room[1]
    c, s = math.cos(theta), math.sin(theta)
    nc, ns = math.cos(heading), math.sin(heading)
    for k in range(4):
        ahead, left = footprint.corners[part, k, 0], footprint.corners[part, k, 1]
        points[k, 0], points[k, 1] = x + c * ahead - s * left, y + s * ahead + c * left
        points[k + 4, 0] = nx + nc * ahead - ns * left
        points[k + 4, 1] = ny + ns * ahead + nc * left
    return cuts_edge(borders, hull, convex_hull(points, 8, hull), TOUCH)


@compiled
def path_stays(site, pose, curvatures, lengths):
    """Whether one path stays on the ground, see `stays_on_ground`.

    Args:
        site: Ground, standing crop and outline.
        pose: x, y, theta of the start, shape (3,) [m], [m], [rad].
        curvatures: Of the pieces, shape (n,) [1/m].
        lengths: Of the pieces, negative backwards; shape (n,) [m].
    """
    room = np.zeros((2, 20, 2))
    return stays_on_ground(site, pose, curvatures, lengths, len(lengths), room)


@compiled
def fitting_word(site, motion, start, goal, gears, least, with_runs, curvatures, lengths):
    """Write the quickest word that stays on the ground, if it is quick enough.

    Nine arguments: the ground and the machine, the task, and where the answer is written.

    Args:
        site: Ground, standing crop and outline.
        motion: Of the machine.
        start: x, y, theta, shape (3,) [m], [m], [rad].
        goal: The same.
        gears: In which the machine arrives and goes on at full speed; 0: it stands.
        least: The word has to take less time than this [s].
        with_runs: Whether there may be straights before and after the word.
        curvatures: Written: of the pieces, shape (PIECES,) [1/m].
        lengths: Written: of the pieces, negative backwards, shape (PIECES,) [m].

    Returns:
        Its time; `least` where there is no such word [s].
    """
    room = np.zeros((2, 20, 2))
    turns, ways = np.zeros((WORD_COUNT, 3)), np.zeros((WORD_COUNT, 3))
    runs = len(RUNS) if with_runs else 1
    count = 0
    bends = np.zeros((WORD_COUNT * runs * runs, PIECES))
    pieces, times = np.zeros(bends.shape), np.zeros(len(bends))
    for before in range(runs):
        ahead = RUNS[before] * motion.radius
        x, y, theta = drive(start[0], start[1], start[2], ahead, 0.0)
        for after in range(runs):
            behind = RUNS[after] * motion.radius
            gx, gy, heading = drive(goal[0], goal[1], goal[2], -behind, 0.0)
            dx, dy = (gx - x) / motion.radius, (gy - y) / motion.radius
            c, s = math.cos(theta), math.sin(theta)
            words = write_words(c * dx + s * dy, c * dy - s * dx, heading - theta, turns, ways)
            for word in range(words):
                pieces[count, 0], pieces[count, 4] = ahead, behind
                for piece in range(3):
                    pieces[count, piece + 1] = ways[word, piece] * motion.radius
                    bends[count, piece + 1] = turns[word, piece] / motion.radius
                times[count] = driving_time(
                    pieces[count], PIECES, motion.speed, motion.acceleration, gears[0], gears[1]
                )
                if times[count] < least:
                    count += 1
    order = np.argsort(times[:count], kind="mergesort")
    for word in order[:_MOST_CHECKS]:
        if stays_on_ground(site, start, bends[word], pieces[word], np.int64(PIECES), room):
            curvatures[:] = bends[word]
            lengths[:] = pieces[word]
            return times[word]
    return least
