"""Times of all machines that drive by the rule, in given orders, within their accelerations.

At the beginning of each cell a machine looks at its hold, and chooses how fast it will be at the
end of the cell: as fast as its limits and its acceleration allow, but so that it can stand at the
end of its hold. Between two looks its acceleration is constant; where it all but stands at both
ends of a cell it speeds up and slows down within the cell. A machine that stands at its hold goes
on as soon as the rule lets it. So the plan is driven as machines drive on the field.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_positive
from ..paths import MachinePath, TimedPath, keep_acceleration
from .rule import Meetings, Rule, cause_of, first_nodes, hold_of
from .sweep import SAME, Sweep


@dataclass(frozen=True, eq=False)
class Journey:
    """A machine's path, the ground it covers on it, and how fast it may drive.

    Attributes:
        path: The path.
        sweep: What it covers; its stations include the path's cusps and the stops.
        limits: Largest speed on each piece of the path, one number or shape (n - 1,) [m/s].
        acceleration: Largest acceleration, speeding up and slowing down [m/s^2].
        stops: Stations at which it stands for a reason of its own, shape (k,) [m].
        dwells: How long at each of them, shape (k,) [s].

    Raises:
        InvalidInput: A limit or the acceleration is not positive, a dwell is negative, or a cusp or
            a stop is not a station of the sweep.
    """

    path: MachinePath
    sweep: Sweep
    limits: np.ndarray | float
    acceleration: float
    stops: np.ndarray = field(default_factory=lambda: np.zeros(0))
    dwells: np.ndarray = field(default_factory=lambda: np.zeros(0))

    def __post_init__(self) -> None:
        require_positive("acceleration", self.acceleration)
        limits = np.asarray(self.limits, dtype=float)
        require(bool((limits > 0).all()), "limits", "be positive", limits.min(initial=np.inf))
        shape = np.shape(self.dwells)
        require(shape == np.shape(self.stops), "dwells", "be one a stop", shape)
        require(bool((np.asarray(self.dwells) >= 0).all()), "dwells", "be zero or positive", shape)
        wanted = np.concatenate([self.path.cusps, self.stops])
        nearest = np.abs(
            self.sweep.stations[nearest_stations(self.sweep.stations, wanted)] - wanted
        )
        require(
            bool((nearest <= 2 * SAME).all()), "sweep", "have cusps and stops as stations", nearest
        )


class Paces(NamedTuple):
    """How fast machines may be, in one piece for compiled functions.

    Cells and stations are listed machine by machine.

    Attributes:
        lengths: Of cells, shape (c,) [m].
        limits: Largest speed on each cell, shape (c,) [m/s].
        squares: Largest squared speed at each station if nothing is in the way, shape (c + N,)
            [m^2/s^2].
        dwells: How long the machine stands at each station for a reason of its own, shape
            (c + N,) [s].
        stations: Shape (c + N,) [m].
        accelerations: Of the machines, shape (N,) [m/s^2].
    """

    lengths: np.ndarray
    limits: np.ndarray
    squares: np.ndarray
    dwells: np.ndarray
    stations: np.ndarray
    accelerations: np.ndarray


class Drive(NamedTuple):
    """Result of driving.

    Attributes:
        arrivals: When each machine was at each station, shape (c + N,) [s].
        departures: When it left it, shape (c + N,) [s].
        squares: Its squared speed there, shape (c + N,) [m^2/s^2].
        peaks: Largest speed in each cell if it was larger than at both ends, else 0, shape (c,)
            [m/s].
        progress: Of each machine in the end, shape (N,).
        waiting: Time lost by each machine to each other one, at encounters and for crop, shape
            (N, N, 2) [s].
        by_encounter: Time lost at each encounter, shape (E,) [s].
    """

    arrivals: np.ndarray
    departures: np.ndarray
    squares: np.ndarray
    peaks: np.ndarray
    progress: np.ndarray
    waiting: np.ndarray
    by_encounter: np.ndarray


def paces_of(journeys: list[Journey]) -> Paces:
    """How fast machines may be on their cells and between them."""
    columns = [_paces(journey) for journey in journeys]
    lengths, limits, squares, dwells = (
        np.concatenate([each[k] for each in columns]) for k in range(4)
    )
    stations = np.concatenate([journey.sweep.stations for journey in journeys])
    accelerations = np.array([journey.acceleration for journey in journeys], dtype=float)
    return Paces(lengths, limits, squares, dwells, stations, accelerations)


def _paces(journey: Journey) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    path, stations = journey.path, journey.sweep.stations
    lengths = np.diff(stations)
    pieces = np.broadcast_to(np.asarray(journey.limits, dtype=float), path.lengths.shape)
    cells = np.full(len(lengths), np.inf)
    if path.length > 0:
        # The least limit of all pieces that a cell has a part of.
        first = path.piece_at(stations[:-1] + SAME)
        last = np.maximum(first, path.piece_at(stations[1:] - SAME))
        bounds = np.column_stack([first, last + 1]).ravel()
        cells = np.minimum.reduceat(np.append(pieces, np.inf), bounds)[::2]
    squares = np.minimum(np.append(cells, np.inf), np.append(np.inf, cells)) ** 2
    squares[[0, -1]] = 0.0
    squares[nearest_stations(stations, path.cusps)] = 0.0
    halts = nearest_stations(stations, journey.stops)
    squares[halts] = 0.0
    keep_acceleration(squares, 2 * journey.acceleration * lengths)
    dwells = np.zeros(len(stations))
    np.add.at(dwells, halts, np.asarray(journey.dwells, dtype=float))
    return lengths, cells, squares, dwells


def nearest_stations(stations: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Numbers of the stations nearest to those wanted.

    Args:
        stations: In order, shape (n,) [m].
        wanted: Shape (k,) [m].

    Returns:
        Shape (k,).
    """
    after = np.clip(np.searchsorted(stations, wanted), 1, len(stations) - 1)
    nearer = np.abs(stations[after - 1] - wanted) < np.abs(stations[after] - wanted)
    return after - nearer


