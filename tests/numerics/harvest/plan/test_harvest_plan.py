"""Plans of combines alone and of whole harvests, by the audit, which shares no code with them."""

import math
import runpy
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely
from shapely import affinity

from sightfield.systems.numerics.errors import InvalidInput, NoPlan, require
from sightfield.systems.numerics.geometry.world import make_world, world_from_polygon
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.carts.cut_times import CELL, GAP, cut_times
from sightfield.systems.numerics.harvest.carts.routes import ROUGH
from sightfield.systems.numerics.harvest.carts.surroundings import field_lines
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.carts.windows import beside
from sightfield.systems.numerics.harvest.coverage.plan_coverage import BUILT, find_coverages
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import (
    Cart,
    Combine,
    CombineSize,
    cart_outline,
    is_alongside,
    size_of,
)
from sightfield.systems.numerics.harvest.paths import MachinePath
from sightfield.systems.numerics.harvest.plan import harvest_plan
from sightfield.systems.numerics.harvest.plan.harvest_plan import (
    LITTLE_WAITING,
    NEAR_TRUCK,
    plan_combines,
    plan_harvest,
    tank_reach,
    truck_places,
)
from sightfield.systems.numerics.harvest.timing.timetable import Block, Standstill

COMBINE = Combine(header_width=7.5, speed=1.6, turning_radius=6.5, length=7.5, width=3.4)


@pytest.fixture(scope="module")
def logs():
    return runpy.run_path(str(Path(__file__).with_name("plan_logs.py")))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"density": -1.0}, "`density` must be positive; got -1.0"),
        ({"density": 0.0}, "`density` must be positive; got 0.0"),
        ({"density": math.nan}, "`density` must be a finite number; got nan"),
        ({"density": True}, "`density` must be a finite number; got True"),
        ({"truck_rate": math.nan}, "`truck_rate` must be a finite number; got nan"),
        ({"truck_rate": -5.0}, "`truck_rate` must be positive; got -5.0"),
        ({"truck_rate": 0.0}, "`truck_rate` must be positive; got 0.0"),
        ({"seed": -1}, "`seed` must be a whole number of at least 0; got -1"),
        ({"seed": 0.5}, "`seed` must be a whole number of at least 0; got 0.5"),
        ({"carts": 1.5}, "`carts` must be a whole number of at least 1; got 1.5"),
        ({"carts": 0}, "`carts` must be a whole number of at least 1; got 0"),
        ({"threshold": 2.0}, "`threshold` must lie above 0 and up to 1; got 2.0"),
        ({"threshold": math.nan}, "`threshold` must be a finite number; got nan"),
        ({"combines": []}, "`combines` must be one at least; got none"),
        ({"combines": 2}, "`combines` must be of type Sequence; got int: 2"),
        ({"combines": [Cart()]}, r"`combines\[0\]` must be of type Combine; got Cart: "),
        ({"cart": 1}, "`cart` must be of type Cart; got int: 1"),
        ({"field": "field.wkt"}, "`field` must be of type Field; got str: 'field.wkt'"),
    ],
    ids=str,
)
def test_what_no_harvest_has_is_refused_by_its_name(changes, message):
    usual = {"combines": [COMBINE], "cart": Cart(), "carts": 1, "density": 0.8}
    usual["field"] = Field.rectangle(200.0, 150.0)
    with pytest.raises(InvalidInput, match=message):
        plan_harvest(**{**usual, **changes})


@pytest.mark.parametrize(
    ("name", "part", "count"),
    [
        ("rectangle_3", 1.0, 4),
        ("rectangle_10", 0.6, 2),
        ("trapezium_12", 0.6, 3),
        ("l_9", 0.7, 2),
        ("pond_10", 0.7, 2),
    ],
)
def test_the_audit_finds_nothing_in_a_plan(smaller, logs, name, part, count):
    field = smaller(name, part)
    plan = plan_combines(field, [COMBINE] * count)
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    assert audit.figures["min_combine_to_combine"] >= 0.45
    assert audit.figures["crop_under_bodies"] <= 0.002 * field.area
    assert plan.makespan_over_bound < 1.6
    assert plan.waiting < 0.1


