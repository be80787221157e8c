"""Quickest paths from words drawn at random, until they have been met often enough.

A word that is met only once is a sign that others as hard to meet are still missing. Words drawn at
random lead to one gear more often than to the other, so that this is asked in each gear.

Far from the goal a path is a manoeuvre, a long straight in one gear and another manoeuvre. What is
best at one end depends little on the other: so words are drawn of that form, in each gear until its
own quickest is met often, and the best beginnings are driven with the best ends, which may have
been met on other paths.

Source: how much is unseen, Good, Biometrika 40, 1953.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ..arc_words.candidates import manoeuvre_words, scattered_words
from ..arc_words.quickest import ArcWord, word_path
from ..minimum_time.problem import Attempt, Problem
from ..plan import TrailerPath

# Random words that end anywhere: at most, and per lot. Lots are added until in each gear this many
# words have led to its quickest known path, to within this share of its time; but a gear that takes
# so many times as long as the other is left.
SCATTERED, LOT, OFTEN, _SAME, _SLOW = 160, 20, 3, 1e-3, 1.25
# A goal is far from this many turning radii on; most words that are then drawn in each gear.
FAR, IN_GEAR = 12.0, 80
# Beginnings and ends that are put together, and by how much their times differ at least
# [1 / turn rate].
HALVES, _UNLIKE = 3, 0.01

Solve = Callable[[TrailerPath], Attempt]


def paths_by_chance(problem: Problem, solve: Solve, known: Iterable[Attempt]) -> list[Attempt]:
    """Attempts from words drawn at random, the same every time.

    Args:
        problem: From where to where.
        solve: The programme that makes an attempt of a path.
        known: Attempts from other seeds.
    """
    trailer, start, goal = problem.trailer, problem.start, problem.goal
    paths = [each for each in known if each.is_path]
    gears = (1, -1) if trailer.reverse else (1,)
    if math.dist(start[:2], goal.state[:2]) < FAR * trailer.radius:
        words = scattered_words(trailer, start, goal, SCATTERED)
        return _until_often(problem, solve, words, paths, gears)
    found = list[Attempt]()
    for gear in gears:
        words = manoeuvre_words(trailer, start, goal, gear, IN_GEAR)
        found += _until_often(problem, solve, words, [], (gear,))
        both = paths + [each for each in found if each.is_path]
        found += [solve(path) for path in _put_together(problem, both, gear)]
    return found


def _until_often(
    problem: Problem,
    solve: Solve,
    words: list[ArcWord],
    known: list[Attempt],
    gears: tuple[int, ...],
) -> list[Attempt]:
    """Attempts from words, lot by lot, until the quickest paths have been found often enough."""
    found = list[Attempt]()
    for first in range(0, len(words), LOT):
        lot = words[first : first + LOT]
        found += [solve(word_path(problem.trailer, problem.start, word)) for word in lot]
        if _met_often([each for each in found if each.is_path], known, gears):
            break
    return found


def _met_often(drawn: list[Attempt], known: list[Attempt], gears: tuple[int, ...]) -> bool:
    """Whether each gear's quickest path was drawn often; slow gears are not asked."""
    quickest = min((each.time for each in drawn + known), default=math.inf)
    for gear in gears:
        times = [each.time for each in drawn if _gear_of(each.path) == gear]
        others = [each.time for each in known if _gear_of(each.path) == gear]
        least = min(times + others, default=math.inf)
        slow = _SLOW * quickest < least < math.inf
        if not slow and sum(time <= least * (1 + _SAME) for time in times) < OFTEN:
            return False
    return True


def _gear_of(path: TrailerPath) -> int:
    """The gear in which most of a path is driven: 1 or -1."""
    return 1 if path.controls[:, 0] @ np.diff(path.times) >= 0 else -1


class _Halves(NamedTuple):
    """A path, and the interval in the middle of its way.

    Attributes:
        path: All of it.
        middle: Number of the interval.
        before: The time to there, and that of a straight on to the goal [s].
        after: How much longer than that straight the rest takes [s].
    """

    path: TrailerPath
    middle: int
    before: float
    after: float


def _put_together(problem: Problem, paths: list[Attempt], gear: int) -> Iterator[TrailerPath]:
    """The best first halves that are driven in a gear, each with the best second ones."""
    halves = [half for each in paths if (half := _halves(problem, each.path, gear))]
    least = _UNLIKE / problem.trailer.turn_rate
    firsts = _quickest(halves, lambda half: half.before, least)
    seconds = _quickest(halves, lambda half: half.after, least)
    for one in firsts:
        for other in seconds:
            if one is not other:
                yield _joined(problem, one, other)


def _halves(problem: Problem, path: TrailerPath, gear: int) -> _Halves | None:
    """Where a path has come half as near to the goal, unless that is in the other gear."""
    goal, speed = problem.goal.state[:2], problem.trailer.speed
    ways = np.hypot(*(path.states[:, :2] - goal).T)
    middle = min(int(np.argmax(ways < ways[0] / 2)), len(path.controls) - 1)
    if path.controls[middle, 0] * gear <= 0:
        return None
    straight, time = ways[middle] / speed, path.times[middle]
    return _Halves(path, middle, time + straight, path.times[-1] - time - straight)


def _quickest(
    halves: list[_Halves], time: Callable[[_Halves], float], least: float
) -> list[_Halves]:
    """The first few by some time, of which no two take nearly as long."""
    found: list[_Halves] = []
    for each in sorted(halves, key=time):
        if len(found) < HALVES and all(time(each) - time(old) > least for old in found):
            found.append(each)
    return found


def _joined(problem: Problem, first: _Halves, second: _Halves) -> TrailerPath:
    """One path's controls up to its middle, and the other's from there."""
    k, n = first.middle, second.middle
    word = ArcWord(
        np.concatenate([first.path.controls[:k], second.path.controls[n:]]),
        np.concatenate([np.diff(first.path.times)[:k], np.diff(second.path.times)[n:]]),
    )
    return word_path(problem.trailer, problem.start, word)
