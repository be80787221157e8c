"""Covering a field by combines on adjacent rows, from the perimeter inwards (Zhang 2014, 3.2.1)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import shapely

from ...errors import require, require_non_negative, require_positive
from .combine_path import CombinePath
from .field import Field
from .leftovers import find_blocks
from .pace.holds import Holds, station_limits
from .pace.right_of_way import find_crossings
from .pace.timeline import Timeline, run_timeline
from .pace.waiting import find_holds, least_delays
from .parking import park
from .rings.loops import lay_out_loops
from .stubble import Stubble
from .swept_cells import CropCells, Sweeps, bare_cells, cut_cells, join_sweeps
from .tours import Tour, drive_blocks, drive_loops
from .track import join_tracks, split_track

# Most cells that coverage is measured with, and cells across a header.
MOST_CELLS = 4e6
CELLS_ACROSS = 16

# How often it is looked where combines would meet on their ways between loops.
ROUNDS = 3

# Straights are cut into pieces of this many headers' width at most.
LONGEST_PIECE = 1.0


@dataclass(frozen=True, eq=False)
class CoveragePlan:
    """Paths of all combines, and what they leave.

    Attributes:
        field: The field.
        header_width: Width that a combine cuts [m].
        turning_radius: Least radius of the combines [m].
        paths: Of the combines, in the order of their rows.
        rings: Of each loop and pass, in the order in which they are begun, the number of rings
            between it and the edge; -1 for a pass.
        cells: The field in cells as the plan cuts it.
        covered_area: Crop that is cut [m^2].
        overlap_area: Crop that loops and passes sweep over again after it has been cut [m^2].
        holds: What each combine waits for.
        timeline: When everybody is where, at one speed.
        reasons: What could not be done as it should, in words.
    """

    field: Field
    header_width: float
    turning_radius: float
    paths: tuple[CombinePath, ...]
    rings: tuple[int, ...]
    cells: CropCells
    covered_area: float
    overlap_area: float
    holds: tuple[Holds, ...]
    timeline: Timeline
    reasons: tuple[str, ...]

    @property
    def covered_fraction(self) -> float:
        """Of the crop's area, in [0, 1]."""
        return self.covered_area / self.field.area

    @property
    def missed_area(self) -> float:
        """Crop that is left standing [m^2]."""
        return self.field.area - self.covered_area

    @cached_property
    def gaps(self) -> tuple[np.ndarray, ...]:
        """How far ahead of each combine the one on its left is, by the plan.

        Of each combine an array of rows: its station; way that the other has driven, by then,
        since it passed the point beside [m]; number of the other. Empty if nobody is on its left.

        The arrays have the shape (k, 3).
        """
        found = []
        for n in range(len(self.paths)):
            rows = [np.zeros((0, 3))]
            for hold in self.holds:
                if hold.waiting == n and hold.beside:
                    clock = self.timeline.clock_at(n, hold.stations)
                    ahead = self.timeline.station_at(hold.other, clock) - hold.passed
                    rows.append(
                        np.column_stack([hold.stations, ahead, np.full(len(ahead), hold.other)])
                    )
            joined = np.concatenate(rows)
            found.append(joined[np.argsort(joined[:, 0], kind="stable")])
        return tuple(found)

    def station_limits(self, progress: np.ndarray) -> np.ndarray:
        """How far each combine may drive for now, so that the left of all stays open.

        Args:
            progress: Stations of all combines, shape (N,) [m].

        Returns:
            Stations to wait at, infinite where there is nothing to wait for, shape (N,) [m].
        """
        return station_limits(self.holds, progress)

    def crop_cells(self, size: float) -> CropCells:
        """The field in cells of a size of your own, cut in the plan's order.

        Args:
            size: Side of a cell, which is made smaller to fit the width of the field [m].

        Raises:
            InvalidInput: The size is not positive.
        """
        require_positive("size", size)
        bare = bare_cells(self.field.world, size)
        sweeps, _ = _in_order(self.paths, self.timeline)
        return cut_cells(bare, sweeps, self.header_width)[0]


