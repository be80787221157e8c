"""The quickest word from pose to pose that stays on the ground."""

import math

import numpy as np

from ...compiled import compiled
from .sweep import drive, stays_on_ground
from .words import WORD_COUNT, driving_time, write_words

# Straights before and after a word, negative backwards [radii]; the first is none.
RUNS = np.array([0.0, 0.5, 1.0, 2.0, -0.5, -1.0, -2.0])

# Pieces of such a way: a straight, a word, a straight.
PIECES = 5

# Words with straights before or after them that are compared with the ground.
_MOST_CHECKS = 1000


@compiled
def fitting_word(site, motion, start, goal, gears, least, with_runs, curvatures, lengths):
    """Write the quickest word that stays on the ground, where it is quick enough.

    Nine arguments: the ground and the machine, the task, and where the answer is written.

    Args:
        site: Ground, standing crop and outline.
        motion: Of the machine.
        start: x, y, theta, shape (3,) [m], [m], [rad].
        goal: The same.
        gears: In which the machine arrives and goes on at full speed; 0: it stands.
        least: Time that it must take less than [s].
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
        if stays_on_ground(site, start, bends[word], pieces[word], PIECES, room):
            curvatures[:] = bends[word]
            lengths[:] = pieces[word]
            return times[word]
    return least
