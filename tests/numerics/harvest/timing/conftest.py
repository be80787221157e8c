"""Fleets of made-up paths that meet, how they drive late, and how near their outlines come."""

from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.machines import Combine, combine_outline
from sightfield.systems.numerics.harvest.paths import MachinePath
from sightfield.systems.numerics.harvest.timing.rule import hold_of
from sightfield.systems.numerics.harvest.timing.sweep import grid_stations, sweep_of
from sightfield.systems.numerics.harvest.timing.timed_drive import Journey
from sightfield.systems.numerics.harvest.timing.timetable import MachineTimetable, time_machines

COMBINE = Combine(header_width=7.5, length=7.0, width=3.4, turning_radius=6.5, speed=1.7)
OUTLINE = combine_outline(COMBINE)
RADIUS = COMBINE.turning_radius

# Of the simulation [s].
STEP = 0.25

# Less than this beyond the end of a cell a machine is still on it, as it is where it stands at the
# end of it [m].
TOLERANCE = 0.02


def drive(start, *moves):
    """A path of moves (way, curvature), the way negative backwards, from a pose."""
    poses, gears = [np.array(start, dtype=float)], []
    for way, curvature in moves:
        pieces = max(1, int(np.ceil(abs(way) * max(0.02, abs(curvature)) / 0.4)))
        for _ in range(pieces):
            x, y, theta = poses[-1]
            step, turn = way / pieces, way * curvature / pieces
            chord = step * np.sinc(turn / (2 * np.pi))
            ahead = theta + turn / 2
            poses.append(
                np.array([x + chord * np.cos(ahead), y + chord * np.sin(ahead), theta + turn])
            )
            gears.append(int(np.sign(way)))
    count = len(gears)
    return MachinePath(
        np.array(poses), np.array(gears), np.ones(count, dtype=bool), np.zeros(count, dtype=int)
    )


def journey(path, speed=COMBINE.speed, spacing=1.0):
    """A combine's journey along a path."""
    sweep = sweep_of(path, OUTLINE, grid_stations(path, spacing))
    return Journey(path, sweep, speed, COMBINE.acceleration)


def crossing_lines(rng, count=3):
    """Straight ways through a common place, from all directions."""
    turns = rng.permutation(count) * 2 * np.pi / count + rng.uniform(0, 0.8 * np.pi / count, count)
    paths = []
    for turn in turns:
        before, after = rng.uniform(40, 90), rng.uniform(40, 90)
        side = rng.uniform(-8, 8)
        ahead = np.array([np.cos(turn), np.sin(turn)])
        begin = -before * ahead + side * np.array([-ahead[1], ahead[0]])
        paths.append(drive((*begin, turn), (before + after, 0.0)))
    return paths


def lane_with_bays(rng, count=3):
    """A lane driven both ways, by machines that begin and end off it; those against have bays.

    A bay is a swing to the side of the lane, and back on to it.
    """
    bend = 1 / RADIUS
    quarter = RADIUS * np.pi / 2

    def swing(side):
        away, back = (quarter, side * bend), (quarter, -side * bend)
        # Two quarters to the side and two back, and a straight between them where it is free.
        return [away, back, (rng.uniform(12, 30), 0.0), back, away]

    paths = []
    for number in range(count):
        # Those that drive along the lane keep on it; those that drive against it swing off it.
        along = number == 0
        off = 20.0 + 12.0 * number
        entry = (quarter, -bend if along else bend)
        exit_ = (quarter, bend if along else -bend)
        lane = rng.uniform(150, 190)
        if along:
            start = (-20.0, off, -np.pi / 2)
            paths.append(
                drive(start, (off - RADIUS, 0.0), (quarter, bend), (lane + 70, 0.0), exit_, (30, 0))
            )
        else:
            x = 190.0 + 14.0 * number
            start = (x, -off, np.pi / 2)
            before = rng.uniform(20, 60)
            moves = [(off - RADIUS, 0.0), (quarter, bend), (before, 0.0), *swing(1)]
            moves += [(lane - before, 0.0), entry, (20.0 + 12 * number, 0.0)]
            paths.append(drive(start, *moves))
    return paths


