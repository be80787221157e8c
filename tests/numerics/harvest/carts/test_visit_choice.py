"""Whom a cart serves next, by hand: tanks that fill evenly, windows, ways of known lengths."""

import ast
from pathlib import Path

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.carts import visit_choice
from sightfield.systems.numerics.harvest.carts.tanks import Pour, Tank
from sightfield.systems.numerics.harvest.carts.visit_choice import (
    Attempt,
    Beginnings,
    FreeCart,
    Outlook,
    choose_visits,
)
from sightfield.systems.numerics.harvest.machines import Combine

COMBINE = Combine(capacity=8000.0, unload_rate=100.0, header_width=8.0, speed=1.5)
DENSITY = 0.75
RATE = 9.0
TIMES = np.arange(0.0, 3001.0)
# Node 0 is where carts stand; node n + 1 is near combine n.
WAY = 60.0


def tank_with(load):
    return Tank(COMBINE, TIMES, load + RATE * TIMES)


def windows_of(*spans):
    """One window of each combine, (begin, end), looked at every five seconds."""
    times = [np.arange(begin, end, 5.0) for begin, end in spans]
    number = np.repeat(np.arange(len(spans)), [len(each) for each in times])
    until = np.array([end for _, end in spans])[number]
    order = np.argsort(np.concatenate(times), kind="stable")
    return Beginnings(np.concatenate(times), number, 10 + number, until, number + 1).chosen(order)


def outlook(loads, spans, *, strategy="on-demand", carts=1, turn=0, arrivals=None, room=np.inf):
    serves = range(len(loads))
    return Outlook(
        [COMBINE] * len(loads),
        DENSITY,
        [tank_with(load) for load in loads],
        windows_of(*spans),
        [FreeCart(k, 0, 0.0, room, serves, turn) for k in range(carts)],
        arrivals or (lambda node, time: np.full(len(loads) + 1, time + WAY)),
        strategy,
        0.5,
    )


def test_the_choice_knows_at_most_four_modules_of_the_harvest():
    source = Path(visit_choice.__file__).read_text(encoding="utf-8")
    froms = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
    # `.` is its own room, `..` the harvest; `...` is beyond.
    assert 1 <= sum(1 for node in froms if 1 <= node.level <= 2) <= 4


@pytest.mark.parametrize("fullest", [0, 1, 2])
def test_on_demand_the_fullest_tank_comes_first(fullest):
    loads = [900.0, 900.0, 900.0]
    loads[fullest] = 3200.0
    first = next(choose_visits(outlook(loads, [(100.0, 900.0)] * 3)))
    # Half full after (4000 - 3200) / 9 = 89 s, when a window begins at 100 s.
    assert first == Attempt(0, fullest, 10 + fullest, 100.0)


def test_carts_come_when_half_a_tank_is_full_and_not_before_they_can():
    first = next(choose_visits(outlook([700.0], [(20.0, 800.0)])))
    assert first == Attempt(0, 0, 10, 370.0)
    # A way of 400 s, and some time to come beside it.
    slow = outlook([700.0], [(20.0, 800.0)], arrivals=lambda node, time: np.full(2, time + 400.0))
    later = next(choose_visits(slow))
    assert isinstance(later, Attempt)
    assert 400.0 < later.begin <= 410.0


def test_a_cart_that_hurries_comes_as_early_as_it_is_of_use():
    """To a tank of which a tenth, 800 kg, is full at 34 s: the cart is there at 65 s."""
    asked = outlook([500.0], [(20.0, 800.0)])
    hurried = list(choose_visits(asked._replace(hurries=True)))
    assert hurried[0] == Attempt(0, 0, 10, 65.0)
    begins = [each.begin for each in hurried if isinstance(each, Attempt)]
    assert begins == sorted(begins)
    usual = next(choose_visits(asked))
    assert isinstance(usual, Attempt)
    assert usual.begin == pytest.approx(390.0)


@pytest.mark.parametrize("turn", [0, 1, 2])
def test_in_turns_the_next_one_is_served(turn):
    spans = [(50.0, 700.0)] * 3
    first = next(
        choose_visits(outlook([2500.0] * 3, spans, strategy="sequential", turn=turn, carts=1))
    )
    assert isinstance(first, Attempt)
    assert first.combine == turn


def test_who_is_due_early_is_served_out_of_turn():
    # Combine 1 is full after (8000 - 6200) / 9 = 200 s, combine 0, whose turn it is, much later.
    two = outlook([4000.0, 6200.0], [(70.0, 400.0)] * 2, strategy="sequential")
    first = next(choose_visits(two))
    assert isinstance(first, Attempt)
    assert first.combine == 1
    assert first.begin < 200.0


def test_one_cart_comes_early_to_combines_that_fill_together():
    spans = [(65.0, 900.0)] * 2
    alone = next(choose_visits(outlook([500.0], spans[:1])))
    both = next(choose_visits(outlook([500.0, 500.0], spans)))
    assert isinstance(alone, Attempt)
    assert isinstance(both, Attempt)
    assert alone.begin == pytest.approx(390.0)
    # With two carts nobody has to hurry.
    pair = next(choose_visits(outlook([500.0, 500.0], spans, carts=2)))
    assert isinstance(pair, Attempt)
    assert pair.begin == alone.begin
    late = [(65.0, 420.0)] * 2
    hurried = next(choose_visits(outlook([500.0, 500.0], late)))
    assert isinstance(hurried, Attempt)
    # The second visit has to begin by 415 s, after the flow of grain, setting out and the way.
    assert hurried.begin < 415.0 - WAY - 25.0 - 500.0 / 100.0


def test_who_cannot_be_reached_before_the_tank_is_full_has_to_wait():
    far = outlook(
        [5000.0, 7000.0],
        [(50.0, 900.0)] * 2,
        arrivals=lambda node, time: np.full(3, np.inf),
    )
    assert list(choose_visits(far)) == [1]
    # A window that opens too late is no help.
    choices = list(choose_visits(outlook([6000.0, 1000.0], [(300.0, 900.0), (70.0, 900.0)])))
    assert choices[0] == 0


def test_all_attempts_are_for_some_use_and_apart():
    choices = list(choose_visits(outlook([2000.0], [(70.0, 600.0)])))
    attempts, waits = choices[:-1], choices[-1]
    assert waits == 0
    begins = np.sort([each.begin for each in attempts])
    assert 2 <= len(begins) <= 6
    assert np.diff(begins).min() >= 14.9
    # An empty tank is no reason to come.
    empty = outlook([0.0], [(70.0, 600.0)])
    empty.tanks[0].take(Pour(0.0, 1.0, float(empty.tanks[0].load[-1])))
    assert [each for each in choose_visits(empty) if isinstance(each, Attempt)] == []
