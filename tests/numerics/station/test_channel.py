"""What goes through a channel comes late, rounded, or never; but never altered or out of turn.

How old is too old.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.channel import (
    Channel,
    empty_flight,
    freshness,
    received,
    send,
)


def run(channel, ticks, values, looks):
    """Send `values(tick)` at each tick; what was received at each time of `looks` beyond it."""
    flight = empty_flight(channel, np.full_like(values(0), -1.0))
    seen = []
    for tick in range(ticks):
        flight = send(channel, flight, tick, values(tick))
        seen += [received(flight, tick * channel.period + look) for look in looks]
    return seen


def ramp(tick):
    """The number of the tick, for three members of two numbers."""
    return np.full((3, 2), float(tick))


def test_a_perfect_channel_gives_what_was_sent_at_once():
    for tick, (values, stamps) in enumerate(run(Channel(period=0.1), 5, ramp, [0.0])):
        assert np.array_equal(values, ramp(tick))
        assert stamps == pytest.approx(0.1 * tick)


def test_nothing_is_received_before_the_first_sample():
    values, stamps = received(empty_flight(Channel(), np.full((2, 3), 7.0)), 100.0)
    assert np.array_equal(values, np.full((2, 3), 7.0))
    assert (stamps == -np.inf).all()


def test_a_delay_is_kept_to_the_moment():
    channel = Channel(period=0.1, delay=0.25)
    seen = run(channel, 6, ramp, [0.04, 0.06])
    # At 0.54 s the sample of 0.3 s is under way still; at 0.56 s it has come.
    assert seen[-2][0][0, 0] == 2
    assert seen[-1][0][0, 0] == 3


def test_losses_are_as_frequent_as_stated_and_apart_for_each_member():
    channel = Channel(period=1.0, dropout=0.3, seed=4)
    stamps = np.array([stamps for _, stamps in run(channel, 3000, ramp, [0.0])])
    arrived = stamps == np.arange(3000)[:, None]
    # 0.7 within four standard deviations, and both lost as often as independence says.
    assert arrived.mean(axis=0) == pytest.approx(0.7, abs=4 * np.sqrt(0.21 / 3000))
    assert (~arrived[:, 0] & ~arrived[:, 1]).mean() == pytest.approx(0.09, abs=0.025)


def test_a_channel_that_loses_everything_says_what_it_said_first():
    seen = run(Channel(dropout=1.0), 50, ramp, [0.0])
    assert all((values == -1).all() and (stamps == -np.inf).all() for values, stamps in seen)


def test_values_are_rounded_to_the_quantum():
    (values, _), *_ = run(Channel(quantum=0.25), 1, lambda tick: np.array([[0.3, -1.13]]), [0.0])
    assert values.tolist() == [[0.25, -1.25]]


def test_the_same_seed_repeats_a_run_exactly():
    channel = Channel(delay=0.02, jitter=0.05, dropout=0.4, seed=3)
    first, again = (np.array([s for _, s in run(channel, 200, ramp, [0.0])]) for _ in range(2))
    other = np.array([s for _, s in run(Channel(jitter=0.05, dropout=0.4), 200, ramp, [0.0])])
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


@given(
    delay=st.floats(0, 0.3),
    jitter=st.floats(0, 0.3),
    dropout=st.floats(0, 0.9),
    seed=st.integers(0, 1000),
    look=st.floats(0, 0.09),
)
def test_what_is_received_was_sent_at_its_stamp_and_is_never_older_than_before(
    delay, jitter, dropout, seed, look
):
    channel = Channel(period=0.1, delay=delay, jitter=jitter, dropout=dropout, seed=seed)
    before = np.full(3, -np.inf)
    for tick, (values, stamps) in enumerate(run(channel, 30, ramp, [look])):
        known = np.isfinite(stamps)
        assert np.array_equal(values[known, 0], np.rint(stamps[known] / 0.1))
        assert (stamps[known] <= 0.1 * tick + look - delay + 1e-9).all()
        assert (stamps >= before).all()
        before = stamps


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"period": 0.0}, "`period` must be 0.001 at least; got 0.0"),
        ({"delay": 1e9}, "`delay` must be 60 with the jitter at most"),
        ({"dropout": 1.5}, "`dropout` must lie in"),
        ({"jitter": -1.0}, "`jitter` must be zero or positive; got -1.0"),
        ({"delay": float("nan")}, "`delay` must be a finite number; got nan"),
    ],
)
def test_a_channel_that_cannot_be_is_refused(setting, message):
    with pytest.raises(InvalidInput, match=message):
        Channel(**setting)


def test_valid_up_to_the_limit_and_not_beyond():
    valid, ages = freshness(10.0, np.array([9.95, 9.9, 9.89]), 0.1)
    assert valid.tolist() == [1, 1, 0]
    assert np.allclose(ages, [0.05, 0.1, 0.11])


def test_what_was_never_seen_is_infinitely_old():
    valid, ages = freshness(10.0, np.array([-np.inf]), 1e9)
    assert (valid[0], ages[0]) == (0, np.inf)


def test_a_stamp_of_the_future_is_new():
    valid, ages = freshness(1.0, np.array([1.5]), 0.1)
    assert (valid[0], ages[0]) == (1, 0)
