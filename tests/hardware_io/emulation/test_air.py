"""The air loses, delays and reorders as it is told, and the same seed does it again."""

import math

import numpy as np
import pytest

from sightfield.hardware_io.emulation.air import Air, AirSettings, Flight
from sightfield.systems.numerics.errors import InvalidInput


def broadcast(number: int) -> Flight:
    return Flight(0, 1, number.to_bytes(2, "big"), True)


def unicast(number: int) -> Flight:
    return Flight(0, 1, number.to_bytes(2, "big"), False)


def test_clear_air_delivers_all_in_order_and_late():
    air = Air(AirSettings(delay=0.05), seed=0)
    for k in range(20):
        air.send(broadcast(k), 0.01 * k)
    assert air.arrivals(0.0499) == []
    assert air.next_arrival() == pytest.approx(0.05)
    assert air.arrivals(1.0) == [broadcast(k) for k in range(20)]
    assert air.next_arrival() == math.inf


def test_a_tenth_is_lost_of_what_goes_to_all():
    air = Air(AirSettings(frame_loss=0.1), seed=0)
    assert all(air.send(broadcast(k % 65536), 0.0) for k in range(10_000))
    # Five standard deviations of a binomial.
    assert len(air.arrivals(1.0)) == pytest.approx(9000, abs=150)


def test_what_goes_to_one_is_tried_four_times_and_its_loss_is_known():
    air = Air(AirSettings(frame_loss=0.5), seed=0)
    known = [air.send(unicast(k), 0.0) for k in range(10_000)]
    assert len(air.arrivals(1.0)) == sum(known) == pytest.approx(10_000 * 15 / 16, abs=125)


def test_jitter_lets_frames_overtake():
    air = Air(AirSettings(delay=0.01, jitter=0.05), seed=1)
    for k in range(50):
        air.send(broadcast(k), 0.01 * k)
    numbers = [int.from_bytes(flight.payload, "big") for flight in air.arrivals(2.0)]
    assert numbers != sorted(numbers)
    assert sorted(numbers) == list(range(50))


def test_cut_air_loses_what_is_sent_and_what_is_on_its_way():
    air = Air(AirSettings(delay=0.05), seed=0)
    air.send(broadcast(1), 0.0)
    air.cut = True
    assert not air.send(unicast(2), 0.01)
    assert air.send(broadcast(3), 0.01)
    assert air.arrivals(0.2) == []
    air.cut = False
    air.send(broadcast(4), 0.3)
    assert air.arrivals(1.0) == [broadcast(4)]


def test_a_seed_decides_what_is_lost():
    def delivered(seed):
        air = Air(AirSettings(frame_loss=0.5, jitter=0.1), seed)
        for k in range(100):
            air.send(broadcast(k), 0.0)
        return air.arrivals(1.0)

    assert delivered(3) == delivered(3)
    assert delivered(3) != delivered(4)


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"frame_loss": 1.1}, "frame_loss"),
        ({"frame_loss": np.nan}, "frame_loss"),
        ({"delay": -0.1}, "delay"),
        ({"jitter": -0.1}, "jitter"),
        ({"rssi": 5}, "rssi"),
    ],
)
def test_air_that_is_none_is_refused(wrong, name):
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        AirSettings(**wrong)


def test_what_is_kept_arrives_when_it_is_let_go_in_the_order_asked_for():
    air = Air(AirSettings(delay=0.5), 0)
    flights = [Flight(0, 1, bytes([k]), True) for k in range(3)]
    air.send(flights[0], 0.0)
    air.keep()
    for each in flights[1:]:
        air.send(each, 0.1)
    assert air.kept() == flights[1:]
    assert air.arrivals(0.4) == []
    air.let_go(lambda kept: [*reversed(kept), kept[0]])
    assert air.arrivals(0.4) == [flights[2], flights[1], flights[1]]
    assert air.arrivals(0.5) == [flights[0]]
    air.send(flights[2], 1.0)
    assert (air.kept(), air.arrivals(1.4), air.arrivals(1.5)) == ([], [], [flights[2]])
