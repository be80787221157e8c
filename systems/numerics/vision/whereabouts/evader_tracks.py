"""Which evader each camera saw: tracks that lose nobody whom cameras see.

Each evader has a track of nearly constant velocity (`position_filter`) and a set of the places
where it may be (`reachable_set`). A detection belongs to a track if it is near the place where the
track puts the evader, or, once the track is no longer fresh, in the set; with several evaders of
one colour detections are shared out by likelihood. A detection that belongs to no track begins a
hypothesis. A hypothesis that goes on for `CONFIRMED` seconds, while the track of its colour is not
seen, is the evader: the track was wrong, whatever it said of its certainty. So no evader that is
seen is left out for longer.

Source: ours; tracks, gates and hypotheses as in Blackman, Multiple hypothesis tracking for multiple
target tracking, IEEE AES Magazine 19, 2004.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from ...geometry.edge_index import EdgeIndex
from ..estimation.position_filter import GATE, Track, correct_at, limit_speed, predict, start_track
from .reachable_set import (
    PlaceGrid,
    empty_set,
    fill_disc,
    fill_everywhere,
    grow,
    look_and_see_nothing,
    may_be_at,
    members,
    see_places,
    view_depths,
)

# Numbers of a track: when the evader was last measured (-inf: never); the disc that its set began
# with, x, y, and when it would have left there to be anywhere in the set (-inf: it did not come
# from there); x, y, v_x and v_y when it was measured, and their covariance.
TRACK_SIZE = 4 + 4 + 16
# Of a hypothesis: its colour (-1: none), when it was first and last seen, and where, as above.
HYPOTHESIS_SIZE = 3 + 4 + 16
# Hypotheses of each colour that are kept at most.
HYPOTHESES = 4
# Time after which a hypothesis is taken for the evader; a track is fresh for as long, so that no
# single picture overrules it. Time unseen after which a hypothesis is given up [s].
CONFIRMED, GIVEN_UP = 0.2, 1.0
# For how long an unseen evader is looked for where its velocity leads, and looks that leave it no
# place at all are taken for mistakes [s].
PATIENCE = 0.5
# How far ahead of the present sets are worked out [s].
AHEAD = 0.6
# Standard deviations to which 99% and 99.9% of a plane's Gaussian reach.
_SURE, _GATE_WIDTH = 3.035, math.sqrt(GATE)


@dataclass(frozen=True, eq=False)
class Search:
    """What is known of the search before it begins.

    Attributes:
        grid: Places where evaders can be.
        walls: Edges of the world that blocks sight.
        colours: Number of the colour of each evader, shape (Ne,): equal for identical shells.
        speed: Of the evaders, at most [m/s].
        density: Of the white noise that changes their velocities [m^2/s^3].
        shell_radius: Of evaders [m].
        certain_range: Distances between which a camera finds shells for certain [m].
        body_radius: Of pursuers, which stand in the way of sight [m].
    """

    grid: PlaceGrid
    walls: EdgeIndex
    colours: tuple[int, ...]
    speed: float
    density: float
    shell_radius: float
    certain_range: tuple[float, float]
    body_radius: float


@dataclass(frozen=True, eq=False)
class Picture:
    """What one picture said.

    Attributes:
        time: When it was taken [s].
        pose: Where the camera was then, x, y [m] and heading, shape (3,).
        positions: Of each evader's colour, in the order of the evaders, shape (Ne, 2) [m]; shells
            of one colour come in any order.
        covariances: Shape (Ne, 2, 2) [m^2].
        valid: Which of these there are, shape (Ne,), bool.
        doubtful: Where something of the colour was seen but not measured, shape (Ne,), bool.
    """

    time: float
    pose: np.ndarray
    positions: np.ndarray
    covariances: np.ndarray
    valid: np.ndarray
    doubtful: np.ndarray


@dataclass(frozen=True, eq=False)
class Knowledge:
    """All that is remembered; `take_in` writes to the arrays.

    Attributes:
        tracks: A row per evader, shape (Ne, TRACK_SIZE).
        hypotheses: Shape (HYPOTHESES times colours, HYPOTHESIS_SIZE).
        sets: Of each evader, shape (Ne, 4, cells).
    """

    tracks: np.ndarray
    hypotheses: np.ndarray
    sets: np.ndarray


def no_knowledge(search: Search) -> Knowledge:
    """No evader has been seen, and each may be anywhere.

    Args:
        search: What is searched for.
    """
    count, kinds = len(search.colours), len(set(search.colours))
    tracks = np.zeros((count, TRACK_SIZE))
    tracks[:, [0, 3]] = -np.inf
    hypotheses = np.zeros((HYPOTHESES * kinds, HYPOTHESIS_SIZE))
    hypotheses[:, 0] = -1.0
    sets = np.stack([empty_set(search.grid) for _ in range(count)])
    for reach in sets:
        fill_everywhere(search.grid, reach, search.speed, 0.0)
    return Knowledge(tracks, hypotheses, sets)


def track_of(row: np.ndarray) -> Track:
    """The last numbers of a row as a track.

    Args:
        row: Shape (TRACK_SIZE,) or (HYPOTHESIS_SIZE,).
    """
    return Track(row[-20:-16], row[-16:].reshape(4, 4))


def take_in(search: Search, knowledge: Knowledge, pictures: Sequence[Picture], now: float) -> None:
    """Learn from pictures, and let time pass.

    Args:
        search: What is searched for.
        knowledge: Overwritten.
        pictures: Those not taken in before; they may be late, and differently so.
        now: [s].
    """
    _grow_sets(search, knowledge, now)
    for picture in sorted(pictures, key=lambda each: each.time):
        found = [_share_out(search, knowledge, picture, colour) for colour in _kinds(search)]
        for each in found:
            for j, k in each.items():
                _measured(search, knowledge, j, picture, k, now)
    _let_hypotheses_win(search, knowledge, now)
    for picture in pictures:
        _look(search, knowledge, picture, pictures, now)


def positions_now(search: Search, knowledge: Knowledge, now: float) -> np.ndarray:
    """Where each evader most likely is, shape (Ne, 2) [m]: a place of its set; NaN if never seen.

    Args:
        search: What is searched for.
        knowledge: Of the evaders.
        now: [s].
    """
    places = np.full((len(search.colours), 2), np.nan)
    for j, row in enumerate(knowledge.tracks):
        if np.isinf(row[0]):
            continue
        x, y = track_of(row).mean[:2] + (now - row[0]) * track_of(row).mean[2:]
        reach = knowledge.sets[j]
        if now - row[0] > PATIENCE and not may_be_at(search.grid, reach, search.speed, now, x, y):
            left = search.grid.places[members(reach, now)]
            x, y = left[np.argmin(np.hypot(left[:, 0] - x, left[:, 1] - y))]
        places[j] = x, y
    return places


def covariances_now(
    search: Search, knowledge: Knowledge, positions: np.ndarray, now: float
) -> np.ndarray:
    """How sure positions are, shape (Ne, 2, 2) [m^2]; infinite on the diagonal if never seen.

    Args:
        search: What is searched for.
        knowledge: Of the evaders.
        positions: Of `positions_now`, shape (Ne, 2) [m].
        now: [s].
    """
    spreads = np.tile(np.diag([np.inf, np.inf]), (len(positions), 1, 1))
    for j, row in enumerate(knowledge.tracks):
        if np.isinf(row[0]):
            continue
        if now - row[0] <= PATIENCE:
            spreads[j] = predict(track_of(row), now - row[0], search.density).covariance[:2, :2]
            continue
        off = search.grid.places[members(knowledge.sets[j], now)] - positions[j]
        spreads[j] = off.T @ off / len(off) + search.grid.area / 12 * np.eye(2)
    return spreads


def _disc(row: np.ndarray) -> np.ndarray:
    """Where a set began and when the evader has left there at the earliest, shape (3,)."""
    return row[1:4]


def _kinds(search: Search) -> list[int]:
    return sorted(set(search.colours))


def _grow_sets(search: Search, knowledge: Knowledge, now: float) -> None:
    nothing, looked = np.zeros(len(search.grid.usable), dtype=bool), np.empty((4, 0))
    for row, reach in zip(knowledge.tracks, knowledge.sets, strict=True):
        grow(search.grid, reach, looked, nothing, _disc(row), search.speed, now, now + AHEAD)


def _share_out(
    search: Search, knowledge: Knowledge, picture: Picture, colour: int
) -> dict[int, int]:
    """Which track gets which detection of a colour; what is left over feeds hypotheses."""
    slots = [j for j, each in enumerate(search.colours) if each == colour]
    seen = [k for k in slots if picture.valid[k]]
    if not seen:
        return {}
    # Minus twice the logarithm of the likelihood, and more than any for what cannot be.
    never = 1e6
    costs = np.array([[_cost(search, knowledge, j, picture, k) for k in seen] for j in slots])
    rows, columns = linear_sum_assignment(np.minimum(costs, never))
    shared = {slots[r]: seen[c] for r, c in zip(rows, columns, strict=True) if costs[r, c] < never}
    for k in set(seen) - set(shared.values()):
        _suppose(search, knowledge, picture, k, colour)
    return shared


def _cost(search: Search, knowledge: Knowledge, j: int, picture: Picture, k: int) -> float:
    row, spot, spread = knowledge.tracks[j], picture.positions[k], picture.covariances[k]
    cost = math.inf
    passed = picture.time - row[0]
    if abs(passed) <= PATIENCE:
        track = predict(track_of(row), max(passed, 0.0), search.density)
        off = spot - track.mean[:2] - min(passed, 0.0) * track.mean[2:]
        expected = track.covariance[:2, :2] + spread
        square = float(off @ np.linalg.solve(expected, off))
        if square <= GATE:
            cost = square + math.log(np.linalg.det(2 * math.pi * expected))
    if abs(passed) <= CONFIRMED:
        return cost
    margin = _GATE_WIDTH * math.sqrt(np.linalg.eigvalsh(spread)[-1]) / search.speed
    due = max(picture.time, row[0] if math.isfinite(row[0]) else 0.0) + margin
    reach = knowledge.sets[j]
    if may_be_at(search.grid, reach, search.speed, due, spot[0], spot[1]):
        area = search.grid.area * max(int(members(reach, due).sum()), 1)
        cost = min(cost, GATE + 2 * math.log(area))
    return cost


def _measured(
    search: Search, knowledge: Knowledge, j: int, picture: Picture, k: int, now: float
) -> None:
    """Update a track with the detection that belongs to it."""
    row, spot, spread = knowledge.tracks[j], picture.positions[k], picture.covariances[k]
    passed = picture.time - row[0]
    track = None
    if abs(passed) <= PATIENCE:
        track = correct_at(track_of(row), passed, spot, spread, search.density)
    if track is None:
        # Found again by one picture, which may be wrong: the set stays until the next one agrees.
        track = start_track(spot, spread, 0.5 * search.speed)
        row[0], row[4:8], row[8:] = picture.time, track.mean, track.covariance.ravel()
        return
    _write(search, knowledge, j, track, max(row[0], picture.time), now)


def _write(
    search: Search, knowledge: Knowledge, j: int, track: Track, time: float, now: float
) -> None:
    row = knowledge.tracks[j]
    track = limit_speed(track, search.speed)
    radius = _SURE * math.sqrt(np.linalg.eigvalsh(track.covariance[:2, :2])[-1])
    row[0], row[4:8], row[8:] = time, track.mean, track.covariance.ravel()
    x, y = track.mean[:2].tolist()
    row[1:4] = fill_disc(
        search.grid, knowledge.sets[j], x, y, radius, search.speed, time, now + AHEAD
    )


def _suppose(search: Search, knowledge: Knowledge, picture: Picture, k: int, colour: int) -> None:
    """Add a detection to the hypothesis that it continues, or begin one."""
    spot, spread = picture.positions[k], picture.covariances[k]
    mine = knowledge.hypotheses[:, 0] == colour
    for h in np.flatnonzero(mine):
        row = knowledge.hypotheses[h]
        passed = picture.time - row[2]
        if abs(passed) > GIVEN_UP:
            continue
        track = correct_at(track_of(row), passed, spot, spread, search.density)
        away = float(np.linalg.norm(spot - track_of(row).mean[:2]))
        scatter = np.linalg.eigvalsh(track_of(row).covariance[:2, :2] + spread)[-1]
        if track is None and away <= search.speed * abs(passed) + _GATE_WIDTH * scatter**0.5:
            track = start_track(spot, spread, 0.5 * search.speed)
        if track is not None:
            track = limit_speed(track, search.speed)
            row[1] = min(row[1], picture.time)
            row[2] = max(row[2], picture.time)
            row[3:7], row[7:] = track.mean, track.covariance.ravel()
            return
    stale = knowledge.hypotheses[:, 0] < 0
    free = np.flatnonzero(stale)
    # A colour has HYPOTHESES at most; the one unseen for longest makes room.
    if len(free) == 0 or mine.sum() >= HYPOTHESES:
        own = np.flatnonzero(mine)
        h = own[np.argmin(knowledge.hypotheses[own, 2])]
    else:
        h = free[0]
    track = start_track(spot, spread, 0.5 * search.speed)
    row = knowledge.hypotheses[h]
    row[:3] = colour, picture.time, picture.time
    row[3:7], row[7:] = track.mean, track.covariance.ravel()


def _let_hypotheses_win(search: Search, knowledge: Knowledge, now: float) -> None:
    """Give up unseen hypotheses; let those that last replace a track of their colour not seen."""
    for row in knowledge.hypotheses:
        if row[0] < 0:
            continue
        if now - row[2] > GIVEN_UP:
            row[0] = -1.0
            continue
        if row[2] - row[1] < CONFIRMED - 1e-9:
            continue
        unseen = [
            j
            for j, colour in enumerate(search.colours)
            if colour == row[0] and knowledge.tracks[j, 0] <= row[2] - CONFIRMED + 1e-9
        ]
        if unseen:
            j = min(unseen, key=lambda each: knowledge.tracks[each, 0])
            _write(search, knowledge, j, track_of(row), float(row[2]), now)
            row[0] = -1.0


def _look(
    search: Search, knowledge: Knowledge, picture: Picture, others: Sequence[Picture], now: float
) -> None:
    """Take away from the sets of unseen evaders what a picture shows to be empty."""
    hidden = [
        j
        for j, row in enumerate(knowledge.tracks)
        if row[0] < picture.time and not _in_doubt(search, picture, search.colours[j])
    ]
    if not hidden:
        return
    x, y = picture.pose[:2]
    pursuers = [(*each.pose[:2], search.body_radius) for each in others if each is not picture]
    for j in hidden:
        shadows = [
            (*row[4:6], search.shell_radius + search.speed * abs(picture.time - row[0]))
            for i, row in enumerate(knowledge.tracks)
            if i != j and abs(picture.time - row[0]) <= PATIENCE
        ]
        bodies = np.array([*pursuers, *shadows], dtype=float).reshape(-1, 3)
        depths = view_depths(search.walls, x, y, bodies)
        grid, reach = search.grid, knowledge.sets[j]
        seen = see_places(grid, depths, x, y, search.shell_radius, *search.certain_range)
        until = now + AHEAD
        row, when = knowledge.tracks[j], picture.time
        if look_and_see_nothing(grid, reach, seen, _disc(row), search.speed, when, until):
            continue
        if when - row[0] > PATIENCE:
            # Its set is empty: it was never where the track had it, and may be anywhere.
            row[3] = -np.inf
            fill_everywhere(grid, reach, search.speed, when)
            look_and_see_nothing(grid, reach, seen, _disc(row), search.speed, when, until)


def _in_doubt(search: Search, picture: Picture, colour: int) -> bool:
    """Whether something of a colour was seen that cannot be told from an evader."""
    return any(picture.doubtful[k] for k, each in enumerate(search.colours) if each == colour)
