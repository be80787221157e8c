"""The small steps of searches for words, one by one, on either side of their limits."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words import candidates, quickest, shortened
from sightfield.systems.numerics.planning.arc_words.linear_steps import ROOM, merge, stays
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord
from sightfield.systems.numerics.planning.arc_words.shortened import Cart, merged
from sightfield.systems.numerics.planning.arc_words.words import (
    angles_after,
    control_set,
    normalised,
    within_jackknife,
    words_of,
)
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer, half_angle_map, trailer_rates


def test_a_normalised_trailer_has_a_radius_of_one():
    cart = Trailer(
        speed=3.0, turn_rate=1.5, length=5.0, hitch_offset=-0.4, reverse=True, jackknife=1.1
    )
    expected = Trailer(length=2.5, hitch_offset=-0.2, reverse=True, jackknife=1.1)
    assert normalised(cart) == expected
    assert control_set(Trailer()).tolist() == [[1, -1], [1, 0], [1, 1]]
    assert control_set(cart).tolist()[3:] == [[-1, -1], [-1, 0], [-1, 1]]


@pytest.mark.parametrize(
    ("longest", "lattice", "turns", "straights"),
    [(0.6, 0.2, 3, 3), (0.59, 0.2, 2, 2), (7.5, 1.0, 5, 7), (7.0, math.tau / 7, 6, 7)],
)
def test_words_are_as_long_as_they_may_be_and_no_turn_is_whole(longest, lattice, turns, straights):
    words = words_of(Trailer(), 1, longest, lattice)
    counts = [int((words.last == k).sum()) for k in (-1, 0, 1, 2)]
    assert counts == [1, turns, straights, turns]
    np.testing.assert_allclose(
        words.ends[words.last == 1, 3], lattice * np.arange(1, straights + 1)
    )
    two = words_of(Trailer(), 2, longest, lattice)
    assert two.ends[:, 3].max() <= longest + 1e-9
    # No two neighbours are alike.
    for number in range(1, len(two.last)):
        root = two.roots[number]
        assert root < number
        step = two.ends[number, 3] - two.ends[root, 3]
        assert step == pytest.approx(lattice)


def test_angles_after_words_are_wrapped():
    maps = np.stack([half_angle_map(Trailer(), 1, omega, 1.3) for omega in (-1, 0, 1)])
    betas = [0.4, -2.9, 3.0]
    found = angles_after(maps, betas)
    assert found.shape == (3, 3)
    for n, omega in enumerate((-1, 0, 1)):
        for m, beta in enumerate(betas):
            for _ in range(2600):
                middle = beta + 2.5e-4 * trailer_rates(0, beta, 1, omega, Trailer())[3]
                beta += 5e-4 * trailer_rates(0, middle, 1, omega, Trailer())[3]
            assert math.remainder(found[n, m] - beta, math.tau) == pytest.approx(0, abs=1e-5)
    assert (np.abs(found) <= math.pi).all()


def test_words_keep_a_limit_or_what_beta_is_at_the_start():
    words = words_of(Trailer(), 1, 1.5, 0.1)
    assert within_jackknife(words, [0.3, 2.0], math.pi).all()
    kept = within_jackknife(words, [0.0, 0.8], 0.5)
    sizes = np.abs(angles_after(words.maps, [0.0, 0.8]))
    # A turn may not come back: it is shut from where it leaves the limit on.
    for column, limit in enumerate((0.5, 0.8)):
        for control in range(3):
            along = sizes[words.last == control, column] <= limit + 1e-9
            expected = np.logical_and.accumulate(along)
            np.testing.assert_array_equal(kept[words.last == control, column], expected)
    assert 0 < kept[:, 0].sum() < len(kept)


def test_where_a_turn_first_has_a_heading_of_the_box():
    first = quickest._first_sample
    assert first(0.2, 0.1, 0.2) == 0
    assert first(-0.2 - 2 * math.tau, 0.1, 0.2) == 0
    assert first(0.21, 0.0, 0.2) == -1
    assert first(-0.55, 0.1, 0.2) == 4
    assert first(0.55, -0.1, 0.2) == 4
    # Round the other side, where it turns away.
    assert first(0.55, 0.1, 0.2) == math.ceil((math.tau - 0.55 - 0.2) / 0.1)
    assert first(-0.55, -0.1, 0.2) == math.ceil((math.tau - 0.55 - 0.2) / 0.1)


def test_an_entry_is_where_an_excess_falls_to_zero():
    later = quickest._later
    assert later(0.1, 0.3, -0.1) == pytest.approx(0.75)
    assert later(0.9, 0.3, -0.1) == 0.9
    assert later(0.1, 0.0, -0.1) == 0.1
    assert later(0.1, 0.3, 0.0) == 1.0
    assert later(0.1, 0.3, 0.1) == 0.1
    assert quickest._excess(0.5 + math.tau, 0.2) == pytest.approx(0.3)
    assert quickest._excess(-0.1, 0.2) == pytest.approx(-0.1)


def test_a_trailer_comes_round_that_ends_on_the_other_side():
    soon = half_angle_map(Trailer(), -1, 0, 0.05)
    # Driven backwards beta grows away from zero, and passes pi for an end on the other side.
    assert not quickest._comes_round(2.0, soon, 2.9)
    assert quickest._comes_round(2.0, soon, -2.9)
    assert quickest._comes_round(2.0, soon, 1.5)
    assert not quickest._comes_round(-2.0 + math.tau, soon, -2.9)
    assert quickest._comes_round(-2.0, soon, 2.9 - math.tau)


def test_arcs_of_no_time_are_left_out_and_neighbours_joined():
    controls, times = np.zeros((ROOM, 2)), np.zeros(ROOM)
    given = [(1, 1, 0.5), (1, 0, 1e-9), (1, 1, 0.25), (1, 0, 1.1e-9), (-1, 0, 0.3), (-1, 1, 0.2)]
    for k, (v, omega, time) in enumerate(given):
        controls[k], times[k] = (v, omega), time
    count = merge(controls, times, len(given))
    assert count == 4
    np.testing.assert_allclose(times[:4], [0.75, 1.1e-9, 0.3, 0.2])
    assert controls[:4].tolist() == [[1, 1], [1, 0], [-1, 0], [-1, 1]]
    assert merge(controls, np.zeros(ROOM), 4) == 0


@pytest.mark.parametrize("side", range(4))
@pytest.mark.parametrize("jackknife", [math.pi, 1.5])
def test_a_turn_stays_within_the_circle_that_it_drives(side, jackknife):
    """It starts at the lowest point of a circle round (0, 1)."""
    controls, times = np.zeros((ROOM, 2)), np.zeros(ROOM)
    controls[0], times[0] = (1, 1), math.tau
    for room, expected in ((1.0, True), (0.97, False)):
        bounds = np.array([-1.0, 0.0, 1.0, 2.0]) + 0.0
        bounds[side] = (0.0 if side % 2 == 0 else 1.0) + (room if side > 1 else -room)
        wide = bounds + np.array([-1e-9, -1e-9, 1e-9, 1e-9])
        start, cart = np.zeros(4), Cart(0.8, 0.1)
        assert stays(start, controls, times, 1, cart, wide, jackknife) is expected


def test_a_limit_is_kept_along_a_word_too():
    controls, times = np.zeros((ROOM, 2)), np.zeros(ROOM)
    controls[:2], times[:2] = [(1, 1), (1, -1)], [0.9, 1.8]
    wide, cart = np.array([-9.0, -9.0, 9.0, 9.0]), Cart(1.0, 0.0)
    maps = half_angle_map(Trailer(), 1, 1, 0.9)
    (bent,) = angles_after(maps[None], [0.0])[0]
    assert stays(np.zeros(4), controls, times, 1, cart, wide, bent)
    assert not stays(np.zeros(4), controls, times, 1, cart, wide, bent - 1e-6)
    # From beyond the limit it may only fold back.
    out = np.array([0.0, 0.0, 0.0, 1.2])
    assert stays(out, controls[1:], times[1:], 1, cart, wide, 1.0)
    assert not stays(out, np.array([[-1.0, 0.0]]), np.array([0.3]), 1, cart, wide, 1.0)


def driven_beta(beta, v, omega, time, cart):
    state = np.array([0.0, 0.0, 0.0, math.sin(beta / 2), math.cos(beta / 2)])
    growth = shortened.advance(state, v, omega, time, cart)
    return 2 * math.atan2(state[3], state[4]), growth, state


@pytest.mark.parametrize("hitch", [0.0, -0.6, 0.9])
def test_the_growth_of_a_small_change_is_its_derivative(hitch):
    cart, rng = Cart(0.7, hitch), np.random.default_rng(91)
    for _ in range(40):
        beta, v, omega, time = rng.uniform([-2.5, -1, -1, 0.1], [2.5, 1, 1, 1.4])
        for speed, turn in ((v, omega), (1.0, 0.0), (-1.0, 1.0), (0.0, 1.0)):
            _, growth, _ = driven_beta(beta, speed, turn, time, cart)
            ahead, behind = (
                driven_beta(beta + step, speed, turn, time, cart)[0] for step in (1e-6, -1e-6)
            )
            change = math.remainder(ahead - behind, math.tau)
            assert change / 2e-6 == pytest.approx(growth, rel=1e-4, abs=1e-7)


def test_a_settled_trailer_keeps_an_angle():
    beta, growth, state = driven_beta(1.0, 1.0, 0.0, 1e6, Cart(0.1, 0.0))
    assert 0 < beta < 1e-10
    assert growth > 0
    assert state[0] == 1e6
    # On the circle of its own length it settles ever more slowly.
    beta, _, _ = driven_beta(0.2, 1.0, 1.0, 1e12, Cart(1.0, 0.0))
    assert beta == pytest.approx(math.pi / 2, abs=1e-6)


LEFT, STRAIGHT = (1.7, 0.6), (1.7, 0.0)
CART = Trailer(speed=1.7, turn_rate=0.6, length=1.9, hitch_offset=0.4)


def test_more_switches_lie_around_every_arc():
    word = ArcWord(np.array([LEFT, STRAIGHT]), np.array([1.0, 0.4]))
    more = shortened.with_more_switches(word, CART)
    right = (1.7, -0.6)
    pairs = [right, STRAIGHT, LEFT]
    expected = [*pairs, LEFT, right, STRAIGHT, LEFT, STRAIGHT, right, LEFT, STRAIGHT, *pairs]
    np.testing.assert_allclose(more.controls, expected)
    np.testing.assert_allclose(more.durations, [0] * 3 + [0.5, 0, 0, 0.5, 0.2, 0, 0, 0.2] + [0] * 3)
    assert merged(more).durations.tolist() == [1.0, 0.4]


@pytest.mark.parametrize(("back", "steady"), [(3.0, True), (20.0, False)])
def test_a_short_trailer_that_is_backed_up_for_long_is_not_steady(back, steady):
    cart = Trailer(length=0.5, reverse=True)
    word = ArcWord(np.array([[-1.0, 0.0]]), np.array([back]))
    goal = Goal(state=(-back, 0.0, 0.0, 0.0))
    assert shortened.is_steady(cart, (0, 0, 0, 0), word, goal) is steady


def test_switches_decide_between_words_that_take_as_long():
    word = ArcWord(np.array([LEFT, STRAIGHT]), np.array([1.0, 0.4]))
    assert candidates.rank(word, CART) == pytest.approx(1.4 * 0.6 + 2e-6, abs=1e-12)
    right = ArcWord(np.array([(1.7, -0.6)]), np.array([0.5]))
    cart = Trailer(jackknife=0.3)
    assert candidates.keeps_limit(cart, (0, 0, 0, 0.0), ArcWord(np.zeros((0, 2)), np.zeros(0)))
    assert candidates.keeps_limit(Trailer(), (0, 0, 0, 0), right)
    straight = ArcWord(np.array([[1.0, 0.0]]), np.array([0.5]))
    for beta, kept in ((0.9, True), (-0.9, True), (0.9 + math.tau, True)):
        assert candidates.keeps_limit(cart, (0, 0, 0, beta), straight) is kept


def test_words_are_optimised_and_sorted_by_time():
    goal = Goal(state=(4.0, 0.3, 0.0, 0.0), tolerance=(0.3, 0.3, 0.3, 0.3))
    start = (0.0, 0.0, 0.0, 0.0)
    words = [
        ArcWord(np.array([[1.0, 1.0], [1.0, 0.0]]), np.array([math.tau, 4.0])),
        ArcWord(np.array([[1.0, 0.0]]), np.array([5.0])),
        ArcWord(np.array([[1.0, 0.0]]), np.array([1.0])),
    ]
    found = candidates.quickest_words(Trailer(), start, words, goal, lambda _: True)
    times = [word.time for word in found]
    assert times == sorted(times)
    assert times[0] == pytest.approx(3.7, abs=1e-4)
    assert candidates.quickest_words(Trailer(), start, words, goal, lambda _: False) == []
    long = candidates.quickest_words(Trailer(), start, words, goal, lambda word: word.time > 5)
    assert all(word.time > 5 for word in long)
    assert long


@pytest.mark.parametrize("rooms", [[0.3], [-4.9e-4], [-5.1e-4, 0.3], [-5.1e-4, -5.1e-4]])
def test_a_word_in_a_wall_is_shortened_again_with_finer_checks(rooms, monkeypatch):
    """The room is asked for coarsely first, then finely along what was found."""
    asked, left = [], list(rooms)
    word = ArcWord(np.array([[1.0, 0.0]]), np.array([3.7]))

    def search(trailer, start, word, goal, clearance, fine):
        asked.append(fine)
        return word

    def clearance(start, word, fine):
        assert fine
        room = left.pop(0)
        return lambda durations: (np.array([0.5, room]), np.zeros((2, 1)))

    monkeypatch.setattr(shortened, "_shortened", search)
    goal = Goal(state=(4.0, 0.0, 0.0, 0.0))
    assert shortened.shortened(Trailer(), (0, 0, 0, 0), word, goal, clearance) is word
    assert left == []
    assert asked == [False, *(True for room in rooms if room < -5e-4)]
    none = ArcWord(np.zeros((0, 2)), np.zeros(0))
    assert shortened.shortened(Trailer(), (0, 0, 0, 0), none, goal, clearance) is none
    asked.clear()
    assert shortened.shortened(Trailer(), (0, 0, 0, 0), word, goal) is word
    assert asked == [False]


def test_room_is_kept_where_the_search_is_told_to():
    """A straight on to a box, of which the last part is shut: durations keep out of it."""
    goal = Goal(state=(4.0, 0.0, 0.0, 0.0), tolerance=(0.5, 0.2, 0.2, 0.2))
    cart = Trailer(speed=2.0, turn_rate=2.0, reverse=True)
    word = ArcWord(np.array([[2.0, 0.0], [-2.0, 0.0]]), np.array([2.5, 0.4]))

    def clearance(start, word, fine):
        # At least 4.1 m have to be driven forwards.
        def room(durations):
            return np.array([2 * durations[0] - 4.1]), np.array([[2.0, 0.0][: len(durations)]])

        return room

    found = shortened.shortened(cart, (0.0, 0.0, 0.0, 0.0), word, goal, clearance)
    assert found.durations[0] == pytest.approx(2.05, abs=1e-4)
    free = shortened.shortened(cart, (0.0, 0.0, 0.0, 0.0), word, goal)
    assert free.durations[0] == pytest.approx(1.75, abs=1e-4)
