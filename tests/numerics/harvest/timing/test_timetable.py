"""Timetables: distances by Shapely, accelerations, all orders, crop that has to be cut first."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.paths import MachinePath, fastest_profile
from sightfield.systems.numerics.harvest.timing.conflicts import GAP
from sightfield.systems.numerics.harvest.timing.rule import free_rule, set_orders
from sightfield.systems.numerics.harvest.timing.sweep import grid_stations, sweep_of
from sightfield.systems.numerics.harvest.timing.timed_drive import (
    Journey,
    drive_by_rule,
    nominal_durations,
    paces_of,
)
from sightfield.systems.numerics.harvest.timing.timetable import (
    MachineTimetable,
    Standstill,
    time_machines,
)


def check_is_driven(path, journey):
    """A timed path is within its limits, and its numbers fit one another."""
    lasting, way = np.diff(path.times), np.diff(path.stations)
    mean = (path.speeds[1:] + path.speeds[:-1]) / 2
    np.testing.assert_allclose(way, mean * lasting, atol=1e-6)
    change = np.abs(np.diff(path.speeds))
    assert (change <= journey.acceleration * lasting * (1 + 1e-6) + 1e-9).all()
    top = np.broadcast_to(journey.limits, journey.path.lengths.shape)
    piece = journey.path.piece_at((path.stations[1:] + path.stations[:-1]) / 2)
    assert (np.maximum(path.speeds[1:], path.speeds[:-1]) <= top[piece] + 1e-9)[way > 1e-6].all()
    assert path.speeds[[0, -1]] == pytest.approx([0, 0])
    assert path.stations[[0, -1]] == pytest.approx([0, journey.path.length])
    for cusp in journey.path.cusps:
        at = np.interp(cusp, path.stations, path.times)
        assert path.speed_at(at) < 1e-3


def shortest(journey):
    """How long a machine takes by itself [s]."""
    return nominal_durations(np.array([journey.sweep.cells]), paces_of([journey])).sum()


@pytest.mark.parametrize("seed", range(12))
def test_machines_keep_their_distance_and_their_accelerations(fleets, seed):
    rng = np.random.default_rng([21, seed])
    journeys = fleets.fleet_that_can_arrive(seed % 4, rng, 2 + seed % 3)
    found = time_machines(journeys, trials=8, seed=seed)
    assert isinstance(found, MachineTimetable)
    for path, journey in zip(found.paths, journeys, strict=True):
        check_is_driven(path, journey)
    times = np.arange(0.0, found.makespan, 0.21)
    log = np.column_stack([path.station_at(times) for path in found.paths])
    assert fleets.least_distance(journeys, log) >= GAP


def test_lost_time_is_accounted_for(fleets):
    rng = np.random.default_rng(31)
    journeys = fleets.journeys_of(fleets.kinds[0](rng, 4), rng)
    found = time_machines(journeys, trials=0)
    lost = [
        path.end - shortest(journey) for path, journey in zip(found.paths, journeys, strict=True)
    ]
    assert found.waiting.sum(axis=(1, 2)) == pytest.approx(lost)
    assert max(lost) > 1.0
    assert not found.waiting[..., 1].any()


def test_a_machine_alone_takes_the_least_time_but_for_the_grid(fleets):
    path = fleets.drive((1.0, 2.0, 0.3), (40.0, 0.0), (12.0, 0.15), (-9.0, 0.1), (30.0, 0.0))
    limits = np.where(np.abs(path.curvatures) > 0, 1.1, 1.9)
    stops = np.array([25.5])
    sweep = sweep_of(path, fleets.outline, grid_stations(path, 1.0, stops))
    journey = Journey(path, sweep, limits, 0.6, stops, np.array([4.0]))
    timed = time_machines([journey]).paths[0]
    check_is_driven(timed, journey)
    # Before and behind the stop are two paths of their own.
    k = int(path.piece_at(25.5))
    before = MachinePath.of([*path.poses[: k + 1], path.pose_at(25.5)])
    behind = MachinePath.of([path.pose_at(25.5), *path.poses[k + 1 :]], gears=path.gears[k:])
    best = 4.0 + fastest_profile(before, limits[: k + 1], 0.6).end
    best += fastest_profile(behind, limits[k:], 0.6).end
    assert best <= timed.end <= best * 1.01
    stood = timed.times[np.abs(timed.stations - 25.5) < 1e-9]
    assert np.ptp(stood) == pytest.approx(4.0)


@pytest.mark.parametrize("seed", [1, 4, 6, 8])
def test_no_order_of_a_few_encounters_is_much_quicker(fleets, seed):
    rng = np.random.default_rng([11, seed - 1])
    count = 2 + seed % 2
    journeys = fleets.journeys_of(fleets.kinds[seed % 4](rng, count), rng)
    found = time_machines(journeys)
    assert isinstance(found, MachineTimetable)
    encounters = len(found.first)
    assert 1 <= encounters <= 10
    paces, cells = paces_of(journeys), found.rule.cells
    rule, ends = free_rule(cells), np.cumsum(cells + 1) - 1
    makespans = []
    for choice in itertools.product([0, 1], repeat=encounters):
        first = found.meetings.pairs[np.arange(encounters), list(choice)]
        for a, b in itertools.combinations(range(count), 2):
            set_orders(rule, found.meetings, first, a, b)
        drive = drive_by_rule(rule, found.meetings, first, paces)
        if (drive.progress == cells).all():
            makespans.append(drive.arrivals[ends].max())
    assert min(makespans) <= found.makespan + 1e-9 <= min(makespans) * 1.02


def test_ground_is_cut_before_another_machine_is_on_it(fleets):
    one = fleets.journey(fleets.drive((0.0, 0.0, 0.2), (90.0, 0.0)), 1.3)
    other = fleets.journey(fleets.drive((0.0, 80.0, 0.2), (60.0, 0.0)), 2.0)
    passed = np.where(other.sweep.stations >= 30.0, 70.0, -np.inf)
    found = time_machines([one, other], {(1, 0): passed})
    first, second = found.paths
    arrives = np.interp(70.0, first.stations, first.times)
    reaches = second.times[np.searchsorted(second.stations, 30.0)]
    assert reaches >= arrives - 1e-9
    # It stands up to a cell before, so that it loses no more than that.
    assert reaches <= arrives + 3.0
    assert found.waiting[1, 0, 1] == pytest.approx(second.end - shortest(other))
    assert second.station_at(arrives) <= 30.0


def test_machines_that_need_each_others_crop_stand_still_and_say_so(fleets):
    one = fleets.journey(fleets.drive((0.0, 0.0, 0.2), (90.0, 0.0)))
    other = fleets.journey(fleets.drive((0.0, 80.0, 0.2), (60.0, 0.0)))
    needs = {
        (1, 0): np.where(other.sweep.stations >= 30.0, 70.0, -np.inf),
        (0, 1): np.where(one.sweep.stations >= 50.0, 40.0, -np.inf),
    }
    found = time_machines([one, other], needs)
    assert isinstance(found, Standstill)
    assert [(block.machine, block.by, block.cause) for block in found.blocks] == [
        (0, 1, "crop"),
        (1, 0, "crop"),
    ]
    assert [block.station for block in found.blocks] == pytest.approx([49.0, 29.0], abs=1.0)
    assert "machine 0 at 49 m" in str(found)


def test_machines_that_meet_head_on_stand_still_and_say_where(fleets):
    one = fleets.journey(fleets.drive((0.0, 0.0, 0.2), (90.0, 0.0)))
    x, y = 90 * np.cos(0.2), 90 * np.sin(0.2)
    other = fleets.journey(fleets.drive((x, y, 0.2 + np.pi), (90.0, 0.0)))
    found = time_machines([one, other])
    assert isinstance(found, Standstill)
    assert {(block.machine, block.by) for block in found.blocks} == {(0, 1), (1, 0)}
    assert {block.cause for block in found.blocks} == {"no place to pass"}


def test_machines_that_begin_in_each_other_stand_still_and_say_so(fleets):
    one = fleets.journey(fleets.drive((0.0, 0.0, 0.2), (30.0, 0.0)))
    other = fleets.journey(fleets.drive((1.0, 3.0, 1.2), (30.0, 0.0)))
    found = time_machines([one, other])
    assert isinstance(found, Standstill)
    assert [(block.cause, block.station) for block in found.blocks] == [("in the way", 0.0)] * 2


@pytest.mark.parametrize(
    ("passed", "text"), [(np.zeros(3), "shape"), (None, "stations up to 60 m")]
)
def test_needs_that_name_no_station_are_refused(fleets, passed, text):
    one = fleets.journey(fleets.drive((0.0, 0.0, 0.2), (60.0, 0.0)))
    other = fleets.journey(fleets.drive((0.0, 80.0, 0.2), (50.0, 0.0)))
    if passed is None:
        passed = np.full(other.sweep.cells + 1, 61.0)
    with pytest.raises(InvalidInput, match=text):
        time_machines([one, other], {(1, 0): passed})


def test_bad_journeys_are_refused(fleets):
    path = fleets.drive((0.0, 0.0, 0.2), (20.0, 0.0), (-8.0, 0.1))
    sweep = sweep_of(path, fleets.outline, grid_stations(path))
    with pytest.raises(InvalidInput, match="limits"):
        Journey(path, sweep, 0.0, 0.5)
    with pytest.raises(InvalidInput, match="dwells"):
        Journey(path, sweep, 1.0, 0.5, np.array([3.0]), np.zeros(2))
    with pytest.raises(InvalidInput, match="cusps and stops"):
        Journey(path, sweep, 1.0, 0.5, np.array([3.3]), np.array([9.0]))
    with pytest.raises(InvalidInput, match="journeys"):
        time_machines([])


def test_a_machine_speeds_up_and_slows_down_within_a_cell(fleets):
    """Between slow pieces long cells are entered and left slowly, and driven fast."""
    path = fleets.drive((0.0, 0.0, 0.0), *[(6.0, 0.0)] * 6)
    journey = fleets.journey(path, spacing=6.0)
    journey = replace(journey, limits=np.tile([0.5, 1.6], 3))
    (timed,) = time_machines([journey]).paths
    check_is_driven(timed, journey)
    # Without a stop: as long as each piece takes by itself from and to the slower speed.
    assert timed.times[-1] == pytest.approx(shortest(journey), rel=1e-9)
    assert timed.speeds.max() == pytest.approx(1.6)