def test_headers_little_wider_than_the_body_do_not_wait_for_slivers_of_crop(field_makers, logs):
    """Their tails swing over crop in all turns; combines would wait for one another for that."""
    field = field_makers["neck_9"]()
    plan = plan_combines(field, [Combine(header_width=4.5)] * 2)
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    assert audit.figures["crop_under_bodies"] <= 0.002 * field.area
    assert plan.waiting <= LITTLE_WAITING


def test_combines_on_adjacent_rounds_follow_one_another_inwards(logs):
    field = Field.rectangle(200.0, 150.0, margin=22.0)
    plan = plan_combines(field, [COMBINE] * 2, pattern="thesis")
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    # The first combine's cuts lie on rounds 0, 2, 4, ..., the second one's on those between.
    for number, timed in enumerate(plan.paths):
        path = timed.path
        long = path.cutting & (path.lengths > 60.0)
        middles = (path.poses[:-1, :2] + path.poses[1:, :2])[long] / 2
        depths = field.outline.exterior.distance(shapely.points(middles))
        rounds = np.round(depths / COMBINE.header_width - 0.5)
        assert np.abs(depths / COMBINE.header_width - 0.5 - rounds).max() < 0.05
        assert set(rounds[:6] % 2) == {float(number)}


def test_combines_on_adjacent_rounds_need_room_beside_the_field():
    with pytest.raises(InvalidInput, match="too narrow"):
        plan_combines(Field.rectangle(200.0, 150.0, margin=6.0), [COMBINE] * 2, pattern="thesis")


def test_of_the_best_ways_to_cut_a_field_the_one_that_is_done_first_is_taken(monkeypatch):
    timed = []

    def time_machines(*args, **kwargs):
        found = times(*args, **kwargs)
        if not timed:
            # They wait for one another in what looked best.
            late = [replace(path, times=path.times + 600.0) for path in found.paths]
            found = replace(found, paths=tuple(late))
        timed.append(found)
        return found

    times = harvest_plan.time_machines
    monkeypatch.setattr(harvest_plan, "time_machines", time_machines)
    field, team = Field.rectangle(120.0, 90.0), [Combine()] * 2
    plan = plan_combines(field, team)
    makespans = [timetable.makespan for timetable in timed]
    assert plan.makespan == min(makespans)
    assert len(set(makespans)) == BUILT
    assert makespans[0] > max(makespans[1:])
    # Without those waits it would have been the first.
    monkeypatch.undo()
    assert plan_combines(field, team).makespan == pytest.approx(makespans[0] - 600.0)


def test_where_combines_would_block_one_another_the_field_is_cut_another_way(monkeypatch):
    field, combine = Field.rectangle(80.0, 60.0), Combine()
    standstill = Standstill((Block(1, 20.0, (3.0, 4.0), 0, 70.0, "in the way"),), (5, 7))
    every = list(find_coverages(field, [combine] * 2))
    assert len(every) > BUILT + 1
    blocked, ways = BUILT, []

    def time_machines(journeys, *args, **kwargs):
        # A way to cut the field may be timed more than once, with less to wait for.
        if not any(each is journeys for each in ways):
            ways.append(journeys)
        return times(journeys, *args, **kwargs) if len(ways) > blocked else standstill

    times = harvest_plan.time_machines
    monkeypatch.setattr(harvest_plan, "time_machines", time_machines)
    monkeypatch.setattr(harvest_plan, "find_coverages", lambda *_, **__: iter(every))
    plan = plan_combines(field, [combine] * 2)
    assert plan.coverage is every[BUILT]
    blocked = len(every)
    ways.clear()
    with pytest.raises(NoPlan, match=f"in all of {len(every)} ways .* machine 1 at 20 m"):
        plan_combines(field, [combine] * 2)