def plan_coverage(
    field: Field,
    header_width: float,
    turning_radius: float,
    combines: int = 2,
    *,
    spacing: float | None = None,
    least_gap: float | None = None,
    least_pass: float | None = None,
    length: float | None = None,
) -> CoveragePlan:
    """Plan how combines on adjacent rows harvest a field, from its perimeter inwards.

    Loop after loop is dealt out to the combines in turn; all are driven clockwise, so that the
    left of every combine is the margin or has been cut. Crop that the loops leave gets straight
    passes in the end, such as the middle row of Figure 3.8.

    Args:
        field: The field.
        header_width: Width that a combine cuts, l [m].
        turning_radius: Least radius of the combines [m].
        combines: How many.
        spacing: Way by which each combine starts behind the one before, d_init [m]; None: what
            keeps them from waiting later, but no more than their share of the first lap.
        least_gap: Way by which the combine on the left is to be ahead, d_min [m]; None: two
            headers' widths.
        least_pass: Crop that a pass is worth driving for [m^2]; None: half of a header's square.
        length: Of a combine behind its header [m]; None: a header's width.

    Raises:
        InvalidInput: A number is out of its range, or the field is smaller than the header.
    """
    _check(field, header_width, turning_radius, combines)
    gap = 2.0 * header_width if least_gap is None else least_gap
    least = 0.5 * header_width**2 if least_pass is None else least_pass
    require_non_negative("least_gap", gap)
    require_positive("least_pass", least)
    if spacing is not None:
        require_non_negative("spacing", spacing)

    loops = lay_out_loops(field, header_width, turning_radius)
    size = max(header_width / CELLS_ACROSS, (field.outline.area / MOST_CELLS) ** 0.5)
    bare = bare_cells(field.world, size)
    stubble = Stubble(bare, header_width)
    tours, reasons = drive_loops(field, loops, stubble, header_width, turning_radius, combines)
    blocks = find_blocks(stubble.cells, header_width, least, field.ground)
    rows, problems = drive_blocks(field, tours, loops, blocks, stubble, turning_radius)
    last = len(loops) + rows
    reasons += problems + park(field, tours, loops, last, stubble, header_width, turning_radius)
    tours = [tour for tour in tours if tour.tracks]

    paths = [_path(tour, header_width) for tour in tours]
    holds = find_holds(paths, _cut_in_turn(bare, tours, header_width), header_width, gap)
    if spacing is None:
        first_lap = tours[0].tracks[0].length + tours[0].tracks[1 % len(tours[0].tracks)].length
        delays = least_delays(holds, len(paths), first_lap / len(paths))
    else:
        delays = spacing * np.arange(len(paths))
    lengths = [path.length for path in paths]
    timeline = run_timeline(lengths, delays, holds, header_width / 4)
    # Who waits comes later elsewhere, and may meet others there.
    for _ in range(ROUNDS):
        behind = header_width if length is None else length
        holds += find_crossings(paths, timeline, header_width, behind)
        timeline = run_timeline(lengths, delays, holds, header_width / 4)

    paths = [path.with_stations(timeline.stops(n)) for n, path in enumerate(paths)]
    sweeps, pieces = _in_order(paths, timeline)
    cells, areas = cut_cells(bare, sweeps, header_width)
    swept = sum(
        header_width * float(np.diff(p.stations)[(p.gears > 0) & (p.loops >= 0)].sum())
        for p in paths
    )
    finished = []
    for n, path in enumerate(paths):
        cut = np.zeros(len(path.gears))
        mine = pieces[:, 0] == n
        cut[pieces[mine, 1]] = areas[mine]
        finished.append(replace(path, cut_area=cut, start_delay=float(delays[n])))
    covered = float(areas.sum())
    rings = [*(loop.ring for loop in loops), *[-1] * rows]
    return CoveragePlan(
        field,
        header_width,
        turning_radius,
        tuple(finished),
        tuple(rings),
        cells,
        covered,
        swept - covered,
        holds,
        timeline,
        tuple(reasons),
    )


