"""Ways to cut small fields, and what they are put together from, are as they were recorded."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world, world_from_polygon
from sightfield.systems.numerics.harvest.coverage import cut_ground, plan_coverage
from sightfield.systems.numerics.harvest.coverage.candidates import (
    Passes,
    find_candidates,
    park,
    start_in_bay,
)
from sightfield.systems.numerics.harvest.coverage.cut_ground import CutGround
from sightfield.systems.numerics.harvest.coverage.driver import (
    Driver,
    detours,
    drive_gate,
    find_gate,
    lay_out_roads,
    ring_groups,
)
from sightfield.systems.numerics.harvest.coverage.loops import crop_to_offset, drive_line
from sightfield.systems.numerics.harvest.coverage.plan_coverage import find_coverages
from sightfield.systems.numerics.harvest.coverage.precedence import find_precedence
from sightfield.systems.numerics.harvest.coverage.swaths import chain_swaths
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine, size_of
from sightfield.systems.numerics.harvest.paths import MachinePath

USUAL = Combine(
    header_width=7.7, header_depth=1.8, turning_radius=5.6, length=7.2, width=3.3, speed=1.6
)
QUICK = replace(USUAL, speed=2.1, acceleration=0.6)
QUAD = [(0.0, 0.0), (132.3, 9.1), (121.2, 88.4), (-7.3, 80.6)]
HOOK = [(0.0, 0.0), (129.1, 6.2), (121.7, 53.3), (66.8, 47.1), (58.9, 104.2), (-6.4, 97.3)]
POND = [(51.2, 37.9), (64.4, 35.1), (68.3, 44.6), (55.7, 49.8)]
BESIDE = [(128.2, 60.9), (134.4, 58.1), (138.3, 64.6), (135.1, 70.2), (129.7, 68.8)]
CORNER = shapely.Polygon([(118.0, 80.0), (135.0, 82.0), (133.0, 101.0), (117.0, 97.0)])

FIELDS = {
    "quad": Field(make_world(QUAD)),
    "hook": Field(make_world(HOOK), margin=9.5),
    "pond": Field(make_world(QUAD, [POND])),
    "corner": Field(world_from_polygon(shapely.Polygon(QUAD).difference(CORNER)), no_go=(CORNER,)),
    "beside": Field(
        make_world([(0.0, 0.0), (152.3, 9.1), (146.2, 118.4), (-7.3, 109.6)], [BESIDE])
    ),
    "wide": Field(make_world(QUAD), margin=22.0),
    "narrow": Field(make_world(QUAD), margin=6.2),
}
CASES = {
    "quad": ("quad", [USUAL, QUICK], {}),
    "hook": ("hook", [USUAL, USUAL, QUICK], {"reach": 400.0}),
    "pond": ("beside", [USUAL, QUICK], {"reach": 300.0}),
    "corner": ("corner", [USUAL], {}),
    "narrow": ("narrow", [USUAL], {}),
    "thesis": ("wide", [USUAL, USUAL], {"pattern": "thesis"}),
}


def told(plan):
    return {
        "paths": [[each.poses, each.gears, each.cutting, each.work] for each in plan.paths],
        "precedence": plan.precedence,
        "rest": [plan.area, plan.covered_area, plan.times, plan.off_paths, plan.length],
    }


@pytest.mark.parametrize("name", CASES)
def test_ways_to_cut_a_field_are_as_recorded(name, as_recorded, monkeypatch):
    field, combines, options = CASES[name]
    if name == "pond":
        # Where there is no way, a long search finds none either.
        monkeypatch.setattr(cut_ground, "EXPANSIONS", 300)
        monkeypatch.setattr(plan_coverage, "BUILT", 1)
    most = 1 if name == "pond" else 3
    first, *others = itertools.islice(find_coverages(FIELDS[field], combines, **options), most)
    as_recorded(told(first))
    as_recorded([[each.times, each.covered_area] for each in others], "others")
    if name in ("hook", "pond"):
        slivers = find_precedence(FIELDS[field], first.paths, size_of(combines), slivers=0.8)
        as_recorded(slivers, "slivers")


@pytest.mark.parametrize("inwards", [False, True])
@pytest.mark.parametrize("name", ["hook", "pond", "corner"])
def test_candidates_are_as_recorded(name, inwards, as_recorded):
    field = FIELDS[name]
    region, ground = crop_to_offset(field, USUAL), CutGround.of(field, USUAL)
    found = find_candidates(field, region, ground, inwards=inwards)
    as_recorded(np.array([each.time for each in found]), "times")
    as_recorded([len(each.rounds) for each in found], "rounds")
    as_recorded([[each.region.area, each.inside.area] for each in found[:4]], "areas")
    loops = [loop for each in found[0].rounds for loop in each]
    plain = [(each.number, each.hole, each.corners, each.turns) for each in loops]
    as_recorded([plain, [np.array(each.line.coords) for each in loops]], "loops")
    few = [each for each in found if each.swaths][:5]
    lines = [[(s.ends, s.strip, s.cell) for s in each.swaths] for each in few]
    as_recorded([np.array([ends for ends, _, _ in each]) for each in lines], "swaths")
    as_recorded([[each[1:] for each in line] for line in lines[:2]], "cells")
    as_recorded([chain_swaths(each.swaths) for each in few], "chains")


@pytest.mark.parametrize("reach", [np.inf, 45.0])
def test_a_way_to_the_rings_round_a_pond_and_out_again_is_as_recorded(
    reach, as_recorded, monkeypatch
):
    monkeypatch.setattr(cut_ground, "EXPANSIONS", 600)
    field = FIELDS["pond"]
    region, ground = crop_to_offset(field, USUAL), CutGround.of(field, USUAL)
    found = find_candidates(field, region, ground)
    candidate = next(each for each in found if len(each.rounds) == 2 and each.swaths)
    groups = ring_groups(candidate.rounds)
    roads = lay_out_roads(region, [7.7], 5.6)
    driver = Driver(ground, roads)
    for loop in [each for loops in candidate.rounds for each in loops if not each.hole]:
        ground.cut(drive_line(np.array(loop.line.coords), cutting=True))
    gates = [find_gate(group, groups, candidate.swaths, driver, roads) for group in groups]
    as_recorded([[each.node, each.start, each.path.poses, each.length] for each in gates], "gates")
    (gate,) = gates
    driver.go(gate.start)
    swath = None
    if gate.node is not None:
        swath = candidate.swaths[gate.node // 2].path(back=bool(gate.node % 2))
    drive_gate(driver, gate, swath, reach)
    as_recorded([each.poses for each in driver.paths], "in")
    as_recorded([each.poses for each in driver.ways_back], "back")
    driver.go(roads[0].pose(40.0))
    as_recorded([driver.paths[-1].poses, driver.paths[-1].gears], "out")


def test_ways_along_a_road_are_as_recorded(as_recorded):
    field = FIELDS["quad"]
    ground = CutGround.of(field, USUAL)
    roads = lay_out_roads(field.polygon, [11.0, 4.0], 5.6)
    driver = Driver(ground, roads)
    for depth in (4.0, 11.0):
        for road in lay_out_roads(field.polygon, [depth], 5.6):
            ground.cut(drive_line(np.array(road.line.coords), cutting=True))
    rng = np.random.default_rng(31)
    poses = []
    while len(poses) < 12:
        pose = rng.uniform([-8, -3, -4], [134, 92, 4])
        if ground.may_stand(pose):
            poses.append(pose)
    poses = np.array(poses)
    as_recorded(np.minimum(detours(poses[:6], poses[6:], driver), 1e3), "detours")
    for number, (start, goal) in enumerate(zip(poses[:6], poses[6:], strict=True)):
        way = driver.way_to(start, goal)
        as_recorded([way.poses, way.gears], f"{number}")
    driver.go(poses[0])
    ahead = poses[0] + np.array([9.0, 1.0, 0.2])
    as_recorded([driver.cut_towards(ahead, 40.0), driver.path.poses], "cut")


def test_places_to_wait_are_as_recorded(as_recorded):
    field = FIELDS["quad"]
    ground = CutGround.of(field, USUAL)
    candidate = next(
        each for each in find_candidates(field, field.polygon, ground) if len(each.rounds) == 1
    )
    ground.crop.cells[:] = False
    along = MachinePath.of([[-4.0, -7.5, 0.07], [125.0, 1.4, 0.07]])
    parked = []
    for number, pose in enumerate([[60.0, -2.0, 0.07], [90.0, 40.0, 1.2], [30.0, 30.0, -2.0]]):
        driver = Driver(ground.copy_for(USUAL), lay_out_roads(field.polygon, [5.0], 5.6))
        passes = Passes(field, USUAL)
        passes.add(along, 5)
        passes.add(MachinePath.of([[85.0, 20.0, 1.2], [97.0, 60.0, 1.2]]), 6)
        driver.go(np.array(pose))
        begun = start_in_bay(driver, CutGround.of(field, USUAL), passes, number)
        ended = park(driver, passes, number, list(candidate.swaths[:4]), parked)
        parked.append(driver.pose)
        as_recorded([begun, ended, driver.path.poses, driver.path.gears], f"{number}")