@pytest.mark.parametrize("ponds", [0, 1])
def test_a_plan_does_not_depend_on_where_whoever_drew_the_field_began(ponds):
    """A rectangle took 3 to 5% more time with another of its corners first."""
    width, height = (270.0, 200.0) if ponds else (135.0, 100.0)
    outer = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    holes = [[(100.0, 80.0), (130.0, 80.0), (130.0, 110.0), (100.0, 110.0)]][:ponds]

    def drawn(first, back):
        rings = [ring[first:] + ring[:first] for ring in (outer, *holes)]
        rings = [ring[::-1] for ring in rings] if back else rings
        return Field(make_world(rings[0], rings[1:]))

    ways = [(0, False), (3, True), (1, False)][: 3 - ponds]
    plans = [plan_combines(drawn(*how), [COMBINE] * 2) for how in ways]
    for plan in plans[1:]:
        assert plan.makespan == plans[0].makespan
        for one, other in zip(plan.paths, plans[0].paths, strict=True):
            np.testing.assert_array_equal(one.path.poses, other.path.poses)


def test_carts_go_to_their_trucks_with_half_a_load_at_least_but_for_the_last_time():
    """Carts that held no more than a tank went with 137 kg."""
    plan = plan_harvest(
        Field.rectangle(160.0, 120.0),
        [replace(COMBINE, capacity=8000.0)] * 2,
        Cart(capacity=8000.0),
        carts=2,
        density=1.2,
    )
    trips = plan.service.trips
    last = {trip.cart: trip for trip in sorted(trips, key=lambda trip: trip.end)}
    assert len(trips) > len(last)
    assert all(trip.delivered >= 4000.0 for trip in trips if trip is not last[trip.cart])


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


@pytest.fixture(scope="module")
def usual_teams(smaller):
    """A function of a field's name, a part of its size and a number: the plan of usual combines."""

    @cache
    def team(name, part, count):
        return plan_combines(smaller(name, part), [Combine()] * count)

    return team


@pytest.mark.parametrize("strategy", ["sequential", "on-demand"])
@pytest.mark.parametrize(
    ("name", "part", "combines", "carts", "capacity"),
    [
        ("rectangle_3", 0.8, 2, 1, np.inf),
        ("rectangle_3", 1.0, 4, 2, 20000.0),
        ("pole_6", 0.6, 1, 1, np.inf),
    ],
)
def test_all_grain_of_a_field_is_delivered(
    usual_teams, logs, name, part, combines, carts, capacity, strategy
):
    team = usual_teams(name, part, combines)
    plan = plan_harvest(
        team.field,
        team.machines,
        Cart(capacity=capacity),
        carts=carts,
        density=0.8,
        strategy=strategy,
        team=team,
    )
    checked(logs, plan)


def test_between_rings_that_are_more_than_its_tank_a_combine_comes_out(logs):
    """No cart gets to it between a river and the crop that stands round it."""
    river = shapely.LineString([(50, 45), (120, 70)]).buffer(4.0)
    field = Field(world_from_polygon(shapely.box(0, 0, 180, 120).difference(river)))
    team, crew = [Combine(capacity=2700.0)], {"carts": 1, "density": 0.8, "visits": "greedy"}
    reach = tank_reach(field, team, 0.8)
    assert reach == pytest.approx(0.9 * 2700.0 / 0.8 / 9.0)
    rings = shapely.union_all(field.obstacles).buffer(9.0).exterior.length * 2
    assert rings > reach > rings / 2
    around = plan_combines(field, team)
    with pytest.raises(NoPlan, match="combines that wait"):
        plan_harvest(field, team, Cart(), team=around, **crew)
    plan = plan_harvest(field, team, Cart(), **crew)
    checked(logs, plan)
    # The first way to cut the field is served, so that no other one is tried.
    out = plan_combines(field, team, reach=reach)
    assert plan.combines.coverage.length == out.coverage.length
    assert out.coverage.length < 1.1 * around.coverage.length


