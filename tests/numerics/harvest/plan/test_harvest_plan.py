"""Whole plans of harvests, by the audit, which shares no code with them."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput, require
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.carts.windows import beside
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines.alongside import is_alongside
from sightfield.systems.numerics.harvest.machines.cart import Cart
from sightfield.systems.numerics.harvest.machines.combine import Combine
from sightfield.systems.numerics.harvest.no_plan import NoPlan
from sightfield.systems.numerics.harvest.plan import harvest_plan
from sightfield.systems.numerics.harvest.plan.combine_plan import plan_combines
from sightfield.systems.numerics.harvest.plan.harvest_plan import (
    NEAR_TRUCK,
    plan_harvest,
    truck_places,
)


@pytest.fixture(scope="module")
def logs():
    return runpy.run_path(str(Path(__file__).with_name("plan_logs.py")))


def assert_auger_reaches(plan, visit):
    combine, cart = plan.combines.size, plan.cart
    reach = beside(combine, cart).left
    motion, path = plan.service.motions[visit.cart], plan.service.plans[visit.combine]
    for time in np.linspace(visit.begin, visit.end, 5):
        state = np.append(motion.timed.pose_at([time])[0], motion.angles_at(np.array([time]))[0])
        pose, stands = path.pose_at([time])[0], path.speed_at([time])[0] < 1e-6
        assert is_alongside(pose, state, cart.length, cart.hitch_offset, reach, stands)


def checked(logs, plan):
    """The audit of a plan in which all grain is delivered and nobody is late for a visit."""
    audit = audit_harvest(logs["harvest_log_of"](plan), logs["harvest_site_of"](plan))
    assert audit.faults == ()
    figures, service = audit.figures, plan.service
    assert figures["min_cart_to_combine"] >= 0.5
    if len(service.motions) > 1:
        assert figures["min_cart_to_cart"] >= 0.5
    assert service.left == pytest.approx(0.0, abs=10.0)
    assert figures["grain_delivered"] == pytest.approx(figures["grain_harvested"], abs=10.0)
    for visit in service.visits:
        assert_auger_reaches(plan, visit)
    for trip in service.trips:
        pose = service.motions[trip.cart].timed.pose_at(np.array([trip.begin, trip.end]))
        assert np.abs(pose - plan.supply.trucks[trip.cart])[:, :2].max() < 1e-6
    return audit


@pytest.mark.parametrize("strategy", ["sequential", "on-demand"])
@pytest.mark.parametrize(
    ("name", "combines", "carts", "capacity"),
    [("rectangle_3", 2, 1, np.inf), ("rectangle_3", 4, 2, 20000.0), ("pole_6", 1, 1, np.inf)],
)
def test_all_grain_of_a_field_is_delivered(
    field_makers, logs, name, combines, carts, capacity, strategy
):
    plan = plan_harvest(
        field_makers[name](),
        [Combine()] * combines,
        Cart(capacity=capacity),
        carts=carts,
        density=0.8,
        strategy=strategy,
    )
    checked(logs, plan)


def test_a_combine_with_a_small_tank_stops_where_the_cart_can_come(logs):
    # Heavy crop: the tank is full before the first round is done.
    plan = plan_harvest(
        Field.rectangle(160, 110, margin=14.0),
        [Combine(capacity=3000.0)] * 2,
        Cart(hitch_offset=0.4),
        carts=1,
        density=1.6,
    )
    checked(logs, plan)
    assert len(plan.service.stops) > 0
    makespan = max(path.end for path in plan.service.plans)
    assert makespan > plan.combines.makespan
    for stop in plan.service.stops:
        path = plan.service.plans[stop.combine]
        times = np.arange(0.0, path.end, 0.5)
        stands = np.abs(path.station_at(times) - stop.station) < 1.0
        assert 0.5 * stands.sum() >= stop.duration - 1.0


def test_where_carts_cannot_serve_combines_these_cut_the_field_in_another_way(field_makers, logs):
    field = field_makers["blob_7"]()
    crew, team = {"carts": 1, "density": 0.8}, [Combine()] * 3
    with pytest.raises(NoPlan, match="`carts` must"):
        plan_harvest(field, team, Cart(), team=plan_combines(field, team), **crew)
    checked(logs, plan_harvest(field, team, Cart(), **crew))


def test_no_truck_stands_at_the_tip_of_a_star(field_makers, logs):
    field = field_makers["star_11"]()
    plan = plan_harvest(field, [Combine()] * 5, Cart(), carts=3, density=0.8)
    checked(logs, plan)
    tips = shapely.get_coordinates(field.outline.exterior)
    tips = tips[np.hypot(*tips.T) > 250.0]
    away = plan.supply.trucks[:, None, :2] - tips
    assert np.hypot(away[..., 0], away[..., 1]).min() > 18.0


def test_without_a_margin_carts_have_no_place():
    with pytest.raises(InvalidInput):
        plan_harvest(
            Field.rectangle(200, 150, margin=0.0),
            [Combine()],
            Cart(),
            carts=1,
            density=0.8,
        )


def test_carts_are_emptied_where_trucks_stand_or_else_at_gates():
    """Places on the margin, in turn; a place far from the field's edge has no room."""
    plain = Field.rectangle(120.0, 90.0)
    team = plan_combines(plain, [Combine()])

    def places(count, **told):
        given = {name: np.array(points) for name, points in told.items()}
        there = replace(team, field=replace(plain, **given))
        return truck_places(there, Cart(), count)[:, :2]

    gate, truck = [[130.0, 50.0]], [[60.0, -8.0], [60.0, 97.0]]
    assert np.hypot(*(places(1, gates=gate) - gate).T).max() < NEAR_TRUCK
    both = places(2, gates=gate, trucks=truck)
    assert np.hypot(*(both - truck).T).max() < NEAR_TRUCK
    with pytest.raises(InvalidInput, match=r"`trucks` must have room for cart 0 within 60 m of"):
        places(1, trucks=[[60.0, -300.0]])


def test_the_first_reason_is_told_where_other_ways_leave_no_room_for_trucks(
    field_makers, monkeypatch
):
    def no_way(*_):
        raise NoPlan("`carts` must find ways to where combines park; got none")

    def places(*given):
        tries.append(given)
        require(len(tries) == 1, "margin", "have room for 1 carts beside combines", 14.0)
        return np.zeros((1, 3))

    tries = []
    monkeypatch.setattr(harvest_plan, "serve_combines", no_way)
    monkeypatch.setattr(harvest_plan, "truck_places", places)
    machines = {"carts": 1, "density": 0.8}
    with pytest.raises(NoPlan, match="where combines park"):
        plan_harvest(field_makers["rectangle_3"](), [Combine()], Cart(), **machines)
    assert len(tries) > 1
