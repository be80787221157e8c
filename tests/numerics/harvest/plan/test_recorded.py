"""Plans of a harvest, the places of trucks and plans in files are as they were recorded."""

from dataclasses import replace
from itertools import islice
from xml.etree import ElementTree

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput, NoPlan
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field, Place
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import (
    find_combine_plans,
    plan_harvest,
    swath_lines,
    tank_reach,
    truck_places,
)
from sightfield.systems.numerics.harvest.plan.plan_files import (
    path_points,
    plan_geojson,
    plan_taskdata,
    swaths_of,
    way_points,
)

RIM = [(0.137, 0.211), (118.043, 9.176), (109.318, 83.057), (-7.242, 76.391)]
POND = [(60, 35), (71, 37), (73, 46), (62, 45)]
BESIDE = shapely.Polygon([(30, 86), (44, 87), (43, 97), (31, 96)])
FIELD = Field(
    make_world(RIM, [POND]),
    no_go=(BESIDE,),
    gates=np.array([[58.0, 1.5], [114.0, 50.0]]),
    place=Place(origin=(11.5, 48.1)),
    name="A field with a name of more than thirty-two letters",
)
TEAM = [
    Combine(header_width=8.3, capacity=3200.0, turning_radius=5.7, length=7.4, width=3.4),
    Combine(
        header_width=8.3, capacity=4100.0, turning_radius=5.7, length=7.4, width=3.4, speed=1.9
    ),
]
CART = Cart(capacity=9000.0, hitch_offset=0.4)


@pytest.fixture(scope="module")
def told():
    """What was said of the progress of a plan."""
    return []


@pytest.fixture(scope="module")
def plan(told):
    return plan_harvest(
        FIELD,
        TEAM,
        CART,
        carts=2,
        density=0.83,
        truck_rate=270.0,
        threshold=0.6,
        seed=5,
        progress=lambda stage, share: told.append((stage, share)),
    )


def way(timed):
    return [timed.times, timed.stations, timed.speeds, timed.path.poses]


def test_a_whole_plan_is_as_recorded(plan, told, as_recorded):
    service = plan.service
    as_recorded([plan.makespan, plan.combines.makespan, plan.combines.makespan_over_bound])
    as_recorded([plan.combines.waiting, service.visits, service.trips, service.stops], "visits")
    as_recorded([way(each) for each in service.plans], "combines")
    as_recorded([way(each.timed) for each in service.motions], "carts")
    as_recorded([plan.supply, swath_lines(plan.combines)], "supply")
    as_recorded([tank_reach(FIELD, TEAM, 0.83), tank_reach(FIELD, TEAM, 0.0)], "reach")
    stages = dict.fromkeys(stage for stage, _ in told)
    as_recorded([list(stages), np.array([share for _, share in told])], "progress")


def test_its_geojson_is_as_recorded(plan, as_recorded):
    whole = plan_geojson(plan)
    assert whole["makespan"] == round(plan.makespan, 2)
    for each in whole["features"]:
        geometry, properties = each["geometry"], each["properties"]
        if properties["kind"] in ("field", "swath", "visit"):
            # To the centimetre, the hundredth of a second and of a kilogram.
            for name in {"area", "length", "taken"} & set(properties):
                assert properties[name] == round(properties[name], 2)
        if properties["kind"] == "swath":
            assert properties["begin"] == round(properties["begin"], 2)
            assert properties["end"] == round(properties["end"], 2)
        if geometry["type"] != "Point":
            lines = geometry["coordinates"]
            lines = lines if geometry["type"] == "Polygon" else [lines]
            geometry["coordinates"] = [np.array(line) - FIELD.place.origin for line in lines]
        if "times" in properties:
            properties["times"] = np.array(properties["times"])
    as_recorded(whole, absolute=1e-8)


def test_its_task_data_is_as_recorded(plan, as_recorded):
    for name, each in (("placed", plan), ("nowhere", replace(plan, combines=replace(
        plan.combines, field=replace(FIELD, place=Place(offset=(1e3, 2e3)), name="")
    )))):  # fmt: skip
        root = ElementTree.fromstring(plan_taskdata(each).decode())
        said = [[e.tag, e.attrib] for e in root.iter() if e.tag != "PNT"]
        points = [e.attrib for e in root.iter("PNT")]
        places = np.array([[float(p["C"]), float(p["D"])] for p in points])
        kinds = np.array([int(p["A"]) for p in points])
        called = [p["B"] for p in points if "B" in p]
        as_recorded([said, places - places[0], places[0], kinds, called], name, absolute=1e-8)


def test_points_of_swaths_and_ways_are_as_recorded(plan, as_recorded):
    as_recorded(swaths_of(plan), "swaths")
    path = plan.service.plans[0].path
    as_recorded([path_points(path, 2, 9), path_points(path, 4, 5)], "points")
    as_recorded([way_points(each, 7.3) for each in plan.service.plans], "ways")


def test_other_plans_of_the_combines_are_as_recorded(as_recorded):
    field = Field(make_world([(0, 0), (79, 6), (73, 55), (-5, 51)]))
    plans = list(islice(find_combine_plans(field, TEAM, seed=2), 5))
    as_recorded([[each.makespan, each.waiting, each.coverage.length] for each in plans])


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("first", [0.125, 0.885])
@pytest.mark.parametrize("name", ["anywhere", "gates", "trucks"])
def test_places_of_trucks_are_as_recorded(name, first, count, plan, as_recorded):
    field = replace(
        FIELD,
        gates=FIELD.gates if name == "gates" else np.zeros((0, 2)),
        trucks=np.array([[20.0, -8.0], [117.0, 40.0]]) if name == "trucks" else np.zeros((0, 2)),
    )
    team = replace(plan.combines, field=field)
    try:
        as_recorded(truck_places(team, CART, count, first))
    except (InvalidInput, NoPlan) as fault:
        as_recorded([type(fault).__name__, str(fault)])