def test_a_combine_with_a_small_tank_stops_where_the_cart_can_come(logs):
    # Heavy crop: the tank is full before the first round is done.
    plan = plan_harvest(
        Field.rectangle(120, 80, margin=14.0),
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


def test_while_a_combine_waits_to_which_no_cart_gets_others_are_served(field_makers, logs):
    """One fills up on its rings round a pond: if others wait their turn it is 2745 s in all."""
    field, team = field_makers["pond_10"](), [Combine(capacity=4500.0)] * 3
    crew = {"carts": 1, "density": 0.8, "strategy": "on-demand", "visits": "greedy"}
    plan = plan_harvest(field, team, Cart(), **crew)
    checked(logs, plan)
    assert sum(stop.duration for stop in plan.service.stops) < 2000.0


def test_where_carts_cannot_serve_combines_these_cut_the_field_in_another_way(
    monkeypatch, field_makers, logs
):
    field, tried = field_makers["blob_7"](), []

    def serve_other_ways(ground, combines, cart, plans, *others):
        tried.append(plans)
        if len(tried) == 1:
            raise NoPlan("`carts` must find ways to combine 0; got none")
        return serve_combines(ground, combines, cart, plans, *others)

    monkeypatch.setattr(harvest_plan, "serve_combines", serve_other_ways)
    plan = plan_harvest(field, [Combine()] * 3, Cart(), carts=1, density=0.8)
    assert len(tried) == 2
    assert list(plan.combines.paths) == list(tried[1])
    checked(logs, plan)


def test_no_truck_stands_at_the_tip_of_a_star(smaller, logs):
    field = smaller("star_11", 0.7)
    plan = plan_harvest(field, [Combine()] * 2, Cart(), carts=3, density=0.8)
    checked(logs, plan)
    tips = shapely.get_coordinates(field.outline.exterior)
    tips = tips[np.hypot(*tips.T) > 175.0]
    # The first of them once more, as the last one.
    assert len(tips) == 5 + 1
    away = plan.supply.trucks[:, None, :2] - tips
    assert np.hypot(away[..., 0], away[..., 1]).min() > 18.0


@pytest.mark.parametrize(
    ("name", "part"), [("star_20", 0.6), ("blob_7", 1.0), ("rectangle_3", 0.8)]
)
def test_carts_at_their_trucks_leave_a_lane_on_the_margin_to_others(usual_teams, name, part):
    """On a star carts could not get past one another until its first round was cut."""
    cart, team = Cart(), usual_teams(name, part, 2)
    field = team.field
    trucks = truck_places(team, cart, 3)
    lines = field_lines(field, team.machines[0], [])
    closed = [line for line in lines if (line[0] == line[-1]).all()]
    around = [shapely.LineString(line) for line in closed]
    lanes = [line for line in around if not shapely.Polygon(line).within(field.outline)]
    inner = min(lanes, key=lambda line: line.length)
    assert inner.distance(field.outline) > cart.width / 2 + GAP + ROUGH
    for x, y, theta in trucks:
        straight = [shapely.Polygon(part) for part in cart_outline(cart)]
        turned = affinity.rotate(shapely.union_all(straight), theta, (0, 0), use_radians=True)
        stands = affinity.translate(turned, x, y)
        assert stands.distance(inner) > cart.width / 2 + GAP + ROUGH


def test_without_a_margin_carts_have_no_place():
    with pytest.raises(InvalidInput):
        plan_harvest(
            Field.rectangle(100, 70, margin=0.0),
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
    for name in ("trucks", "gates"):
        with pytest.raises(
            InvalidInput, match=r"`trucks` must have room for cart 0 within 60 m of"
        ):
            places(1, **{name: [[60.0, -300.0]]})


def test_where_combines_pass_another_plan_of_theirs_is_asked_and_trucks_drive_on_from_a_gate():
    """Combines pass within 60 m of a place on both sides of its edge; beyond there is room."""
    field = Field.rectangle(300.0, 120.0)
    team = plan_combines(field, [Combine()])
    blocked = np.array([[150.0, -6.0]])
    along = MachinePath.of(np.array([[75.0, -6.0, 0.0], [225.0, -6.0, 0.0]]))
    (path,) = team.paths
    timetable = replace(team.timetable, paths=(replace(path, path=along),))
    passing = replace(team, timetable=timetable)

    def places(team, **told):
        return truck_places(replace(team, field=replace(field, **told)), Cart(), 1)[:, :2]

    far = np.hypot(*(places(passing, gates=blocked) - blocked).T)
    assert 75.0 < far < 120.0
    assert np.hypot(*(places(team, trucks=blocked) - blocked).T) < NEAR_TRUCK
    with pytest.raises(NoPlan, match="within 60 m"):
        places(passing, trucks=blocked)


def test_the_first_reason_is_told_where_other_ways_leave_no_room_for_trucks(monkeypatch):
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
        plan_harvest(Field.rectangle(100.0, 70.0), [Combine()], Cart(), **machines)
    assert len(tries) > 1


SLOW = Combine(speed=1.0, capacity=4000.0, unload_rate=80.0, acceleration=0.3)
USUAL = Combine()
QUICK = Combine(speed=2.0, capacity=12000.0, unload_rate=150.0)


def cut_by(plan):
    """What each combine cuts [m^2]."""
    cutter = cut_times(plan.field, plan.size, plan.paths).cutter
    return CELL**2 * np.array([(cutter == n).sum() for n in range(len(plan.paths))])


@pytest.fixture(scope="module")
def planned():
    """A function of a team: its plan of one field, made once."""
    field = Field.rectangle(300.0, 200.0)
    return cache(lambda team: plan_combines(field, team))


@pytest.mark.parametrize("team", [(SLOW, QUICK), (QUICK, USUAL, SLOW)])
def test_whoever_is_quicker_cuts_more_and_all_end_together(logs, planned, team):
    plan = planned(team)
    audit = audit_harvest(logs["log_of"](plan), logs["site_of"](plan))
    assert audit.faults == ()
    assert audit.figures["coverage"] >= 0.995
    speeds = np.array([combine.speed for combine in team])
    shares = cut_by(plan) / speeds
    # A swath is an eighth of what the slowest cuts: as even as whole swaths allow.
    assert shares.max() / shares.min() < 1.5
    for timed, speed in zip(plan.paths, speeds, strict=True):
        assert timed.speeds.max() <= speed + 1e-9
    # As many as quick as the slowest would take longer, even with headers that are always full.
    assert plan.makespan < plan.field.area / (len(team) * plan.size.header_width * speeds.min())


def test_the_order_in_which_combines_are_named_is_of_little_account(planned):
    plans = [planned(team) for team in ((SLOW, QUICK), (QUICK, SLOW))]
    assert plans[0].makespan == pytest.approx(plans[1].makespan, rel=0.1)
    assert cut_by(plans[0]) == pytest.approx(cut_by(plans[1])[::-1], rel=0.15)


def test_each_tank_and_each_auger_is_kept_to(logs):
    team = (SLOW, QUICK)
    plan = plan_harvest(
        Field.rectangle(200.0, 150.0), team, Cart(capacity=14000.0), carts=1, density=0.8
    )
    # The audit knows each tank by itself.
    audit = audit_harvest(logs["harvest_log_of"](plan), logs["harvest_site_of"](plan))
    assert audit.faults == ()
    assert plan.service.left == pytest.approx(0.0, abs=10.0)
    for number, combine in enumerate(team):
        visits = [visit for visit in plan.service.visits if visit.combine == number]
        assert max(visit.taken for visit in visits) <= combine.capacity + 250.0
        for visit in visits:
            assert visit.taken / combine.unload_rate <= visit.end - visit.begin + 1.0
    # The large tank is used: it holds three of the small ones.
    assert max(visit.taken for visit in plan.service.visits) > SLOW.capacity + 250.0


@pytest.mark.parametrize("name", ["header_width", "turning_radius", "length", "cart_gap"])
def test_combines_of_other_sizes_are_refused(name):
    other = replace(QUICK, **{name: 1.25 * getattr(QUICK, name)})
    with pytest.raises(InvalidInput, match=f"`{name}` must be the same for all combines"):
        plan_combines(Field.rectangle(300.0, 200.0), [SLOW, other])


def test_a_size_has_neither_speed_nor_tank():
    size = size_of([SLOW, QUICK])
    assert type(size) is CombineSize
    assert size.header_width == SLOW.header_width
    assert not hasattr(size, "speed")
    assert not hasattr(size, "capacity")