def adjacent_swaths(rng, count=3, swaths=4):
    """Combines on every n-th swath, in either direction, that turn on common headlands."""
    width = COMBINE.header_width
    length = rng.uniform(60, 100)
    bend, quarter = 1 / RADIUS, RADIUS * np.pi / 2
    over = count * width - 2 * RADIUS
    paths = []
    for number in range(count):
        up = rng.random() < 0.5
        run = rng.uniform(10, 30)
        moves = [(run + length, 0.0)]
        side = -1 if up else 1
        for _ in range(swaths - 1):
            moves += [(quarter, side * bend), (over, 0.0), (quarter, side * bend), (length, 0.0)]
            side = -side
        moves[-1] = (length + rng.uniform(10, 60), 0.0)
        x = number * width
        y, theta = (-run, np.pi / 2) if up else (length + run, -np.pi / 2)
        paths.append(drive((x, y, theta), *moves))
    return paths


def wanderers(rng, count=4, pieces=24):
    """Ways of arcs and straights, with cusps, all over the same ground."""
    paths = []
    for number in range(count):
        angle = 2 * np.pi * (number + rng.uniform(-0.2, 0.2)) / count
        start = (70 * np.cos(angle), 70 * np.sin(angle), angle + np.pi + rng.uniform(-0.5, 0.5))
        moves = []
        for _ in range(pieces):
            curvature = rng.choice([0.0, 1 / RADIUS, -1 / RADIUS, rng.uniform(-0.1, 0.1)])
            gear = -1 if rng.random() < 0.15 else 1
            moves.append((gear * rng.uniform(2, 20), curvature))
        moves.append((120.0, 0.0))
        paths.append(drive(start, (30.0, 0.0), *moves))
    return paths


KINDS = (crossing_lines, lane_with_bays, adjacent_swaths, wanderers)


def journeys_of(paths, rng):
    """Journeys at speeds that differ."""
    speeds = rng.uniform(1.2, 2.2, len(paths))
    return [journey(path, speed) for path, speed in zip(paths, speeds, strict=True)]


def fleet_that_can_arrive(kind, rng, count):
    """Journeys of the first made-up paths of a kind that can all be driven."""
    while True:
        journeys = journeys_of(KINDS[kind](rng, count), rng)
        if isinstance(time_machines(journeys, trials=0), MachineTimetable):
            return journeys


def progress_at(timetable, stations):
    """Progress of machines that are at some stations, shape (N,) [m] -> (N,)."""
    found = []
    for grid, station in zip(timetable.stations, stations, strict=True):
        on = int(np.searchsorted(grid, station - TOLERANCE)) - 1
        arrived = station >= grid[-1] - TOLERANCE
        found.append(len(grid) - 1 if arrived else max(on, 0))
    return np.array(found)


def holds_now(timetable, stations):
    """The station up to which each machine may drive by the rule, shape (N,) [m] -> (N,) [m]."""
    progress = progress_at(timetable, stations)
    holds = [hold_of(timetable.rule, m, progress) for m in range(len(progress))]
    return np.array([grid[k + 1] for grid, k in zip(timetable.stations, holds, strict=True)])


