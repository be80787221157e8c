"""Machines as they are packed for compiled functions, against the paths that they come from."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.execution.fleet import (
    ALONG,
    MOST,
    FleetArrays,
    Pieces,
    at_trucks,
    cut_up_to,
    cutting_on,
    fastest_at,
    lateness,
    pack_tracks,
    planned_at,
    planned_time,
    pose_on,
    poses_on,
    steer,
)
from sightfield.systems.numerics.harvest.execution.orders import PASSED, last_below
from sightfield.systems.numerics.harvest.execution.planned_work import PIECE
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath, fastest_profile

RNG = np.random.default_rng(11)


def bent_path(start, bends, lengths, gears, cutting):
    """A path of arcs and straights."""
    x, y, theta = start
    poses = [start]
    for bend, length, gear in zip(bends, lengths, gears, strict=True):
        turn = bend * length
        chord = gear * length * np.sinc(turn / 2 / math.pi)
        x, y = (
            x + chord * math.cos(theta + gear * turn / 2),
            y + chord * math.sin(theta + gear * turn / 2),
        )
        theta += gear * turn
        poses.append((x, y, theta))
    count = len(lengths)
    return MachinePath(np.array(poses), np.array(gears), np.array(cutting), np.arange(count))


PATHS = [
    bent_path((3.0, -2.0, 0.4), [0.0, 0.1, -0.15], [20.3, 7.7, 6.1], [1, 1, 1], [True, False, 1]),
    bent_path((-9.0, 5.0, 2.7), [0.12, 0.0, 0.08], [9.2, 5.3, 4.4], [1, -1, -1], [0, 1, 1]),
]


def waits(timed, station, lasts):
    """The same drive from that station on a while later: it stands there."""
    at = int(np.searchsorted(timed.stations, station - 1e-9))
    times = np.concatenate([timed.times[: at + 1], timed.times[at:] + lasts])
    stations = np.insert(timed.stations, at, timed.stations[at])
    return TimedPath(timed.path, times + 4.0, stations, np.insert(timed.speeds, at, 0.0))


# The second one stands for a while where it changes gear.
FASTEST = [fastest_profile(path, 2.3, 0.6) for path in PATHS]
TIMED = [FASTEST[0], waits(FASTEST[1], PATHS[1].cusps[0], 9.0)]


def packed(timed):
    names = ("times", "stations", "speeds")
    starts = np.cumsum([0, *(len(each.times) for each in timed)])
    return Pieces(starts, *(np.concatenate([getattr(t, name) for t in timed]) for name in names))


PIECES, ALONE = packed(TIMED), packed(FASTEST)


@pytest.mark.parametrize("m", [0, 1])
def test_packed_plans_are_where_the_plans_are(m):
    rng = np.random.default_rng(1)
    timed = TIMED[m]
    times = np.concatenate([rng.uniform(-2.0, timed.end + 3.0, 400), timed.times])
    found = np.array([planned_at(PIECES, m, t) for t in times])
    assert found[:, 0] == pytest.approx(timed.station_at(times), abs=1e-9)
    inside = (times > timed.times[0]) & (times < timed.end)
    assert found[inside, 1] == pytest.approx(timed.speed_at(times[inside]), abs=1e-9)
    assert (found[times >= timed.end, 1] == 0.0).all()


@pytest.mark.parametrize("m", [0, 1])
def test_a_station_is_left_when_the_plan_leaves_it(m):
    rng = np.random.default_rng(2)
    timed = TIMED[m]
    stations = rng.uniform(0.0, timed.path.length - 0.01, 300)
    times = np.array([planned_time(PIECES, m, s) for s in stations])
    assert timed.station_at(times) == pytest.approx(stations, abs=1e-6)
    # It is left after the wait, not before.
    if m == 1:
        cusp = PATHS[1].cusps[0]
        end = max(t for t, s in zip(timed.times, timed.stations, strict=True) if s <= cusp + 1e-9)
        assert planned_time(PIECES, 1, cusp) == pytest.approx(end)
        assert timed.station_at(end - 8.9) == pytest.approx(cusp)
    assert planned_time(PIECES, m, 0.0) == pytest.approx(timed.times[0])
    last = planned_time(PIECES, m, timed.path.length)
    assert last == pytest.approx(timed.end)
    assert planned_time(PIECES, m, timed.path.length + 5.0) == last


@pytest.mark.parametrize("m", [0, 1])
def test_speeds_alone_are_those_of_the_quickest_drive(m):
    rng = np.random.default_rng(3)
    timed = FASTEST[m]
    times = rng.uniform(0.0, timed.end, 300)
    found = [fastest_at(ALONE, m, s) for s in timed.station_at(times)]
    assert found == pytest.approx(timed.speed_at(times), abs=1e-6)
    assert fastest_at(ALONE, m, timed.path.length) == 0.0
    assert fastest_at(ALONE, m, -0.1) == 0.0


def test_machines_are_late_by_the_time_since_they_should_have_left():
    fleet = FLEET._replace(planned=PIECES)
    for now in (3.0, 14.0, 80.0):
        stations = np.array([11.3, 6.2])
        wanted = [max(now - planned_time(PIECES, m, stations[m]), 0.0) for m in (0, 1)]
        assert lateness(fleet, stations, now) == pytest.approx(wanted)
        assert max(wanted) > 0.0 or now == 3.0
    ends = np.array([each.path.length for each in TIMED])
    assert lateness(fleet, ends - PASSED / 2, 500.0).tolist() == [0.0, 0.0]
    assert (lateness(fleet, ends - 1e-3, 500.0) > 400.0).all()


# Two combines, of which the second has a last piece of 0.2 m, and two carts.
GRAIN = [np.cumsum(RNG.uniform(0.0, 5.0, 9)) - 0.5, np.cumsum(RNG.uniform(0.0, 5.0, 6))]
ENDS = [4.0, 2.2]
TRIPS = np.array([12.0, 30.0, 30.0, 8.0])
FLOWS = np.array([[-np.inf, 50.0], [90.0, 100.0], [130.0, np.inf], [20.0, np.inf]])
FLEET = FleetArrays(
    2,
    PIECES,
    ALONE,
    np.array([0, 1, 2, 3, 4]),
    np.array([*ENDS, 60.0, 60.0]),
    np.array([0.5, 0.5, 1.0, 1.0]),
    np.array([0, 0, 0, 3, 4]),
    TRIPS,
    FLOWS,
    np.array([0, 9, 15]),
    np.concatenate(GRAIN),
    np.array([9000.0, 8000.0]),
    np.array([120.0, 100.0]),
    np.array([False, True]),
)


@pytest.mark.parametrize("n", [0, 1])
def test_grain_comes_in_evenly_between_stations_that_are_known(n):
    rng = np.random.default_rng(5)
    known = np.append(np.arange(len(GRAIN[n]) - 1) * PIECE, ENDS[n])
    stations = np.concatenate([rng.uniform(-0.5, ENDS[n] + 0.5, 300), known])
    found = [cut_up_to(FLEET, n, s) for s in stations]
    assert found == pytest.approx(np.interp(stations, known, GRAIN[n]), abs=1e-9)


@pytest.mark.parametrize(
    ("station", "load", "now", "flows"),
    [
        (12.0, 5.0, 0.0, True),
        (12.0, 5.0, 49.9, True),
        (12.0, 5.0, 50.0, False),
        (12.0, 0.0, 10.0, False),
        (12.0 + 1.9 * PASSED, 5.0, 10.0, True),
        (12.0 - 2.1 * PASSED, 5.0, 10.0, False),
        (30.0, 5.0, 89.9, False),
        (30.0, 5.0, 90.0, True),
        (30.0, 5.0, 110.0, False),
        (30.0, 5.0, 1e9, True),
        (8.0, 5.0, 30.0, False),
    ],
)
def test_a_truck_takes_grain_where_and_when_it_should(station, load, now, flows):
    found = at_trucks(FLEET, np.array([station, 8.0]), np.array([load, 7.0]), now)
    assert found.tolist() == [float(flows), float(now >= 20.0)]


TRACKS = pack_tracks(PATHS)


def test_poses_and_headers_on_packed_paths_are_those_of_the_paths():
    rng = np.random.default_rng(6)
    for _ in range(200):
        at = rng.uniform(-1.0, [path.length + 1.0 for path in PATHS])
        found = poses_on(TRACKS, at).reshape(2, 3)
        wanted = [path.pose_at(s) for path, s in zip(PATHS, at, strict=True)]
        assert found == pytest.approx(np.array(wanted), abs=1e-9)
        down = [p.cutting[p.piece_at(s)] for p, s in zip(PATHS, at, strict=True)]
        assert cutting_on(TRACKS, at).tolist() == [float(each) for each in down]
    lone = pack_tracks([MachinePath.of([(2.0, 3.0, 0.7)]), PATHS[0]])
    assert pose_on(lone, 0, 5.0) == (2.0, 3.0, 0.7)
    assert cutting_on(lone, np.array([0.0, 1.0])).tolist() == [0.0, 1.0]
    assert pose_on(lone, 1, 9.0) == pytest.approx(PATHS[0].pose_at(9.0))


def held(state, control, period):
    """Where a tractor is after its speed and turn rate were held."""
    v, omega = control
    half = omega * period / 2
    chord = v * period * np.sinc(half / math.pi)
    x, y, theta = state
    direction = theta + half
    return np.array(
        [x + chord * math.cos(direction), y + chord * math.sin(direction), theta + 2 * half]
    )


@pytest.mark.parametrize(("m", "station"), [(0, 4.0), (0, 21.0), (1, 2.0), (1, 10.0), (1, 15.6)])
def test_a_tractor_on_its_path_is_steered_along_it(m, station):
    poses = [path.pose_at(4.0) for path in PATHS]
    poses[m] = PATHS[m].pose_at(station)
    states = np.column_stack([np.array(poses), [0.2, 0.1]])
    # A whole turn more is the same heading.
    states[m, 2] += 2 * math.pi
    stations, after = np.array([4.0, 4.0]), np.array([4.0, 4.0])
    stations[m], after[m] = station, station + 0.9
    control = steer(TRACKS, states, stations, after, 0.5, 1e9).reshape(2, 2)
    assert control[1 - m].tolist() == [0.0, 0.0]
    assert held(poses[m], control[m], 0.5) == pytest.approx(
        PATHS[m].pose_at(station + 0.9), abs=1e-9
    )
    assert np.sign(control[m, 0]) == PATHS[m].gears[PATHS[m].piece_at(station)]


@pytest.mark.parametrize("m", [0, 1])
@pytest.mark.parametrize("gain", [0.02, -0.02, 3.0, -3.0])
def test_an_error_along_the_path_is_mended_by_a_part_of_it_that_is_limited(m, gain):
    station, way = (6.0, 0.8) if m == 0 else (12.3, 0.8)
    pose = PATHS[m].pose_at(station)
    gear = PATHS[m].gears[PATHS[m].piece_at(station)]
    states = np.zeros((2, 4))
    states[m, :3] = pose + gain * np.array([math.cos(pose[2]), math.sin(pose[2]), 0.0])
    stations, after = np.array([4.0, 4.0]), np.array([4.0, 4.0])
    stations[m], after[m] = station, station + way
    speed = steer(TRACKS, states, stations, after, 0.4, 1e9)[2 * m]
    wanted = way + float(np.clip(-ALONG * gear * gain, -MOST * way, MOST * way))
    assert speed * 0.4 == pytest.approx(gear * wanted)


@pytest.mark.parametrize("aside", [0.5, -0.7])
@pytest.mark.parametrize(("m", "way"), [(0, 0.6), (0, 1.7), (1, 0.6)])
def test_an_error_across_the_path_turns_the_tractor_back_to_a_point_ahead(m, aside, way):
    station = 6.0 if m == 0 else 10.0
    pose = PATHS[m].pose_at(station)
    gear = PATHS[m].gears[PATHS[m].piece_at(station)]
    states = np.zeros((2, 4))
    states[m, :3] = pose + aside * np.array([-math.sin(pose[2]), math.cos(pose[2]), 0.0])
    stations, after = np.array([4.0, 4.0]), np.array([4.0, 4.0])
    stations[m], after[m] = station, station + way
    _, rate = steer(TRACKS, states, stations, after, 0.5, 1e9).reshape(2, 2)[m]
    # Four metres ahead, as soon as a metre has been driven.
    back = gear * math.atan(aside / 4.0) * min(1.0, way)
    turned = PATHS[m].pose_at(station + way)[2] - pose[2]
    assert rate * 0.5 == pytest.approx(turned - back)
    limited = steer(TRACKS, states, stations, after, 0.5, 0.01).reshape(2, 2)[m]
    assert abs(limited[0] * limited[1]) == pytest.approx(0.01)
    assert np.sign(limited[1]) == np.sign(rate)


def test_the_last_that_is_not_above_a_value_is_found():
    values = np.array([-1.0, 0.0, 0.0, 2.5, 2.5, 4.0, 9.0, 9.0])
    for low in range(8):
        for high in range(low, 9):
            for value in (-2.0, -1.0, 0.0, 1.0, 2.5, 8.9, 9.0, 20.0):
                wanted = low + np.searchsorted(values[low:high], value, side="right") - 1
                assert last_below(values, low, high, value) == wanted
