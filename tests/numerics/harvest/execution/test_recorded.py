"""What drivers are told of a plan, and what comes of it late and on time, is as it was recorded."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.carts.cart_plan import Failure, Supply
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.execution.advance import (
    Disturbance,
    advance,
    drive_on,
    factor_at,
    pace_of,
)
from sightfield.systems.numerics.harvest.execution.fleet import cut_up_to
from sightfield.systems.numerics.harvest.execution.orders import hold_by
from sightfield.systems.numerics.harvest.execution.planned_work import PlannedWork
from sightfield.systems.numerics.harvest.execution.unloading import (
    Loads,
    full_hold,
    loads_of,
    place_beside,
    pour_alongside,
    rest_of,
    tie_hold,
    wanted_at,
    wanted_by,
    work_together,
)
from sightfield.systems.numerics.harvest.field.yield_map import YieldMap
from sightfield.systems.numerics.harvest.machines import COLUMNS, CUT, LOST, STATION, TANK, Cart
from sightfield.systems.numerics.harvest.trucks import TruckFleet

GROWN = YieldMap(np.array([-3.0, 4.0]), 47.0, np.array([[1.0, 1.8, 1.5], [2.2, 0.9, 1.6]]))


@pytest.fixture(scope="module")
def crowded():
    """Two combines, two carts that trucks hold up, and other grain than was expected."""
    made = runpy.run_path(str(Path(__file__).parents[1] / "carts" / "conftest.py"))[
        "make_hand_made"
    ](126.0, 100.0, 2)
    cart = Cart(capacity=12000.0, hitch_offset=0.3, length=5.4, turning_radius=5.5)
    supply = Supply(
        density=1.7,
        trucks=np.array([[60.0, -13.0, 0.1], [100.0, -14.0, 0.0]]),
        truck_rate=170.0,
        truck_fleet=TruckFleet(capacity=7000.0, road_time=240.0),
    )
    second = replace(made.combine, capacity=8000.0, unload_rate=105.0, when_full="spill")
    team = [made.combine, second]
    plan = serve_combines(made.field, team, cart, made.plans, made.swaths, supply, made.retime)
    return PlannedWork(
        field=made.field,
        combines=team,
        cart=cart,
        supply=supply,
        plans=plan.plans,
        motions=plan.motions,
        visits=plan.visits,
        trips=plan.trips,
        grown=GROWN,
    )


def test_what_drivers_are_told_is_as_recorded(crew_of, crowded, as_recorded):
    crew, times = crew_of(crowded), np.arange(0.0, crowded.end, 41.3)
    as_recorded(crew.orders, "orders")
    as_recorded(crew.fleet, "fleet")
    as_recorded(crew.tracks, "tracks")
    as_recorded([crowded.tanks_at(times), crowded.loads_at(times), crowded.end], "loads")
    as_recorded([crowded.cutting_stations, crowded.starts], "ground")
    as_recorded([[s.stations, s.discs, s.margins] for s in crowded.sweeps], "sweeps")


@pytest.mark.parametrize("late", [None, Disturbance(slowness=0.2, stops=6.0, seed=4)])
def test_a_harvest_is_driven_as_recorded(crew_of, crowded, as_recorded, late):
    driven = crew_of(crowded, step=0.5).run(late)
    assert driven.arrived
    rows = slice(None, None, 200)
    as_recorded(
        {
            "end": driven.times[-1],
            "stations": driven.stations[rows],
            "tank": driven.tank[rows],
            "load": driven.load[rows],
            "cut": driven.cut[rows],
            "lost": driven.lost[-1],
            "delivered": driven.delivered[rows],
        },
        relative=1e-5,
    )


def test_a_late_cart_and_its_combine_drive_as_recorded(crew_of, served, as_recorded):
    driven = crew_of(served, step=0.5).run(Disturbance(slowness=0.3, stops=5.0, seed=7))
    assert driven.arrived
    rows = slice(None, None, 200)
    as_recorded(
        [driven.times[-1], driven.stations[rows], driven.tank[rows], driven.load[rows]],
        relative=1e-5,
    )


def anywhere(crew, rng):
    """A state in which the machines of one visit are near to it, and the others are anywhere."""
    ties, fleet = crew.orders.ties, crew.fleet
    stations = rng.uniform(0.0, crew.ends)
    t = int(rng.integers(len(ties.machines)))
    for side in (0, 1):
        low, high = ties.begins[t, side], ties.ends[t, side]
        near = rng.uniform(low - 25.0, high + 9.0)
        if rng.random() < 0.4:
            near = rng.choice([low, high, (low + high) / 2])
        stations[ties.machines[t, side]] = max(near, 0.0)
    speeds = rng.uniform(0.0, 1.5, len(stations)) * (rng.random(len(stations)) < 0.7)
    count, carts = fleet.combines, len(stations) - fleet.combines
    tank = rng.uniform(0.0, fleet.capacities)
    cut = np.array([cut_up_to(fleet, n, stations[n]) for n in range(count)])
    tank = np.minimum(tank, cut) * (rng.random(count) < 0.8)
    room, load = rng.uniform(0.0, 9000.0, carts), rng.uniform(0.0, 3000.0, carts)
    loads = Loads(tank, cut - tank, rng.uniform(0.0, 200.0, count), room, load)
    return stations, speeds, loads


def test_what_holds_machines_back_anywhere_is_as_recorded(crew_of, crowded, as_recorded):
    crew, rng = crew_of(crowded), np.random.default_rng(41)
    fleet, ties = crew.fleet, crew.orders.ties
    holds, rests, wanted, steps = [], [], [], []
    paces = [pace_of(Disturbance()), pace_of(Disturbance(slowness=0.3, stops=3.0, seed=3))]
    for k in range(160):
        stations, speeds, loads = anywhere(crew, rng)
        rests.append([rest_of(fleet, ties, loads, stations, t) for t in range(len(ties.given))])
        for m in range(len(stations)):
            holds.append(
                [
                    tie_hold(fleet, ties, loads, stations, speeds, m, trusts)
                    for trusts in (True, False)
                ]
                + [place_beside(fleet, ties, stations, speeds, m, 0.5)]
            )
            if m < fleet.combines:
                full = fleet._replace(spill=np.array([False, False]))
                holds[-1] += [full_hold(f, loads, stations[m], m) for f in (fleet, full)]
            others = [n for n in range(len(stations)) if n != m]
            holds[-1] += [hold_by(crew.orders, m, n, stations[n]) for n in others]
        wanted.append(np.concatenate(wanted_by(fleet, ties, loads, stations)))
        alongside = rng.integers(-1, 2, fleet.combines)
        pour_alongside(fleet, ties, loads, stations, alongside)
        wanted.append(loads.free.copy())
        now = float(rng.uniform(0.0, crowded.end + 60.0))
        steps.append(
            np.concatenate(
                advance(fleet, crew.orders, paces[k % 2], loads, stations, speeds, now, 0.4)
            )
        )
    flat = np.array([each for row in holds for each in row])
    assert 0.2 < np.isfinite(flat).mean() < 0.9
    as_recorded([flat[k::7] for k in range(7)], "holds")
    as_recorded([np.array(rests), np.concatenate(wanted)], "grain")
    as_recorded([np.array(steps)[k::5] for k in range(5)], "steps")


def test_work_of_combines_anywhere_is_as_recorded(crew_of, crowded, as_recorded):
    crew, rng = crew_of(crowded), np.random.default_rng(42)
    fleet, found = crew.fleet, []
    for _ in range(60):
        stations, _, loads = anywhere(crew, rng)
        stations = np.minimum(stations, crew.ends)
        accounts = np.zeros((2, COLUMNS))
        accounts[:, STATION], accounts[:, TANK] = stations[:2], loads.tank
        accounts[:, CUT] = loads.tank + loads.given + 7.0
        accounts[:, LOST] = 7.0
        after = np.minimum(
            stations[:2] + rng.uniform(0, 2, 2) * (rng.random(2) < 0.7), crew.ends[:2]
        )
        if rng.random() < 0.5:
            accounts[:, TANK] = fleet.capacities - rng.uniform(-1e-9, 3.0, 2)
        given = rng.uniform(0.0, 5.0, 2)
        carts = rng.integers(-1, 2, 2)
        work_together(fleet, accounts, after, crew.ends[:2], carts, loads.room, given, 0.7)
        found.append(np.concatenate([accounts.ravel(), given]))
        told = loads_of(accounts.ravel(), loads.room, loads.load)
        found.append(np.concatenate([told.tank, told.given, told.free]))
    as_recorded([np.concatenate(found[k::4]) for k in range(4)])


def test_drivers_that_are_told_by_ports_drive_alike(crew_of, crowded):
    """`drive_on` and `wanted_at` take what the ports say, and give what their parts give."""
    crew, rng = crew_of(crowded), np.random.default_rng(43)
    fleet, ties, pace = crew.fleet, crew.orders.ties, pace_of(Disturbance(slowness=0.2, seed=5))
    for _ in range(20):
        stations, speeds, loads = anywhere(crew, rng)
        accounts = np.zeros((2, COLUMNS))
        accounts[:, TANK], accounts[:, LOST] = loads.tank, 3.0
        accounts[:, CUT] = loads.tank + loads.given + 3.0
        alongside, carts = rng.integers(-1, 2, 2), np.concatenate([stations[2:], speeds[2:]])
        now = float(rng.uniform(0.0, crowded.end))
        found = drive_on(
            fleet, crew.orders, pace, stations[:2], speeds[:2], accounts.ravel(),
            alongside, loads.room, loads.load, carts, now, 0.5,
        )  # fmt: skip
        wanted = wanted_at(fleet, ties, stations[:2], accounts.ravel(), loads.room, carts)
        assert np.array(wanted) == pytest.approx(np.array(wanted_by(fleet, ties, loads, stations)))
        pour_alongside(fleet, ties, loads, stations, alongside)
        stepped = advance(fleet, crew.orders, pace, loads, stations, speeds, now, 0.5)
        assert found == pytest.approx(np.concatenate(stepped), abs=1e-9)


def test_what_is_random_of_machines_is_as_recorded(as_recorded):
    pace = pace_of(Disturbance(slowness=0.25, stops=4.0, longest_stop=90.0, seed=9))
    assert pace.chance == pytest.approx(4.0 * 600.0 / 3600.0)
    times = np.arange(0.0, 7200.0, 7.9)
    as_recorded([np.array([factor_at(pace, m, t) for t in times]) for m in (0, 1, 5)])


def test_disturbances_up_to_their_limits_are_taken():
    assert Disturbance(slowness=0.999, stops=6.0, longest_stop=600.0, fails_at=0.0).stops == 6.0
    assert Disturbance().failure is None
    assert Disturbance(failing_cart=0, fails_at=7.0).failure == Failure(0, 7.0)
    assert Disturbance(stops=3.0, longest_stop=0.0).is_none
    assert not Disturbance(slowness=0.1, longest_stop=0.0).is_none
    assert pace_of(Disturbance(stops=3.0, longest_stop=0.0)).undisturbed
