"""Quickest paths from words drawn at random."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.minimum_time.problem import Attempt, Problem
from sightfield.systems.numerics.planning.planners.chance import (
    IN_GEAR,
    LOT,
    SCATTERED,
    paths_by_chance,
)
from sightfield.systems.numerics.planning.trailer import Trailer

START, WAY = np.array([0.0, 0.0, 0.0, 0.0]), 40.0
GOAL = Goal(state=(WAY, 0.0, 0.0, 0.0), tolerance=(0.1, 0.1, 0.1, math.inf))
STRAIGHT, ROUND = (1.0, 0.0, WAY), (1.0, 1.0, math.tau)


def attempt_along(path):
    """The path itself; it is one if it ends at the goal."""
    return Attempt(path, max(GOAL.miss(path.states[-1])), "optimal", 1)


def driven(trailer, *arcs):
    word = ArcWord(np.array([arc[:2] for arc in arcs]), np.array([arc[2] for arc in arcs]))
    return attempt_along(word_path(trailer, START, word))


def found_and_tried(trailer, known, solve=attempt_along):
    """What is found by chance, and all paths from which the programme was solved."""
    tried = []

    def noted(path):
        tried.append(path)
        return solve(path)

    found = paths_by_chance(Problem(trailer, START, GOAL, 100), noted, known)
    return [each for each in found if each.is_path], tried


def test_far_away_the_best_beginning_is_driven_with_the_best_end():
    """One path comes to the goal and turns round, another turns round and comes to the goal."""
    late, early = (driven(Trailer(), *arcs) for arcs in ((STRAIGHT, ROUND), (ROUND, STRAIGHT)))
    assert late.is_path
    assert early.is_path
    found, tried = found_and_tried(Trailer(), [late, early])
    assert [each.time for each in found] == pytest.approx([WAY, WAY + 2 * math.tau], abs=1e-9)
    assert len(tried) == IN_GEAR + 2


def test_beginnings_and_ends_are_of_one_gear():
    trailer, half = Trailer(reverse=True), (1.0, 1.0, math.pi)
    back = driven(trailer, half, (-1.0, 0.0, WAY), half)
    ahead = driven(trailer, STRAIGHT)
    assert back.is_path
    assert ahead.is_path
    found, tried = found_and_tried(trailer, [back, ahead])
    assert found == []
    assert len(tried) == 2 * IN_GEAR


@pytest.mark.parametrize(("reverse", "gears"), [(False, [1.0]), (True, [1.0, -1.0])])
def test_far_away_words_are_drawn_in_every_gear(reverse, gears):
    _, tried = found_and_tried(Trailer(reverse=reverse), [])
    straights = [path.controls[np.argmax(np.diff(path.times)), 0] for path in tried]
    assert [straights.count(gear) for gear in gears] == [IN_GEAR] * len(gears)
    assert len(tried) == IN_GEAR * len(gears)


def test_what_is_met_often_is_believed():
    same = driven(Trailer(), STRAIGHT)
    found, tried = found_and_tried(Trailer(), [], lambda path: same)
    assert len(found) == len(tried) == LOT


NEAR = Goal(state=(11.0, 0.0, 0.0, 0.0))
HALF, DIRECT, BACK = (1.0, 1.0, math.pi), (1.0, 0.0, 11.0), (-1.0, 0.0, 11.0)


@pytest.mark.parametrize(
    ("reverse", "known", "ways", "lots"),
    [
        # No word leads to a way backwards: it may have been missed, unless there is none.
        (True, [], [(ROUND, DIRECT)], SCATTERED // LOT),
        (False, [], [(ROUND, DIRECT)], 1),
        # Words lead to either.
        (True, [], [(ROUND, DIRECT), (HALF, BACK, HALF)], 1),
        # A way backwards is known, which no word leads to: of a slow one that may be.
        (True, [(HALF, BACK, HALF)], [(ROUND, DIRECT)], SCATTERED // LOT),
        (True, [(HALF, BACK, HALF)], [(DIRECT,)], 1),
    ],
)
def test_near_the_goal_words_are_drawn_until_each_gear_is_met_often(reverse, known, ways, lots):
    trailer = Trailer(reverse=reverse)

    def arrived(arcs):
        return Attempt(driven(trailer, *arcs).path, 0.0, "optimal", 1)

    tried = []

    def solve(path):
        tried.append(path)
        return arrived(ways[len(tried) % len(ways)])

    paths_by_chance(Problem(trailer, START, NEAR, 100), solve, [arrived(arcs) for arcs in known])
    assert len(tried) == lots * LOT