@kernel
def crossing(first, last, length, limit, acceleration):
    """How a machine crosses a cell.

    Args:
        first, last: Squared speeds at its ends [m^2/s^2].
        length: Of the cell [m].
        limit: Of the speed in it [m/s].
        acceleration: Largest [m/s^2].

    Returns:
        How long it takes [s], and the largest speed if the acceleration changes in the cell, or 0
        [m/s].
    """
    if length <= 0:
        return 0.0, 0.0
    if max(first, last) > acceleration * length / 2:
        return 2 * length / (np.sqrt(first) + np.sqrt(last)), 0.0
    top = min(limit * limit, (first + last) / 2 + acceleration * length)
    speed = np.sqrt(top)
    changing = (speed - np.sqrt(first) + speed - np.sqrt(last)) / acceleration
    even = length - (2 * top - first - last) / (2 * acceleration)
    return changing + max(even, 0.0) / speed, speed


@compiled
def nominal_durations(cells, paces):
    """How long each cell takes if nothing is in the way, including the dwell at its end.

    Args:
        cells: Of each machine, shape (N,).
        paces: How fast it may be.

    Returns:
        Shape (c,) [s].
    """
    durations = np.empty(len(paces.lengths))
    c = 0
    for m in range(len(cells)):
        for _ in range(cells[m]):
            s = c + m
            taken = crossing(
                paces.squares[s],
                paces.squares[s + 1],
                paces.lengths[c],
                paces.limits[c],
                paces.accelerations[m],
            )[0]
            durations[c] = taken + paces.dwells[s + 1]
            c += 1
    return durations


@compiled
def drive_by_rule(rule: Rule, meetings: Meetings, first, paces: Paces) -> Drive:
    """Let all machines drive by the rule from the beginnings of their paths at time zero.

    Args:
        rule: With the orders told.
        meetings: Conflicts.
        first: The machine that goes first at each encounter, shape (E,).
        paces: How fast they may be.
    """
    count = len(rule.cells)
    nodes = first_nodes(rule.cells)
    size = len(paces.stations)
    drive = Drive(
        np.full(size, np.inf),
        np.full(size, np.inf),
        np.zeros(size),
        np.zeros(len(paces.lengths)),
        np.zeros(count, dtype=np.int64),
        np.zeros((count, count, 2)),
        np.zeros(len(meetings.pairs)),
    )
    progress = drive.progress
    # A machine stands before its first cell as if at the end of one before it.
    progress[:] = -1
    waits = np.ones(count, dtype=np.bool_)
    due = np.zeros(count)
    # Who last held up each machine, whether for crop, and the number of the encounter or -1.
    causes = np.full((count, 3), -1)
    nominal = nominal_durations(rule.cells, paces)
    seen = np.zeros(count, dtype=np.int64)
    for m in range(count):
        drive.arrivals[nodes[m]] = 0.0
        due[m] = paces.dwells[nodes[m]]
        waits[m] = False
    while True:
        m, now = -1, np.inf
        for n in range(count):
            if not waits[n] and progress[n] < rule.cells[n] and due[n] < now:
                m, now = n, due[n]
        if m < 0:
            break
        waits[m] = True
        moved = True
        while moved:
            moved = False
            for n in range(count):
                if not waits[n]:
                    continue
                k = progress[n] + 1
                s = nodes[n] + k
                if k == rule.cells[n]:
                    progress[n] = k
                    drive.departures[s] = now
                    waits[n] = False
                    moved = True
                    continue
                for other in range(count):
                    seen[other] = max(progress[other], 0)
                hold = hold_of(rule, n, seen)
                if hold < k:
                    _note_cause(rule, meetings, first, n, hold, seen, causes)
                    continue
                lost = now - due[n]
                progress[n] = seen[n] = k
                waits[n] = False
                moved = True
                drive.departures[s] = now
                c = s - n
                acceleration = paces.accelerations[n]
                way = paces.stations[nodes[n] + hold + 1] - paces.stations[s + 1]
                square = min(
                    paces.squares[s + 1],
                    drive.squares[s] + 2 * acceleration * paces.lengths[c],
                )
                if 2 * acceleration * way < square:
                    square = 2 * acceleration * way
                    _note_cause(rule, meetings, first, n, hold, seen, causes)
                drive.squares[s + 1] = square
                taken, drive.peaks[c] = crossing(
                    drive.squares[s], square, paces.lengths[c], paces.limits[c], acceleration
                )
                drive.arrivals[s + 1] = now + taken
                due[n] = now + taken + paces.dwells[s + 1]
                lost += taken + paces.dwells[s + 1] - nominal[c]
                if causes[n, 0] >= 0:
                    drive.waiting[n, causes[n, 0], causes[n, 1]] += lost
                    if causes[n, 2] >= 0:
                        drive.by_encounter[causes[n, 2]] += lost
    return drive


