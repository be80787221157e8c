"""Ways to cut a field, with quick estimates of time, and where combines park before and after."""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...compiled import kernel
from ..field.field import Field
from ..machines import CombineSize, combine_outline
from ..paths import MachinePath
from ..raster import cell_under, lattice
from .cut_ground import GAP, CutGround
from .driver import Driver, NoWay
from .loops import Loop, lay_out_loops
from .rounds import CORNER_TIME
from .swaths import Swath, lay_out_swaths

# Numbers of rounds before swaths, and most rounds where they cut the field alone.
ROUNDS = (1, 2, 3)
MOST_ROUNDS = 6

# Directions of swaths besides those of edges [deg].
DIRECTIONS = range(0, 180, 15)

# Edges shorter than this give no direction [m]; directions closer than this count as one [rad].
EDGE = 40.0
SAME = math.radians(4.0)

# Time to turn from swath to swath, to compare candidates [s].
TURN_TIME = 18.0

# How many combines a cell can tell apart.
MOST_COMBINES = 32
# Side of the cells that mark which combines pass over them, and spacing of samples [m].
CELL = 0.5
SAMPLES = 0.4

# How far back a combine looks for a place to park, along the straight on which it stands [m].
BACK = np.arange(0.0, 121.0, 4.0)

# How far into one of its swaths it looks for one [m], and how many swaths it tries.
INTO = np.arange(12.0, 61.0, 8.0)
SWATHS = 12


@dataclass(frozen=True, eq=False)
class Candidate:
    """A number of rounds and a direction of swaths.

    Attributes:
        region: What rounds are offsets of.
        rounds: Loops of each round.
        inside: What is left for swaths.
        swaths: The swaths.
        time: Estimate for all of it with one combine [s].
    """

    region: BaseGeometry
    rounds: tuple[tuple[Loop, ...], ...]
    inside: BaseGeometry
    swaths: tuple[Swath, ...]
    time: float


def find_candidates(
    field: Field, region: BaseGeometry, ground: CutGround, *, inwards: bool = False
) -> list[Candidate]:
    """Candidates, those that take the least time first.

    Args:
        field: The field.
        region: What rounds are offsets of.
        ground: Before anything is cut, for the combine.
        inwards: Whether rounds go inwards as far as they can, with swaths only for what they leave;
            candidates with the most rounds come first then.
    """
    combine = ground.combine
    every = list(itertools.islice(_all_rounds(region, ground), None if inwards else MOST_ROUNDS))
    directions = _directions(field)
    found = []
    for count in range(1, len(every) + 1):
        loops = tuple(map(tuple, every[:count]))
        driven = sum(loop.length for each in loops for loop in each)
        corners = sum(len(loop.corners) for each in loops for loop in each)
        rounds_time = driven / combine.speed + CORNER_TIME * corners
        inside = region.buffer(-count * combine.header_width, quad_segs=24)
        if inside.area < 1.0:
            found.append(Candidate(region, loops, shapely.Polygon(), (), rounds_time))
            break
        for direction in directions if inwards or count in ROUNDS else ():
            swaths = tuple(lay_out_swaths(inside, direction, combine))
            way = sum(swath.length for swath in swaths)
            time = rounds_time + way / combine.speed + TURN_TIME * len(swaths)
            found.append(Candidate(region, loops, inside, swaths, time))
    if inwards:
        return sorted(found, key=lambda candidate: (-len(candidate.rounds), candidate.time))
    return sorted(found, key=lambda candidate: candidate.time)


def _all_rounds(region: BaseGeometry, ground: CutGround) -> Iterator[list[Loop]]:
    """Loops of each round, until there is no room for a next one."""
    for number in itertools.count():
        loops = lay_out_loops(region, ground.combine, number, ground.has_room)
        if number > 0 and not loops:
            return
        yield loops


def _directions(field: Field) -> list[float]:
    ring = shapely.get_coordinates(field.outline.simplify(1.0))
    steps = np.diff(ring, axis=0)
    lengths = np.hypot(*steps.T)
    angles = np.arctan2(steps[:, 1], steps[:, 0]) % math.pi
    chosen: list[float] = []
    edges = [angles[k] for k in np.argsort(-lengths) if lengths[k] > EDGE]
    for angle in [*edges[:8], *np.radians(DIRECTIONS)]:
        if all(
            abs((angle - other + math.pi / 2) % math.pi - math.pi / 2) > SAME for other in chosen
        ):
            chosen.append(float(angle))
    return chosen


