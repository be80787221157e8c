"""What searches for words find, step by step, is as it was recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.arc_words import candidates, linear_steps
from sightfield.systems.numerics.planning.arc_words.linear_steps import (
    ROOM,
    Aim,
    merge,
    refine,
    shorten,
)
from sightfield.systems.numerics.planning.arc_words.quickest import (
    ArcWord,
    enter_box,
    quickest_word,
    word_path,
)
from sightfield.systems.numerics.planning.arc_words.shortened import (
    Cart,
    end_and_slopes,
    shortened,
    shortest,
)
from sightfield.systems.numerics.planning.arc_words.words import (
    control_set,
    endings_of,
    normalised,
    within_jackknife,
    words_of,
)
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer, half_angles

# Away from every neutral value.
FORWARD = Trailer(speed=1.7, turn_rate=0.6, length=1.9, hitch_offset=0.4)
REVERSE = Trailer(
    speed=2.1, turn_rate=1.4, length=1.1, hitch_offset=-0.3, reverse=True, jackknife=1.3
)
CARTS = pytest.mark.parametrize("cart", [FORWARD, REVERSE], ids=["forward", "reverse"])


def random_word(rng, pairs, count):
    """A word without neighbours that are alike, in arrays with room for more."""
    controls, times = np.zeros((ROOM, 2)), np.zeros(ROOM)
    number = -1
    for k in range(count):
        number = int(rng.choice([n for n in range(len(pairs)) if n != number]))
        controls[k], times[k] = pairs[number], rng.uniform(0.2, 1.4)
    return controls, times


def near_case(rng, trailer, steps, gain=1e-6):
    """A box around a place near the end of a word, the start of the word, and the word."""
    radius = trailer.radius
    pairs = control_set(trailer).astype(float)
    cart = Cart(trailer.length / radius, trailer.hitch_offset / radius)
    count = int(rng.integers(2, 6))
    controls, times = random_word(rng, pairs, count)
    end, slopes = np.empty(4), np.empty((4, count))
    start = np.array([0.0, 0.0, *rng.uniform(-1.0, 1.0, 2)])
    end_and_slopes(start, controls[:count], times[:count], cart, end, slopes)
    beta = float(rng.uniform(-0.3, 0.3))
    # In the frame of the box: the word ends close to its middle.
    away = rng.uniform(-0.4, 0.4, 3)
    turn = away[2] - end[2]
    c, s = math.cos(turn), math.sin(turn)
    local = np.array(
        [away[0] - c * end[0] + s * end[1], away[1] - s * end[0] - c * end[1], turn, start[3]]
    )
    local[2] += start[2]
    widths = np.array([*rng.uniform(0.1, 0.3, 2), rng.uniform(0.1, 0.4), 1.1])
    jackknife = trailer.jackknife if rng.random() < 0.5 else math.pi
    return local, controls, times, count, Aim(cart, beta, widths, pairs, gain, steps, jackknife)


@CARTS
def test_words_on_a_lattice_and_their_endings_are_as_recorded(cart, as_recorded):
    cart = normalised(cart)
    words = words_of(cart, 2, 2.3, 0.3)
    as_recorded(words._asdict(), "words")
    as_recorded(within_jackknife(words, [0.7, -1.4, 0.2], 1.1).sum(axis=0), "within a limit")
    endings = endings_of(cart, words, 2.9, 4.7, 0.13)
    as_recorded(
        [[each.control, each.numbers, each.lengths, each.shifts, each.maps] for each in endings],
        "endings",
    )


@CARTS
def test_the_first_steps_to_the_least_time_are_as_recorded(cart, as_recorded):
    rng = np.random.default_rng(21)
    told = []
    for _ in range(30):
        start, controls, times, count, aim = near_case(rng, cart, 0)
        state, gaps, slopes = np.empty(5), np.empty(4), np.empty((5, count))
        widest = linear_steps._ends(start, controls, times, count, aim, state, gaps, slopes)
        one = [widest, *gaps, *slopes.ravel()]
        square = np.empty((7, 4))
        for most in (0, 1, 3):
            held = times.copy()
            work = (state, gaps, slopes, square)
            one.append(linear_steps._bring_in(start, controls, held, count, aim, most, *work))
            one += held[:count].tolist()
        for steps in (1, 2, 3, 30):
            held = times.copy()
            one.append(shorten(start, controls, held, count, aim._replace(steps=steps)))
            one += held[:count].tolist()
        told.append(np.array(one))
    as_recorded([[each[np.isfinite(each)], np.isfinite(each).sum()] for each in told])


@CARTS
def test_words_with_more_switches_are_as_recorded(cart, as_recorded):
    rng = np.random.default_rng(22)
    told, bounds = [], []
    for _ in range(25):
        start, controls, times, count, aim = near_case(rng, cart, 25, gain=1e-4)
        total = shorten(start, controls, times, count, aim)
        if not math.isfinite(total):
            continue
        count = merge(controls, times, count)
        more, more_times = np.zeros((ROOM, 2)), np.zeros(ROOM)
        many = linear_steps._with_more_switches(controls, times, count, aim.pairs, more, more_times)
        bounds.append(linear_steps._keep_cheap(start, more, more_times, many, count, aim)[1])
        for rounds, most in ((1, ROOM), (1, 4), (3, ROOM)):
            held, spent = controls.copy(), times.copy()
            told.append(refine(start, held, spent, count, total, aim, rounds, most)[0])
    as_recorded(np.array(told), "times", relative=1e-5)
    as_recorded(np.array(bounds), "bounds", relative=1e-5)


@CARTS
def test_times_of_entry_on_a_plane_of_nodes_are_as_recorded(cart, as_recorded):
    """A box that is turned, with heading and beta of its own, and nodes around it."""
    cart = normalised(cart)
    words = words_of(cart, 2, 2.0, 0.25)
    betas, thetas = np.array([0.3, -0.5, 1.2]), np.array([0.1, -1.0, 2.9])
    allowed = within_jackknife(words, betas, cart.jackknife)
    scale = np.array([2.6, 2.6, 1.0, 1.0])
    told = []
    for box, widths, limited in (
        ([5.3, 4.8, 0.4, 0.15], [0.9, 0.6, 0.3, 0.35], False),
        ([5.3, 4.8, -2.2, -0.3], [0.6, 0.8, 0.5, math.inf], True),
        ([4.6, 5.1, 1.3, 0.2], [0.7, 0.7, math.inf, 0.4], True),
    ):
        table = np.full((3, 3, 9, 11), np.inf, dtype=np.float32)
        found = np.zeros(table.shape, dtype=np.int32)
        for each in endings_of(cart, words, 2.6, 3.0, 0.1):
            first = each.words.ends * scale, each.words.maps, allowed[each.numbers], each.lengths
            last = each.shifts * scale[:3], each.maps, np.array(box), np.array(widths)
            enter_box(table, found, thetas, half_angles(betas), *first, *last, 0.1, limited, 1000)
        told.append(table.astype(float))
        assert (found[np.isfinite(table) & (table > 0)] >= 1000).all()
    as_recorded(told, relative=2e-6)


@pytest.mark.parametrize("heading", [0.5, -2.4])
@CARTS
def test_quickest_words_of_three_arcs_are_as_recorded(cart, heading, as_recorded):
    rng = np.random.default_rng(23)
    radius = cart.radius
    told = []
    for _ in range(8):
        away, aside = rng.uniform([1.5, -0.8], [3.5, 0.8]) * radius
        c, s = math.cos(heading), math.sin(heading)
        x, y = 0.3 + c * away - s * aside, -0.4 + s * away + c * aside
        goal = Goal(state=(x, y, heading, 0.2), tolerance=(0.2 * radius, 0.3 * radius, 0.25, 0.3))
        start = (0.3, -0.4, heading + rng.uniform(-0.9, 0.9), rng.uniform(-1.2, 1.2))
        word = quickest_word(cart, start, goal, 1 / 8)
        told.append(None if word is None else [*word.controls.ravel(), *word.durations])
    as_recorded(told, relative=1e-5)


def test_a_word_as_a_path_is_as_recorded(as_recorded):
    word = ArcWord(np.array([[2.1, 1.4], [-2.1, 0.0], [2.1, -1.4]]), np.array([1.3, 0.01, 0.77]))
    path = word_path(REVERSE, (0.3, -0.2, 2.8, -0.6), word)
    as_recorded([path.times, path.states, path.controls])
    assert word.time == pytest.approx(2.08)


@CARTS
def test_shortest_words_by_the_general_solver_are_as_recorded(cart, as_recorded):
    rng = np.random.default_rng(24)
    told, times = [], []
    for width in (0.0, 0.3, math.inf):
        for _ in range(3):
            start, controls, held, count, aim = near_case(rng, cart, 0)
            units = [cart.speed, cart.turn_rate]
            word = ArcWord(controls[:count] * units, held[:count] / cart.turn_rate)
            state = start * [cart.radius, cart.radius, 1.0, 1.0]
            goal = Goal(
                state=(0.0, 0.0, 0.0, aim.beta), tolerance=(0.3, 0.4, min(width, 0.5), width)
            )
            found = shortened(cart, state, word, goal)
            told.append(None if found is None else found.time)
            more = shortest(cart, state, word, goal)
            times.append(None if more is None else more.time)
    as_recorded(told, "as they are", relative=1e-3)
    as_recorded(times, "with more switches", relative=1e-3)


@CARTS
def test_drawn_words_are_as_recorded(cart, as_recorded):
    start, goal = (
        (3.0, -4.5, 2.5, 0.8),
        Goal(state=(1.0, 2.0, 0.7, 0.2), tolerance=(0.3, 0.4, 0.3, 0.5)),
    )
    as_recorded(
        [
            [each.controls, each.durations]
            for each in candidates.scattered_words(cart, start, goal, 9)
        ],
        "anywhere",
    )
    as_recorded(
        [
            [each.controls, each.durations]
            for gear in (1, -1)
            for each in candidates.manoeuvre_words(cart, start, goal, gear, 4)
        ],
        "manoeuvres",
    )
    as_recorded(
        [
            [each.controls, each.durations]
            for each in candidates.car_words(cart, start, goal, longest=8.0)
        ],
        "of a car",
    )
    drawn = candidates.drawn_words(cart, start, goal, count=400)
    as_recorded([[each.controls, each.durations] for each in drawn], "into the box", relative=1e-3)


def test_the_first_corrections_of_drawn_words_are_as_recorded(as_recorded):
    rng = np.random.default_rng(25)
    for cart in (FORWARD, REVERSE):
        told = []
        for number in range(12):
            start, controls, times, count, aim = near_case(rng, cart, 0)
            bound = np.array([True, True, number % 3 > 0, number % 2 > 0])
            widths = np.where(bound, aim.widths, 0.0)
            pairs, held = controls[None, :6].copy(), times[None, :6].copy()
            misses, windings = np.empty(1), np.empty((1, 2), int)
            start[0] *= 1 + number % 4
            candidates._bring_in(
                start,
                pairs,
                held,
                np.array([count]),
                aim.cart,
                aim.beta + 2 * (number % 5 == 0),
                widths,
                bound,
                misses,
                windings,
            )
            settled = misses[0] < 0.5
            told.append([*windings[0], *(held[0] if settled else []), settled])
        as_recorded(told, f"reverse {cart.reverse}", relative=1e-4, absolute=1e-5)
