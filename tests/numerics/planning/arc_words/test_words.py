"""Words of arcs, against numerical integration and brute force."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sightfield.systems.numerics.planning.arc_words.quickest import quickest_word, word_path
from sightfield.systems.numerics.planning.arc_words.words import (
    angles_after,
    within_jackknife,
    words_of,
)
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.trailer import (
    Trailer,
    half_angle_map,
    half_angles,
    hold_beta,
    trailer_rates,
)

GOAL = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
CARTS = [
    Trailer(),
    Trailer(length=2.5),
    Trailer(length=0.4, hitch_offset=0.2),
    Trailer(length=1.0, hitch_offset=-0.3, reverse=True),
]


def integrated(trailer, start, controls, durations):
    """Where controls lead, by an adaptive method."""
    state = np.array(start, dtype=float)
    for (v, omega), duration in zip(controls, durations, strict=True):
        state = solve_ivp(
            lambda _, q, v=v, omega=omega: [
                float(r) for r in trailer_rates(*q[2:], v, omega, trailer)
            ],
            (0, duration),
            state,
            rtol=1e-10,
            atol=1e-12,
        ).y[:, -1]
    return state


@pytest.mark.parametrize("trailer", CARTS)
@pytest.mark.parametrize("control", [(1, 0), (1, 1), (1, -1), (-1, 0), (-1, 1)])
def test_the_trailer_angle_is_as_integrated(trailer, control):
    for beta in (-2.5, -0.3, 0.0, 1.1):
        end = integrated(trailer, (0, 0, 0, beta), [control], [1.3])[3]
        assert hold_beta(beta, *control, 1.3, 40, trailer)[-1] == pytest.approx(end, abs=1e-8)


def test_maps_of_successive_controls_multiply():
    cart = Trailer(length=0.7, hitch_offset=0.1)
    one, two = half_angle_map(cart, 1, 1, 0.8), half_angle_map(cart, 1, -1, 1.7)
    s, c = two @ one @ half_angles(0.4)
    end = integrated(cart, (0, 0, 0, 0.4), [(1, 1), (1, -1)], [0.8, 1.7])[3]
    assert math.remainder(2 * math.atan2(s, c) - end, math.tau) == pytest.approx(0, abs=1e-8)


def test_words_end_where_their_arcs_lead():
    cart = Trailer()
    words = words_of(cart, 2, 2.0, 0.5)
    # The empty word, 3 controls of 4 durations, 6 pairs of controls with 6 pairs of durations.
    assert len(words.ends) == 1 + 12 + 36
    assert (words.roots[1:] < np.arange(1, len(words.roots))).all()
    controls = [(1, -1), (1, 0), (1, 1)]
    for number in (5, 20, 40):
        arcs, at = [], number
        while at:
            arcs.insert(0, controls[words.last[at]])
            at = words.roots[at]
        end = integrated(cart, (0, 0, 0, 0.3), arcs, [0.5] * len(arcs))
        np.testing.assert_allclose(words.ends[number], [*end[:3], 0.5 * len(arcs)], atol=1e-8)
        assert angles_after(words.maps[[number]], [0.3])[0, 0] == pytest.approx(end[3], abs=1e-8)


def test_a_word_beyond_the_jackknife_limit_is_not_allowed():
    cart = Trailer(length=4.0)
    words = words_of(cart, 1, 3.0, 0.25)
    allowed = within_jackknife(words, [0.0, 0.5], 1.0)
    turns = np.abs(words.ends[:, 2])
    assert not allowed[turns > 2.0].any()
    assert allowed[turns < 0.4].all()


def test_the_quickest_word_ends_in_the_box():
    rng = np.random.default_rng(2)
    found = 0
    for start in rng.uniform([-3, -2, -1, -1], [-0.5, 2, 1, 1], (30, 4)):
        word = quickest_word(Trailer(), start, GOAL)
        if word is None:
            continue
        found += 1
        end = integrated(Trailer(), start, word.controls, word.durations)
        assert max(GOAL.miss(end)) < 5e-3
        path = word_path(Trailer(), start, word)
        np.testing.assert_allclose(path.states[-1], end, atol=1e-7)
        assert path.times[-1] == pytest.approx(word.time)
    assert found >= 10


def test_no_word_of_a_finer_lattice_is_slower():
    start = (-1.6, 0.7, -0.6, 0.4)
    coarse, fine = (quickest_word(Trailer(), start, GOAL, lattice) for lattice in (1 / 8, 1 / 32))
    assert fine.time <= coarse.time + 1e-3


def test_a_word_scales_with_the_cart():
    start = np.array([-1.6, 0.7, -0.6, 0.4])
    word = quickest_word(Trailer(), start, GOAL)
    big = Trailer(speed=6.0, turn_rate=2.0, length=3.0)
    box = Goal(state=GOAL.state, tolerance=(0.6, 0.6, 0.251, 0.251))
    other = quickest_word(big, start * [3, 3, 1, 1], box)
    np.testing.assert_allclose(other.durations, word.durations / 2, rtol=1e-4)


def test_a_box_behind_is_beyond_three_arcs():
    assert quickest_word(Trailer(), (3.0, 0.0, 0.0, 0.0), GOAL) is None


def test_with_reverse_a_box_behind_is_backed_into():
    word = quickest_word(Trailer(reverse=True), (1.0, 0.0, 0.0, 0.0), GOAL)
    assert word.time == pytest.approx(0.8, abs=1e-3)
    assert (word.controls[:, 0] == -1).all()