def _check(field: Field, header: float, radius: float, combines: int) -> None:
    require_positive("header_width", header)
    require_positive("turning_radius", radius)
    whole = isinstance(combines, int) and not isinstance(combines, bool)
    require(whole and combines >= 1, "combines", "be a whole number from 1 on", combines)
    box = field.outline.minimum_rotated_rectangle
    x, y = np.diff(shapely.get_coordinates(box)[:3], axis=0)
    narrow = float(min(np.hypot(*x), np.hypot(*y)))
    require(
        narrow >= header * (1 - 1e-9),
        "field",
        f"be at least as wide as the header, {header:g} m",
        f"{narrow:.3g} m at its narrowest",
    )


def _path(tour: Tour, header: float) -> CombinePath:
    """A tour as one path, of which nothing is cut yet."""
    loops = np.repeat(tour.numbers, [len(track.gears) for track in tour.tracks])
    track, old = split_track(join_tracks(tour.tracks), LONGEST_PIECE * header)
    ways = np.hypot(*np.diff(track.points, axis=0).T)
    return CombinePath(
        stations=np.concatenate([[0.0], np.cumsum(ways)]),
        points=track.points,
        headings=np.pi - np.remainder(np.pi - track.headings, 2 * np.pi),
        gears=track.gears,
        cut_area=np.zeros(len(ways)),
        loops=loops[old],
        start_delay=0.0,
    )


def _sweeps(path: CombinePath, combine: int) -> tuple[Sweeps, np.ndarray]:
    """The pieces that a path cuts on, and their numbers."""
    poses = np.column_stack([path.points, np.unwrap(path.headings)])
    ways = np.column_stack([path.stations[:-1], path.stations[1:]])
    pieces = np.flatnonzero(path.gears > 0)
    who = np.full(len(pieces), combine)
    return Sweeps(poses[:-1][pieces], poses[1:][pieces], ways[pieces], who), pieces


def _cut_in_turn(bare: CropCells, tours: Sequence[Tour], header: float) -> CropCells:
    """Cells as they are cut if every loop waits for all those before it."""
    parts, order = [], []
    for n, tour in enumerate(tours):
        if tour.tracks:
            path = _path(tour, header)
            turns = np.repeat(tour.order, [len(track.gears) for track in tour.tracks])
            _, old = split_track(join_tracks(tour.tracks), LONGEST_PIECE * header)
            sweeps, pieces = _sweeps(path, n)
            parts.append(sweeps)
            order.append(turns[old][pieces])
    if not parts:
        return bare
    sweeps = join_sweeps(parts)
    by_turn = np.argsort(np.concatenate(order), kind="stable")
    return cut_cells(bare, _reordered(sweeps, by_turn), header)[0]


def _in_order(paths: Sequence[CombinePath], timeline: Timeline) -> tuple[Sweeps, np.ndarray]:
    """All pieces by the clock, and of each its combine and its number on the path, (n, 2)."""
    parts, clocks, rows = [], [], []
    for n, path in enumerate(paths):
        sweeps, pieces = _sweeps(path, n)
        parts.append(sweeps)
        clocks.append(timeline.clock_at(n, sweeps.stations[:, 0]))
        rows.append(np.column_stack([sweeps.who, pieces]))
    by_clock = np.argsort(np.concatenate(clocks), kind="stable")
    return _reordered(join_sweeps(parts), by_clock), np.concatenate(rows)[by_clock]


def _reordered(sweeps: Sweeps, order: np.ndarray) -> Sweeps:
    return Sweeps(
        sweeps.begins[order], sweeps.ends[order], sweeps.stations[order], sweeps.who[order]
    )
