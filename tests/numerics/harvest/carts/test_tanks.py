"""Tanks over time, against sums by hand; and a combine that stops."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.carts.cart_plan import Stop
from sightfield.systems.numerics.harvest.carts.cut_times import cut_times
from sightfield.systems.numerics.harvest.carts.tanks import EMPTY, LAST_GRAIN, Tank, make_tanks
from sightfield.systems.numerics.harvest.field.yield_map import YieldMap
from sightfield.systems.numerics.harvest.machines import Combine


def load_at(tank, time):
    return float(np.interp(time, tank.times, tank.load))


def test_grain_is_in_the_tank_the_cart_or_still_standing(hand_made):
    made = hand_made(120.0, 90.0, 2)
    cut = cut_times(made.field, made.combine, made.plans)
    tanks = make_tanks(
        [made.combine] * len(made.plans), cut, 2.2, [plan.end for plan in made.plans]
    )
    total = sum(tank.left for tank in tanks)
    assert total == pytest.approx(2.2 * np.isfinite(cut.times).sum() * 0.25)
    tank = tanks[0]
    full = tank.full_at()
    assert load_at(tank, full - 1.0) < made.combine.capacity <= load_at(tank, full + 1e-9)
    # A straight of a full header fills it evenly.
    rate = (load_at(tank, 60.0) - load_at(tank, 30.0)) / 30.0
    assert rate == pytest.approx(2.2 * 9.0 * 1.5, rel=0.05)
    before = load_at(tank, 50.0)
    short = tank.pour(50.0, 53.0, np.inf)
    assert short.taken == pytest.approx(3 * made.combine.unload_rate)
    whole = tank.pour(50.0, 300.0, np.inf)
    gained = load_at(tank, whole.end) - before
    assert whole.taken == pytest.approx(before + gained)
    assert whole.end - 50.0 == pytest.approx(before / (made.combine.unload_rate - rate), abs=1.0)
    assert tank.pour(50.0, 300.0, 111.0).taken == pytest.approx(111.0)
    tank.take(whole)
    assert load_at(tank, whole.end) == pytest.approx(0.0, abs=1.5 * rate)
    assert sum(each.left for each in tanks) == pytest.approx(total - whole.taken)
    late = tank.pour(1e5, np.inf, np.inf)
    tank.take(late)
    assert tank.left == pytest.approx(0.0)


def test_tanks_fill_by_what_grows_where_they_are(hand_made):
    made = hand_made(120.0, 90.0, 2)
    cut = cut_times(made.field, made.combine, made.plans)
    yields = YieldMap(np.array([10.0, -3.0]), 50.0, np.array([[0.3, 1.1], [0.7, 0.4]]))
    tanks = make_tanks(
        [made.combine] * len(made.plans), cut, yields, [plan.end for plan in made.plans]
    )
    rows, columns = np.nonzero(np.isfinite(cut.times))
    places = cut.corner + 0.5 * (np.column_stack([columns, rows]) + 0.5)
    east, north = places[:, 0] >= 60.0, places[:, 1] >= 47.0
    there = np.select([~east & ~north, east & ~north, ~east & north], [0.3, 1.1, 0.7], 0.4)
    for number, tank in enumerate(tanks):
        assert tank.left == pytest.approx(there[cut.cutter[rows, columns] == number].sum() * 0.25)


def test_an_earlier_visit_leaves_what_a_later_one_takes_that_is_settled(hand_made):
    made = hand_made(120.0, 90.0, 1)
    cut = cut_times(made.field, made.combine, made.plans)
    tank = make_tanks(
        [made.combine] * len(made.plans), cut, 2.2, [plan.end for plan in made.plans]
    )[0]
    settled = tank.pour(70.0, np.inf, np.inf)
    tank.take(settled)
    # All that is there at 60 s, and what is cut until the later visit ends, is promised to that.
    assert load_at(tank, 60.0) > 1000.0
    early = tank.pour(60.0, 65.0, np.inf)
    assert early.taken < 100.0
    tank.take(early)
    assert tank.load.min() >= -1e-9


@pytest.mark.parametrize(
    ("begin", "latest", "room", "stays"),
    [
        (95.0, np.inf, np.inf, True),
        (109.5, np.inf, np.inf, True),
        # The work goes on for too long; the cart has to leave; it has no room for so much.
        (60.0, np.inf, np.inf, False),
        (95.0, 105.0, np.inf, False),
        (95.0, np.inf, 1050.0, False),
    ],
)
def test_a_cart_stays_for_the_last_grain_and_no_longer(begin, latest, room, stays):
    # 10 kg/s come in for 110 s, and 500 kg/s go out: all that is there in some two seconds.
    times = np.arange(0.0, 200.0)
    tank = Tank(Combine(unload_rate=500.0), times, 10.0 * np.minimum(times, 110.0))
    pour = tank.pour(begin, latest, room)
    if stays:
        assert 110.0 < pour.end <= 112.0
        assert pour.taken == 1100.0
    else:
        assert pour.end < begin + 3.0
        assert pour.taken < 1100.0
    assert pour.end <= begin + 3.0 + LAST_GRAIN


def test_a_visit_that_ends_while_the_last_grain_is_cut_leaves_it_to_another_one():
    times = np.arange(0.0, 200.0)
    tank = Tank(Combine(unload_rate=69.9), times, 10.0 * np.minimum(times, 110.4))
    # It has time until all is out, or it has to leave as soon as the last grain is there.
    whole, short = tank.pour(95.0, np.inf, np.inf), tank.pour(95.0, 111.0, np.inf)
    assert whole.end == 112.0
    assert whole.taken == tank.left
    assert short.end == 111.0
    assert EMPTY < tank.left - short.taken < 10.0
    tank.take(short)
    rest = tank.pour(150.0, np.inf, np.inf)
    assert rest.taken == pytest.approx(tank.left)
    # One that would leave all that there is does not come.
    assert tank.pour(110.0, 111.0, np.inf).taken == 0.0


@pytest.mark.parametrize("where", [0.02, 0.4, 0.999])
def test_a_combine_that_stops_brakes_stands_and_is_later(hand_made, where, stopped):
    made = hand_made(120.0, 90.0, 1)
    plan = made.plans[0]
    station = where * plan.path.length
    after = stopped(plan, Stop(0, station, 40.0), 0.5)
    fine = np.arange(0.0, after.end + 1.0, 0.1)
    standing = np.abs(after.station_at(fine) - station) < 1e-6
    assert standing.sum() * 0.1 == pytest.approx(40.0, abs=1.0)
    lasting = np.diff(after.times)
    rates = np.diff(after.speeds)[lasting > 0] / lasting[lasting > 0]
    assert np.abs(rates).max() < 0.55
    ways = np.diff(after.stations) - (after.speeds[1:] + after.speeds[:-1]) / 2 * lasting
    assert np.abs(ways).max() < 0.01
    # Braking and speeding up from 1.5 m/s cost 3 s, less where it was slow already.
    assert 40.0 <= after.end - plan.end <= 43.1
    early = fine[after.station_at(fine) < station - 3.0]
    assert after.station_at(early) == pytest.approx(plan.station_at(early))
