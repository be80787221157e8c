"""Durations by linear programmes, against a general solver, a plain driver and closed forms."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from sightfield.systems.numerics.planning.arc_words import linear_steps
from sightfield.systems.numerics.planning.arc_words.linear_steps import (
    ROOM,
    Aim,
    merge,
    refine,
    shorten,
    stays,
)
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, quickest_word
from sightfield.systems.numerics.planning.arc_words.shortened import Cart, end_of, shortest
from sightfield.systems.numerics.planning.arc_words.words import control_set
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.trailer import Trailer

GOAL = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)


def aim(trailer=None, gain=1e-6):
    trailer = trailer or Trailer()
    cart = Cart(trailer.length, trailer.hitch_offset)
    pairs = control_set(trailer).astype(float)
    return Aim(cart, 0.0, np.array(THESIS_TOLERANCE), pairs, gain, 20)


def arrays(word):
    controls, times = np.zeros((ROOM, 2)), np.zeros(ROOM)
    controls[: len(word.durations)], times[: len(word.durations)] = word
    return controls, times, len(word.durations)


def test_a_straight_ends_on_the_face_of_the_box():
    controls, times, count = arrays(ArcWord(np.array([[1.0, 0.0]]), np.array([2.9])))
    total = shorten(np.array([-3.0, 0.0, 0.0, 0.0]), controls, times, count, aim())
    assert total == pytest.approx(3.0 - THESIS_TOLERANCE[0], abs=1e-5)


def test_what_cannot_be_brought_into_the_box_takes_for_ever():
    controls, times, count = arrays(ArcWord(np.array([[1.0, 0.0]]), np.array([1.0])))
    assert shorten(np.array([-3.0, 2.0, 0.0, 0.0]), controls, times, count, aim()) == math.inf


@pytest.mark.parametrize("trailer", [Trailer(), Trailer(length=1.7, hitch_offset=0.3)])
def test_words_take_as_little_time_as_a_general_solver_finds(trailer):
    rng = np.random.default_rng(8)
    later = []
    for start in rng.uniform([-3, -1.5, -1, -0.8], [-1, 1.5, 1, 0.8], (40, 4)):
        word = quickest_word(trailer, start, GOAL, 1 / 8)
        if word is None:
            continue
        other = shortest(trailer, start, word, GOAL)
        controls, times, count = arrays(word)
        total = shorten(start, controls, times, count, aim(trailer))
        count = merge(controls, times, count)
        total, count = refine(start, controls, times, count, total, aim(trailer), 3, ROOM)
        assert times[:count].sum() == pytest.approx(total)
        end = end_of(trailer, start, ArcWord(controls[:count], times[:count]))
        assert max(GOAL.miss(end)) <= linear_steps.KEPT
        later += [] if other is None else [total - other.time]
    # On a singular arc, which both come near to by many switches, a few end at different ones.
    assert len(later) >= 15
    assert np.median(later) < 1e-4
    assert max(later) < 5e-3


def least_change_by_highs(slopes, gaps, times, widths, longest):
    """The change of durations that saves the most and ends in a box, by another solver."""
    high, low = np.maximum(widths - gaps, 0), np.minimum(-widths - gaps, 0)
    rows, bounds = np.vstack([slopes[:4], -slopes[:4]]), np.append(high, -low)
    known = np.isfinite(bounds)
    return linprog(
        np.ones(len(times)),
        A_ub=rows[known],
        b_ub=bounds[known],
        bounds=[(max(-time, -longest), longest) for time in times],
    )


def test_changes_solve_their_linear_programme():
    rng = np.random.default_rng(9)
    solved = 0
    for _ in range(200):
        count = int(rng.integers(1, 9))
        slopes, gaps = rng.normal(size=(5, count)), rng.normal(size=4)
        times, widths = rng.uniform(0, 1, count), rng.uniform(0.1, 1.0, 4)
        widths[3] = math.inf if rng.random() < 0.3 else widths[3]
        change, longest = np.empty(count), 0.5
        work = np.empty((4, count)), np.empty(4 + count, dtype=np.int64), np.empty((4, 4 + count))
        found = linear_steps._best_change(
            slopes, gaps, times, longest, count, widths, *work, change
        )
        expected = least_change_by_highs(slopes, gaps, times, widths, longest)
        assert found == expected.success
        if found:
            assert change.sum() == pytest.approx(expected.fun, abs=1e-6)
            solved += 1
    assert solved > 100


def test_what_more_switches_promise_is_bounded_by_prices_of_few_columns():
    rng = np.random.default_rng(12)
    trailer, box = Trailer(reverse=True), aim(Trailer(reverse=True), gain=1e-3)
    bounds, promises = [], []
    for start in rng.uniform([-3, -1.5, -1, -0.8], [-1, 1.5, 1, 0.8], (60, 4)):
        word = quickest_word(trailer, start, GOAL, 1 / 8)
        if word is None:
            continue
        controls, times, count = arrays(word)
        shorten(start, controls, times, count, box)
        few = merge(controls, times, count)
        more, more_times, _ = arrays(word)
        many = linear_steps._with_more_switches(controls, times, few, box.pairs, more, more_times)
        gaps, slopes = np.empty(4), np.empty((5, many))
        linear_steps._ends(start, more, more_times, many, box, np.empty(5), gaps, slopes)
        expected = least_change_by_highs(slopes, gaps, more_times[:many], box.widths, 0.5)
        kept, bound = linear_steps._keep_cheap(start, more, more_times, many, few, box)
        assert more_times[:kept].sum() == pytest.approx(times[:few].sum())
        bounds.append(bound)
        promises.append(-expected.fun)
    bounds, promises = np.array(bounds), np.array(promises)
    assert (promises <= bounds + 1e-7).all()
    # Where there is nothing to be had the bound says so; elsewhere it may say too much.
    idle = promises < 1e-4
    assert 5 < idle.sum() < len(idle)
    assert bounds[idle].max() < 1e-4
    assert np.median((bounds / promises)[~idle]) < 3


def test_slopes_are_those_of_small_differences():
    rng = np.random.default_rng(10)
    box = aim(Trailer(length=0.7, hitch_offset=-0.2, reverse=True))
    controls, times = box.pairs[[0, 5, 1, 2, 3]], rng.uniform(0.2, 0.9, 5)
    start, state = np.array([0.3, -0.2, 0.4, 0.9]), np.empty(5)

    def end(durations, slopes):
        gaps = np.empty(4)
        linear_steps._ends(start, controls, durations, 5, box, state, gaps, slopes)
        return gaps

    slopes, others = np.empty((5, 5)), np.empty((5, 5))
    end(times, slopes)
    for k in range(5):
        nudge = 1e-6 * np.eye(5)[k]
        change = end(times + nudge, others) - end(times - nudge, others)
        np.testing.assert_allclose(slopes[:4, k], change / 2e-6, atol=1e-7)


def test_a_word_stays_where_neither_the_edge_nor_the_jackknife_limit_is_passed():
    controls, times, count = arrays(ArcWord(np.array([[1.0, 1.0]]), np.array([math.pi])))
    start, cart = np.zeros(4), Cart(1.0, 0.0)
    wide, narrow = np.array([-2.0, -1.0, 2.0, 3.0]), np.array([-2.0, -1.0, 0.9, 3.0])
    assert stays(start, controls, times, count, cart, wide, math.pi)
    assert not stays(start, controls, times, count, cart, narrow, math.pi)
    assert not stays(start, controls, times, count, cart, wide, 0.8)


@pytest.mark.parametrize("side", range(4))
def test_a_straight_stays_up_to_the_edge(side):
    word = ArcWord(np.array([[1.0, 0.0]]), np.array([1.0]))
    controls, times, count = arrays(word)
    start = np.array([0.0, 0.0, (side - 2) * math.pi / 2, 0.0])
    for far, expected in ((1.01, True), (1.0, True), (0.99, False), (0.51, False)):
        bounds = np.array([-3.0, -3.0, 3.0, 3.0])
        bounds[side] = far * (1 if side > 1 else -1)
        assert stays(start, controls, times, count, Cart(1.0, 0.0), bounds, math.pi) == expected
