"""Figures of plans and of the model of carts, and tables of fleets, are as they were recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.yield_map import YieldMap
from sightfield.systems.numerics.harvest.fleets.cart_rounds import WorkAhead, run_carts, work_ahead
from sightfield.systems.numerics.harvest.fleets.figures import figures_of_plan
from sightfield.systems.numerics.harvest.fleets.fleet_table import fleet_table
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_combines, plan_harvest
from sightfield.systems.numerics.harvest.trucks import TruckFleet

GROWN = YieldMap(np.array([-3.0, 4.0]), 47.0, np.array([[1.1, 1.9, 1.4], [2.1, 0.8, 1.7]]))
TEAM = [
    Combine(header_width=7.5, speed=1.6, capacity=4100.0, unload_rate=95.0),
    Combine(header_width=7.5, speed=1.4, capacity=3600.0, acceleration=0.45, mass=15100.0),
]


def test_figures_of_a_harvest_are_as_recorded(as_recorded):
    """Carts are few and trucks small, so that all wait for all."""
    trucks = TruckFleet(count=1, capacity=3900.0, road_time=130.0)
    plan = plan_harvest(
        Field.rectangle(131.0, 93.0, margin=24.0),
        TEAM,
        Cart(capacity=7700.0, hitch_offset=0.2),
        carts=1,
        density=GROWN,
        truck_rate=140.0,
        trucks=trucks,
    )
    found = figures_of_plan(plan, trucks)
    assert found.combines_for_carts > 0
    assert found.carts_for_trucks > 0
    as_recorded(found)
    as_recorded([found.machines, found.fuel, found.engine_hours], "sums")
    as_recorded(figures_of_plan(plan, TruckFleet()).trucks, "trucks")


def test_a_table_of_fleets_is_as_recorded(as_recorded):
    told = []
    table = fleet_table(
        Field.rectangle(171.0, 127.0),
        TEAM,
        Cart(capacity=6100.0, speed=5.2),
        TruckFleet(capacity=3900.0, road_time=610.0),
        density=0.83,
        truck_rate=190.0,
        threshold=0.6,
        most=(2, 2),
        progress=lambda stage, share: told.append((stage, share)),
    )
    as_recorded([table, told])


@pytest.mark.parametrize("capacity", [np.inf, 5100.0])
def test_fleets_of_which_some_cannot_do_it_are_as_recorded(as_recorded, capacity):
    """On a margin of few metres there is no place for a second cart's truck, or none at all."""
    field = Field.rectangle(61.0, 53.0, margin=9.0)
    team = plan_combines(field, TEAM[:1])
    table = fleet_table(
        field,
        [TEAM[0]] * 3,
        Cart(),
        TruckFleet(capacity=capacity),
        density=0.7,
        truck_rate=200.0,
        most=(5, 1),
        planned={1: team},
    )
    as_recorded([table.knee, [(r.combines, r.carts, r.trucks, r.makespan) for r in table.rows]])
    as_recorded(table.refused, "refused")
    as_recorded(work_ahead(team, 0.7), "work")


def uneven(rng, count, capacity):
    """A combine that cuts now more, now less, here and there, with room beside it at times."""
    cut = np.cumsum(rng.uniform(0.0, 21.0, count))
    places = np.cumsum(rng.uniform(-1.5, 1.5, (count, 2)), axis=0) + rng.uniform(-90, 90, 2)
    beside = np.repeat(rng.random(count // 40 + 1) < 0.55, 40)[:count]
    following = np.where(beside, np.arange(count), count)
    opens = np.minimum.accumulate(following[::-1])[::-1]
    return WorkAhead(cut, places, opens, count - 2.3)


@pytest.mark.parametrize("seed", range(5))
def test_rounds_of_carts_are_as_recorded(as_recorded, seed):
    rng = np.random.default_rng([9, seed])
    team = [
        Combine(capacity=rng.uniform(2500, 5000), unload_rate=rng.uniform(60, 120))
        for _ in range(1 + seed % 3)
    ]
    work = [uneven(rng, 1300 + 211 * n, each.capacity) for n, each in enumerate(team)]
    places = rng.uniform(-150.0, 150.0, (1 + seed // 2, 2))
    cart = Cart(capacity=rng.uniform(5500.0, 12000.0), speed=4.7)
    trucks = TruckFleet(count=1 + seed % 2, capacity=5200.0, road_time=310.0)
    as_recorded(run_carts(work, team, cart, places, trucks, 115.0, 0.3 + 0.15 * seed))


def test_a_tank_that_is_full_when_its_combine_parks_is_no_miss():
    def rounds(capacity):
        cut = np.minimum(10.0 * np.arange(103), 1000.0)
        work = WorkAhead(cut, np.zeros((103, 2)), np.full(103, 103), 100.0)
        combine = Combine(capacity=capacity, unload_rate=100.0)
        return run_carts([work], [combine], Cart(), np.ones((1, 2)), TruckFleet(), 100.0, 1.0)

    just, over = rounds(1000.0), rounds(990.0)
    assert (just.misses, just.ends[0], just.visits) == (0, 100.0, 1)
    assert (over.misses, over.visits) == (1, 2)
    assert over.ends[0] > 100.0
