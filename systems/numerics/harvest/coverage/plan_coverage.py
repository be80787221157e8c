"""Coverage: ways to cut a whole field, each tried, checked and compared."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import NoPlan, require, require_one_of
from ..field.field import Field
from ..machines import Combine, size_of
from ..paths import MachinePath
from ..turns.ground import Footprint, Ground
from ..turns.turn import combine_footprint
from .candidates import MOST_COMBINES, Candidate, Passes, find_candidates, park, start_in_bay
from .cut_ground import WITHIN, CutGround, covered_area
from .driver import Driver, NoWay, lay_out_roads, path_time
from .lands import drive_lands, drive_rounds
from .loops import crop_to_offset
from .precedence import MOST_UNDER_BODIES, CropPrecedence, can_finish, find_precedence

# Patterns of coverage.
PATTERNS = ("lands", "thesis")

# How many sound ways to cut a field are compared, how many with the same number of rounds are tried
# before others, and how many are tried at most.
BUILT = 3
FOREMOST = 4
MOST_TRIED = 24

# Margins that are tried if there is no way, to tell in the error whether a wider one helps [m].
WIDER = (6.0, 12.0, 24.0)

# Least share of the crop that a plan cuts, and the same with three or more holes, or if nothing
# better is found [-].
LEAST_COVERAGE = 0.995
LEAST_COVERAGE_AT_ALL = 0.985

# Largest curvature of a path times the least radius of turns: polylines along arcs turn a little
# more sharply than the arcs [-].
SHARPER = 1.1


@dataclass(frozen=True, eq=False)
class CoveragePaths:
    """Paths of all combines that together cut a field.

    Attributes:
        paths: Of the combines.
        precedence: What must be cut before.
        area: Of the crop [m^2].
        covered_area: Of the crop that is cut [m^2].
        times: Estimates of when each combine has driven its path, without waiting, shape (N,) [s].
        off_paths: Whether each begins, and ends, farther than a gap from all other paths, shape
            (N, 2).
    """

    paths: tuple[MachinePath, ...]
    precedence: CropPrecedence
    area: float
    covered_area: float
    times: np.ndarray
    off_paths: np.ndarray

    @property
    def coverage(self) -> float:
        """Share of the crop that is cut, in [0, 1]."""
        return self.covered_area / self.area

    @property
    def length(self) -> float:
        """Way of all combines [m]."""
        return sum(path.length for path in self.paths)


def find_coverages(
    field: Field, combines: Sequence[Combine], *, pattern: str = "lands", reach: float = np.inf
) -> Iterator[CoveragePaths]:
    """Ways to cut a whole field: the first BUILT that were found, the quickest first, then others.

    Args:
        field: The field.
        combines: The combines, of one size.
        pattern: "lands": rounds in arcs, then a land of swaths for each combine; "thesis": rounds
            from the perimeter inwards, combines on adjacent ones (Zhang 2014, Figure 3.8).
        reach: How far a combine cuts until its tank is full [m].

    Raises:
        InvalidInput: A value is out of its range.
        NoPlan: There is none.
    """
    size = size_of(combines)
    require_one_of("pattern", pattern, PATTERNS)
    require(
        len(combines) <= MOST_COMBINES, "combines", f"be at most {MOST_COMBINES}", len(combines)
    )
    require(
        size.header_width > size.width,
        "header_width",
        f"be larger than the body's width of {size.width:g} m",
        size.header_width,
    )
    faults: list[tuple[bool, str]] = []
    every = _sound_coverages(field, combines, pattern, reach, faults)
    first = sorted(itertools.islice(every, BUILT), key=lambda coverage: coverage.times.max())
    if not first:
        told = [f" ({fault})" for _, fault in sorted(faults, key=lambda each: each[0])[:1]]
        raise NoPlan(
            f"`field` must have room for {len(combines)} combines with headers of "
            f"{size.header_width:g} m and turns of {size.turning_radius:g} m; "
            f"got {field.area / 1e4:.2f} ha with a margin of {field.margin:g} m"
            + "".join(told)
            + _wider_margin(field, combines, pattern, reach)
        )
    yield from first
    yield from every


def _wider_margin(field: Field, combines: Sequence[Combine], pattern: str, reach: float) -> str:
    """A hint, in words, at a wider margin that has room for paths; empty if none has."""
    for margin in WIDER:
        if margin > field.margin:
            wider = replace(field, margin=margin)
            if next(_sound_coverages(wider, combines, pattern, reach, []), None) is not None:
                return f"; a margin of {margin:g} m has room for their paths"
    return ""


def _sound_coverages(
    field: Field,
    combines: Sequence[Combine],
    pattern: str,
    reach: float,
    faults: list[tuple[bool, str]],
) -> Iterator[CoveragePaths]:
    """Yield coverages that pass all checks; those that leave more crop come last.

    For each of the others `faults` gets whether it cannot even be driven, and what is wrong: the
    faults of those that can be driven tell more.
    """
    size = size_of(combines)
    region = crop_to_offset(field, size)
    ground = CutGround.of(field, combines[0])
    candidates = find_candidates(field, region, ground, inwards=pattern == "thesis")
    bare, footprint = Ground(field.ground.buffer(-WITHIN)), combine_footprint(size)
    sharpest = SHARPER / size.turning_radius
    least = LEAST_COVERAGE_AT_ALL if len(field.obstacles) >= 3 else LEAST_COVERAGE
    patchy = []
    for candidate in _spread(candidates):
        try:
            plan = _build(field, combines, candidate, ground, reach, adjacent=pattern == "thesis")
        except NoWay as fault:
            faults.append((True, str(fault)))
            continue
        wrong = _what_is_wrong(plan, bare, footprint, sharpest)
        if wrong:
            faults.append((False, wrong))
        elif plan.coverage < least:
            patchy.append(plan)
        else:
            yield plan
    yield from sorted(patchy, key=lambda plan: -plan.coverage)


def _what_is_wrong(plan: CoveragePaths, bare: Ground, footprint: Footprint, sharpest: float) -> str:
    """Why a plan is not sound; empty if it is.

    Args:
        plan: The plan.
        bare: Ground that combines must not leave.
        footprint: Of each combine.
        sharpest: Largest allowed curvature of paths [1/m].
    """
    if plan.coverage < LEAST_COVERAGE_AT_ALL:
        return f"{plan.coverage:.1%} would be cut"
    if not can_finish(plan.precedence):
        return "combines would wait for one another"
    under = plan.precedence.crop_under_bodies / plan.area
    if under > MOST_UNDER_BODIES:
        return f"bodies would drive over {under:.2%} of the crop"
    if not all(bare.admits(path, footprint) for path in plan.paths):
        return "combines would leave the ground"
    if any(np.abs(path.curvatures).max(initial=0.0) > sharpest for path in plan.paths):
        return "combines would turn too sharply"
    return ""


def _spread(candidates: list[Candidate]) -> list[Candidate]:
    """Reorder candidates: FOREMOST at most with one number of rounds come before other numbers."""
    places: dict[int, int] = {}
    turns = []
    for candidate in candidates:
        place = places.get(len(candidate.rounds), 0)
        places[len(candidate.rounds)] = place + 1
        turns.append(place // FOREMOST)
    order = sorted(range(len(candidates)), key=lambda k: turns[k])
    return [candidates[k] for k in order][:MOST_TRIED]


def _build(
    field: Field,
    combines: Sequence[Combine],
    candidate: Candidate,
    uncut: CutGround,
    reach: float,
    *,
    adjacent: bool,
) -> CoveragePaths:
    size = size_of(combines)
    width = size.header_width
    depths = [len(candidate.rounds) * width / 2, width / 2]
    roads = lay_out_roads(candidate.region, depths, size.turning_radius)
    if not roads:
        raise NoWay("no room for a round")
    drivers = [Driver(uncut.copy_for(combine), []) for combine in combines]
    drive_rounds(drivers, candidate, field, reach, adjacent=adjacent)
    for driver in drivers:
        driver.roads = roads
    lands = drive_lands(drivers, candidate, reach)
    off_paths = _wait_off_paths(field, uncut, drivers, candidate, lands)
    paths = tuple(driver.path for driver in drivers)
    covered = covered_area(field, paths, size)
    each = zip(paths, combines, strict=True)
    times = np.array([path_time(path, combine) for path, combine in each])
    precedence = find_precedence(field, paths, size)
    return CoveragePaths(paths, precedence, field.area, covered, times, off_paths)


def _wait_off_paths(
    field: Field,
    uncut: CutGround,
    drivers: list[Driver],
    candidate: Candidate,
    lands: list[list[int]],
) -> np.ndarray:
    passes = Passes(field, drivers[0].combine)
    for machine, driver in enumerate(drivers):
        passes.add(driver.path, machine)
    off_paths = np.zeros((len(drivers), 2), dtype=bool)
    for machine, driver in enumerate(drivers):
        off_paths[machine, 0] = start_in_bay(driver, uncut, passes, machine)
    parked: list[np.ndarray] = []
    for machine, (driver, land) in enumerate(zip(drivers, lands, strict=True)):
        swaths = [candidate.swaths[k] for k in land]
        off_paths[machine, 1] = park(driver, passes, machine, swaths, parked)
        parked.append(driver.pose)
    return off_paths