def drive_disturbed(journeys, timetable, rng, patience=20_000.0):
    """Speeds off by up to 20% and stops of up to 120 s; stations at all times, shape (T, N) [m]."""
    count = len(journeys)
    lengths = np.array([journey.path.length for journey in journeys])
    factor = rng.uniform(0.8, 1.2, count)
    stops = [np.sort(rng.uniform(0, length, rng.integers(0, 4))) for length in lengths]
    stands = np.zeros(count)
    at, speed = np.zeros(count), np.zeros(count)
    rate = np.array([journey.acceleration for journey in journeys])
    top = np.array([float(journey.limits) for journey in journeys])
    log = [at.copy()]
    holds = holds_now(timetable, at)
    while (at < lengths - 0.01).any():
        assert len(log) * STEP < patience, f"not finished: {at} of {lengths}"
        if len(log) % 400 == 0:
            factor = rng.uniform(0.8, 1.2, count)
        for m in range(count):
            if len(stops[m]) and at[m] > stops[m][0]:
                stands[m] = rng.uniform(0, 120)
                stops[m] = stops[m][1:]
        after = holds_now(timetable, at)
        assert (after >= holds).all(), "a hold moved back"
        holds = after
        # The largest speed after the step from which the machine can stand at its hold.
        way = np.maximum(np.minimum(holds, lengths) - at - speed * STEP / 2, 0.0)
        brake = np.sqrt(2 * rate * way + (rate * STEP / 2) ** 2) - rate * STEP / 2
        wanted = np.where(stands > 0, 0.0, top * factor)
        wanted = np.minimum(wanted, np.maximum(brake, 0.0))
        new = np.clip(wanted, speed - rate * STEP, speed + rate * STEP)
        new = np.maximum(new, 0.0)
        step = (speed + new) / 2 * STEP
        # What is left of a few millimetres is driven at a crawl.
        crawl = (new < 0.05) & (stands <= 0)
        step = np.where(crawl, np.minimum(np.maximum(holds - at, 0.0), 0.02), step)
        at, speed = at + step, new
        stands = np.maximum(stands - STEP, 0.0)
        log.append(at.copy())
    return np.array(log)


def outlines_at(path, outline, stations):
    """Parts of a machine at stations, shape (parts, T) of Shapely polygons."""
    x, y, theta = path.pose_at(stations).T
    c, s = np.cos(theta), np.sin(theta)
    turn = np.stack([np.stack([c, -s], -1), np.stack([s, c], -1)], -2)
    place = np.column_stack([x, y])[:, None]
    return np.array(
        [shapely.polygons(np.einsum("tij,cj->tci", turn, part) + place) for part in outline]
    )


def least_distance(journeys, log, outline=OUTLINE):
    """Least distance of any two machines at any of the times [m]."""
    shapes = [outlines_at(journey.path, outline, log[:, m]) for m, journey in enumerate(journeys)]
    reach = max(np.hypot(*part.T).max() for part in outline)
    places = [journey.path.pose_at(log[:, m])[:, :2] for m, journey in enumerate(journeys)]
    least = np.inf
    for m in range(len(journeys)):
        for n in range(m):
            near = np.hypot(*(places[m] - places[n]).T) < 2 * reach + 2
            for one in shapes[m]:
                for other in shapes[n]:
                    apart = shapely.distance(one[near], other[near])
                    least = min(least, apart.min(initial=np.inf))
    return least


def polygons_of(sweep, cell):
    """Polygons of a cell of a sweep, each of shape (c, 2) [m]."""
    numbers = range(cell * sweep.parts, (cell + 1) * sweep.parts)
    return [sweep.points[sweep.starts[q] : sweep.starts[q + 1]] for q in numbers]


def cover_of(sweep, cell):
    """All polygons of a cell as one."""
    return shapely.union_all([shapely.Polygon(points) for points in polygons_of(sweep, cell)])


@pytest.fixture(scope="session")
def fleets():
    """Made-up fleets, machines that are late, and distances by Shapely."""
    return SimpleNamespace(
        kinds=KINDS,
        outline=OUTLINE,
        drive=drive,
        journey=journey,
        journeys_of=journeys_of,
        fleet_that_can_arrive=fleet_that_can_arrive,
        drive_disturbed=drive_disturbed,
        progress_at=progress_at,
        holds_now=holds_now,
        outlines_at=outlines_at,
        polygons_of=polygons_of,
        cover_of=cover_of,
        least_distance=least_distance,
    )
