"""Times by words that nodes close to the goal know: driven, they are kept."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer, trailer_rates
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.known_words import (
    HELD,
    times_by_words,
    word_by_descents,
    word_controls,
)
from sightfield.systems.numerics.planning.value_function.policy import attained_times, best_word
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.value_function.value_function import word_known

# A path of two arcs to the left face of the box, which the minimum-time programme, from Dubins
# words, and the polished planner missed: they took 8.1973 s.
CHANNEL, CHANNEL_TIME = (-2.33679043, -0.84871875, -1.12659814, -0.48444798), 3.24874


def driven(trailer, start, word):
    """Where a word leads, by integration of the equations of motion."""
    state = np.array(start, dtype=float)
    for (v, omega), duration in zip(word.controls, word.durations, strict=True):

        def rates(_, q, v=v, omega=omega):
            return trailer_rates(q[2], q[3], v, omega, trailer)

        state = solve_ivp(rates, (0.0, duration), state, rtol=1e-9, atol=1e-11).y[:, -1]
    return state


def test_the_time_to_go_is_that_of_a_path_into_the_box(solved):
    value = solved()
    rng = np.random.default_rng(11)
    starts = rng.uniform([-4, -4, -math.pi, -1.5], [4, 4, math.pi, 1.5], (25, 4))
    for start, time in zip(starts, value.time_to_go(starts), strict=True):
        word = word_known(value, start)
        assert word.time <= time + 1e-4
        assert max(value.goal.miss(driven(value.trailer, start, word))) < 1e-7
        assert time >= lower_bound(value.trailer, start, value.goal) - 1e-3


def test_a_channel_narrower_than_a_cell_is_found(solved):
    value = solved()
    assert value.time_to_go(CHANNEL) == pytest.approx(CHANNEL_TIME, abs=1e-4)
    word = best_word(value, CHANNEL)
    assert word.time == pytest.approx(CHANNEL_TIME, abs=1e-4)
    assert max(value.goal.miss(driven(value.trailer, CHANNEL, word))) < 1e-6


def test_a_thorough_search_finds_what_the_first_descents_miss(solved):
    # From the best first step of each control the least is 7.30 s.
    start = np.array([-1.906, 0.44, -2.151, -1.533])
    value = solved()
    known = value.table, value.grid, value.trailer, value.goal, value.words
    word = word_by_descents(*known, start, thorough=True)
    assert word.time < 5.1
    assert times_by_words(*known, start[None])[0] > 7
    assert value.time_to_go(start) == pytest.approx(word.time, abs=1e-3)


def test_times_to_go_are_those_attained(solved):
    value = solved()
    rng = np.random.default_rng(315)
    starts = rng.uniform([-4, -4, -math.pi, -1.5], [4, 4, math.pi, 1.5], (30, 4))
    errors = value.time_to_go(starts) / attained_times(value, starts) - 1
    assert np.median(np.abs(errors)) < 1e-4
    assert np.abs(errors).mean() < 2e-3


@pytest.mark.parametrize(
    "trailer",
    [
        Trailer(),
        Trailer(reverse=True, jackknife=1.2),
        Trailer(speed=2.0, turn_rate=0.5, length=3.0, hitch_offset=-0.4),
    ],
)
def test_nodes_close_to_the_goal_know_words_that_take_their_time(trailer):
    radius = trailer.radius
    tolerance = (0.4 * radius, 0.4 * radius, 0.55, 0.55)
    goal = Goal(state=(radius, 2.0, 0.6, 0.0), tolerance=tolerance)
    grid = StateGrid.of_step(0.4, goal.state[:2], radius=radius)
    value = solve_value_function(trailer, goal, grid, polish=1)
    known = value.words
    x_nodes, y_nodes, thetas, betas = grid.axes()
    rng = np.random.default_rng(12)
    assert (np.diff(known.nodes) > 0).all()
    units = [trailer.speed, trailer.turn_rate]
    for row in rng.choice(len(known.nodes), 40, replace=False):
        t, b, j, i = np.unravel_index(known.nodes[row], grid.shape)
        count = known.counts[row]
        controls = word_controls(trailer)[known.controls[row, :count]] * units
        durations = known.durations[row, :count] / trailer.turn_rate
        start = (x_nodes[i], y_nodes[j], thetas[t], betas[b])
        end = driven(trailer, start, ArcWord(controls, durations))
        assert durations.sum() == pytest.approx(value.table[t, b, j, i], abs=1e-5)
        assert durations.sum() <= HELD / trailer.turn_rate + 1e-5
        # A word of the lattice ends there but for an error of interpolation.
        assert (np.array(value.goal.miss(end)) / [radius, radius, 1, 1]).max() < 5e-3


def test_mirror_images_of_nodes_know_mirror_images_of_words(solved):
    known, grid = solved().words, solved().grid
    t, b, j, i = np.unravel_index(known.nodes, grid.shape)
    images = -t % grid.theta_count, -b % grid.beta_count, grid.y_count - 1 - j, i
    assert set(np.ravel_multi_index(images, grid.shape).tolist()) == set(known.nodes.tolist())


def test_the_interpolated_times_improve_faster_than_the_step(solved):
    rng = np.random.default_rng(13)
    starts = rng.uniform([-4, -4, -math.pi, -1.5], [2, 3, math.pi, 1.5], (30, 4))
    tables = [solved(step, wide=True, polish=None) for step in (0.4, 0.2)]
    times = tables[1].time_to_go(starts)
    coarse, fine = (np.median(np.abs(each.interpolated(starts) / times - 1)) for each in tables)
    assert fine < coarse / 2**1.5


@pytest.fixture(scope="module")
def limited():
    """The table of a cart that folds to 0.9 at most, and starts."""
    box = Goal(state=(0, 0, 0, 0), tolerance=(*THESIS_TOLERANCE[:3], 0.3))
    value = solve_value_function(Trailer(jackknife=0.9), box, StateGrid.of_step(0.2))
    rng = np.random.default_rng(14)
    return value, rng.uniform([-4, -3, -math.pi, -0.9], [2, 3, math.pi, 0.9], (12, 4))


def test_along_a_jackknife_limit_words_are_as_quick_as_the_programme(limited):
    value, starts = limited
    best = [plan_by_casadi(value.trailer, start, value.goal).time for start in starts]
    later = value.time_to_go(starts) / best - 1
    # Turns and straights alone, which only come near to the limit, take a tenth longer.
    assert np.median(later) < 0.01
    assert np.mean(later) < 0.04


@pytest.mark.parametrize(
    "trailer",
    [Trailer(jackknife=0.9), Trailer(jackknife=0.5, length=2.0, hitch_offset=-0.3, reverse=True)],
)
def test_some_controls_hold_beta_at_the_jackknife_limit(trailer):
    holding = 0
    for v, omega in word_controls(trailer):
        for side in (-1, 1):
            *_, rate = trailer_rates(0.0, side * trailer.jackknife, v, omega, trailer)
            holding += abs(rate) < 1e-12
    assert holding == (4 if trailer.reverse else 2)


def test_a_jackknife_limit_is_kept(solved, limited):
    value, starts = limited
    trailer = value.trailer
    free = solved(beta_width=0.3).time_to_go(starts)
    assert (value.time_to_go(starts) >= free * (1 - 1e-3)).all()
    kept = [start for start in starts if np.isfinite(value.time_to_go(start))]
    assert len(kept) > 6
    for start in kept:
        word = word_known(value, start)
        ends = np.cumsum(word.durations)
        for time in np.linspace(0, ends[-1], 16):
            left = np.clip(time - (ends - word.durations), 0, word.durations)
            assert abs(driven(trailer, start, word._replace(durations=left))[3]) < 0.9 + 0.01