class Passes:
    """Which combines' outlines pass over which cells of a field and its margin."""

    def __init__(self, field: Field, combine: CombineSize) -> None:
        x0, y0, x1, y1 = field.ground.bounds
        shape = math.ceil((y1 - y0) / CELL) + 1, math.ceil((x1 - x0) / CELL) + 1
        self.origin = np.array([x0, y0])
        self.cells = np.zeros(shape, dtype=np.uint32)
        # A cell locates a point to half its diagonal only: the grown outline allows for that.
        self._outline, self._grown = (
            np.concatenate(
                [
                    lattice(box[0, 0] - more, box[1, 0] + more, box[2, 1] + more, SAMPLES)
                    for box in combine_outline(combine)
                ]
            )
            for more in (0.0, GAP + 0.4)
        )

    def add(self, path: MachinePath, machine: int) -> None:
        """Mark where a combine passes.

        Args:
            path: Its path.
            machine: Its number.
        """
        poses = path.pose_at(path.stations_every(SAMPLES))
        _mark(self.cells, self.origin, poses, self._outline, np.uint32(1 << machine))

    def clear(self, pose: np.ndarray, machine: int) -> bool:
        """Whether no other combine passes within the gap of one that stands at a pose.

        Args:
            pose: x, y, theta, shape (3,) [m], [m], [rad].
            machine: Its number.
        """
        others = np.uint32(0xFFFFFFFF ^ (1 << machine))
        return bool(_clear(self.cells, self.origin, pose, self._grown, others))

    def clear_path(self, path: MachinePath, poses: list[np.ndarray]) -> bool:
        """Whether a path keeps away from combines that stand at some poses."""
        if not poses:
            return True
        cells = np.zeros_like(self.cells)
        for pose in poses:
            _mark(cells, self.origin, pose[None], self._grown, np.uint32(1))
        along = path.pose_at(path.stations_every(SAMPLES))
        return all(_clear(cells, self.origin, pose, self._outline, np.uint32(1)) for pose in along)


def start_in_bay(driver: Driver, uncut: CutGround, passes: Passes, machine: int) -> bool:
    """Begin a combine's path in a bay off all other paths; return whether one was found.

    Args:
        driver: Driver that has done its work.
        uncut: The ground before that: a bay behind another may have crop beside a hollow edge.
        passes: Where all pass.
        machine: Its number.
    """
    first = driver.paths[0].poses[0]
    ahead = np.array([math.cos(first[2]), math.sin(first[2]), 0.0])
    assert len(driver.paths[0].poses) == 1
    for way in BACK:
        pose = first - way * ahead
        path = _straight(pose, first, 1)
        if not uncut.admits(path):
            return False
        if passes.clear(pose, machine):
            if way > 0:
                # In place of the pose at which it stood.
                driver.paths[0] = path
                passes.add(driver.paths[0], machine)
            return True
    return False


def park(
    driver: Driver,
    passes: Passes,
    machine: int,
    swaths: list[Swath],
    parked: list[np.ndarray],
) -> bool:
    """End a combine's path where no other passes; return whether such a place was found.

    Args:
        driver: Driver that has done its work.
        passes: Where all pass.
        machine: Its number.
        swaths: Swaths that it has cut, on which it may stand.
        parked: Where others have parked by now.
    """
    last = driver.pose
    ahead = np.array([math.cos(last[2]), math.sin(last[2]), 0.0])
    for way in BACK:
        pose = last - way * ahead
        path = _straight(last, pose, -1)
        if not driver.ground.admits(path):
            break
        if passes.clear(pose, machine) and passes.clear_path(path, parked):
            driver.drive(path)
            passes.add(path, machine)
            return True
    entries = [(swath, end) for swath in swaths for end in (0, 1)]
    entries.sort(key=lambda each: float(np.hypot(*(each[0].ends[each[1]] - last[:2]))))
    for swath, end in entries[:SWATHS]:
        entry = swath.pose(end, outwards=False)
        into = np.array([math.cos(entry[2]), math.sin(entry[2]), 0.0])
        for way in INTO[swath.length - 2.0 > INTO]:
            if not passes.clear(entry + way * into, machine):
                continue
            try:
                leg = driver.way_to(last, entry)
            except NoWay:
                break
            if passes.clear_path(leg, parked):
                for path in (leg, _straight(leg.poses[-1], leg.poses[-1] + way * into, 1)):
                    driver.drive(path)
                    passes.add(path, machine)
                return True
            break
    return False


def _straight(begin: np.ndarray, end: np.ndarray, gear: int) -> MachinePath:
    poses = np.array([begin, end])
    poses[1, 2] = poses[0, 2]
    return MachinePath.of(poses, gears=gear)


@kernel
def _mark(cells, origin, poses, points, bit):
    rows, columns = cells.shape
    for pose in poses:
        c, s = math.cos(pose[2]), math.sin(pose[2])
        for point in points:
            row, column = cell_under(origin, CELL, pose, c, s, point)
            if 0 <= row < rows and 0 <= column < columns:
                cells[row, column] |= bit


@kernel
def _clear(cells, origin, pose, points, bits):
    rows, columns = cells.shape
    c, s = math.cos(pose[2]), math.sin(pose[2])
    for point in points:
        row, column = cell_under(origin, CELL, pose, c, s, point)
        if 0 <= row < rows and 0 <= column < columns and cells[row, column] & bits:
            return False
    return True