@kernel
def _note_cause(rule, meetings, first, m, hold, progress, causes):
    by, crop = cause_of(rule, m, progress)
    causes[m, 0], causes[m, 1], causes[m, 2] = by, 1 if crop else 0, -1
    if by < 0 or crop:
        return
    at = meetings.rows_at[m, by] + hold + 1
    for q in range(meetings.rows[at], meetings.rows[at + 1]):
        if first[meetings.encounters[q]] == by and meetings.ends[q] > progress[by]:
            causes[m, 2] = meetings.encounters[q]
            return


def timed_paths(journeys: list[Journey], drive: Drive, paces: Paces) -> list[TimedPath]:
    """What machines drove, as timed paths.

    Args:
        journeys: Of all machines.
        drive: In which all arrived.
        paces: How fast they might be.
    """
    result = []
    s, c = 0, 0
    for journey in journeys:
        cells = journey.sweep.cells
        nodes, own = slice(s, s + cells + 1), slice(c, c + cells)
        result.append(_timed_path(journey, drive, paces.limits[own], nodes, own))
        s, c = s + cells + 1, c + cells
    return result


def _timed_path(journey, drive, limits, nodes, own) -> TimedPath:
    stations, acceleration = journey.sweep.stations, journey.acceleration
    arrivals, departures = drive.arrivals[nodes], drive.departures[nodes]
    squares, peaks = drive.squares[nodes], drive.peaks[own]
    speeds = np.sqrt(squares)
    # Two phases lie inside of a cell with a peak: speeding up to it, and driving at it.
    up, down = (peaks**2 - squares[:-1]) / 2, (peaks**2 - squares[1:]) / 2
    up, down = up / acceleration, down / acceleration
    peaked = peaks > 0
    begun = departures[:-1] + np.where(peaked, (peaks - speeds[:-1]) / acceleration, 0.0)
    ended = arrivals[1:] - np.where(peaked, (peaks - speeds[1:]) / acceleration, 0.0)
    cells = len(limits)
    columns = np.zeros((3, cells + 1, 4))
    columns[0, :, 0], columns[0, :, 1] = arrivals, departures
    columns[1, :, :2], columns[2, :, :2] = stations[:, None], speeds[:, None]
    columns[0, :-1, 2] = np.where(peaked, begun, departures[:-1])
    columns[0, :-1, 3] = np.where(peaked, np.maximum(ended, begun), departures[:-1])
    columns[1, :-1, 2] = np.where(peaked, stations[:-1] + up, stations[:-1])
    columns[1, :-1, 3] = np.where(peaked, stations[1:] - down, stations[:-1])
    columns[1, :-1, 3] = np.maximum(columns[1, :-1, 3], columns[1, :-1, 2])
    columns[2, :-1, 2:] = np.where(peaked, peaks, speeds[:-1])[:, None]
    times, at, pace = columns.reshape(3, -1)[:, :-2]
    kept = _telling(times, at, pace)
    return TimedPath(journey.path, times[kept], at[kept], pace[kept])


def _telling(times: np.ndarray, stations: np.ndarray, speeds: np.ndarray) -> np.ndarray:
    """Which moments are needed: not those that repeat, nor those amid a stretch at even speed."""
    kept = np.append(True, np.diff(times) > 0)
    numbers = np.flatnonzero(kept)
    before, here, after = numbers[:-2], numbers[1:-1], numbers[2:]
    even = (np.abs(speeds[before] - speeds[here]) < 1e-12) & (
        np.abs(speeds[after] - speeds[here]) < 1e-12
    )
    # Standing and driving at the same speed are told apart by the way.
    span = stations[after] - stations[before]
    even &= np.abs(span - speeds[here] * (times[after] - times[before])) < 1e-9
    kept[here[even]] = False
    kept[-1] = kept[-1] or len(times) == 1
    return kept
