"""The plan of the combines: paths that cut the field, and the times at which they drive them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain

from ..coverage.plan_coverage import BUILT, CoveragePaths, find_coverages
from ..field.field import Field
from ..machines.combine import Combine, CombineSize, size_of
from ..machines.outlines import combine_outline
from ..no_plan import NoPlan
from ..paths.timed_path import TimedPath
from ..timing.standstill import Standstill
from ..timing.sweep import grid_stations, sweep_of
from ..timing.timed_drive import Journey
from ..timing.timetable import MachineTimetable, time_machines


@dataclass(frozen=True, eq=False)
class CombinePlan:
    """When every combine is where, if nothing goes wrong, and who goes first if something does.

    Attributes:
        field: What is cut.
        machines: The combines, N of one size.
        coverage: Their paths.
        timetable: Their times, and the orders at all places where paths meet.
        journeys: Their paths with the ground that they cover.
    """

    field: Field
    machines: tuple[Combine, ...]
    coverage: CoveragePaths
    timetable: MachineTimetable
    journeys: tuple[Journey, ...]

    @property
    def size(self) -> CombineSize:
        """Of the combines."""
        return size_of(self.machines)

    @property
    def paths(self) -> tuple[TimedPath, ...]:
        """Of the combines."""
        return self.timetable.paths

    @property
    def makespan(self) -> float:
        """When the last combine has arrived where it parks [s]."""
        return self.timetable.makespan

    @property
    def makespan_over_bound(self) -> float:
        """The makespan over that of headers that are always full, at top speed, no unit."""
        cuts = sum(combine.header_width * combine.speed for combine in self.machines)
        bound = self.field.area / cuts
        return self.makespan / bound

    @property
    def waiting(self) -> float:
        """Part of the combines' time that they wait for one another, no unit."""
        return float(self.timetable.waiting.sum()) / (self.makespan * len(self.paths))


def plan_combines(
    field: Field, combines: Sequence[Combine], *, pattern: str = "lands", seed: int = 0
) -> CombinePlan:
    """Plan how combines cut a field: of the best ways to cut it the one that is done first.

    Args:
        field: The field.
        combines: They, of one size.
        pattern: Of the paths; see `plan_coverage`.
        seed: Of the orders that are tried.

    Raises:
        InvalidInput: A value is out of its range.
        NoPlan: The combines cannot cut the field, or block one another.
    """
    return next(find_combine_plans(field, combines, pattern=pattern, seed=seed))


def find_combine_plans(
    field: Field, combines: Sequence[Combine], *, pattern: str = "lands", seed: int = 0
) -> Iterator[CombinePlan]:
    """Plans of combines: the best ways to cut a field, what is done first first, then other ways.

    Ways in which combines would block one another are left out.

    Args:
        field: The field.
        combines: They, of one size.
        pattern: Of the paths; see `plan_coverage`.
        seed: Of the orders that are tried.

    Raises:
        InvalidInput: A value is out of its range.
        NoPlan: There is none.
    """
    best: list[CombinePlan] = []
    blocked: list[Standstill] = []
    every = find_coverages(field, combines, pattern=pattern)
    untimed: list[CoveragePaths] = []
    for number, coverage in enumerate(every):
        if best and coverage.times.max() >= min(plan.makespan for plan in best):
            untimed = [coverage]
            break
        plan = _time(field, combines, coverage, seed)
        if isinstance(plan, Standstill):
            blocked.append(plan)
        else:
            best.append(plan)
        if best and number + 1 >= BUILT:
            break
    if not best:
        raise NoPlan(
            f"`combines` must be fewer, for they would block one another in all of {len(blocked)} "
            f"ways to cut the field, as in the first of them: {blocked[0]}"
        )
    yield from sorted(best, key=lambda plan: plan.makespan)
    for coverage in chain(untimed, every):
        plan = _time(field, combines, coverage, seed)
        if isinstance(plan, CombinePlan):
            yield plan


def _time(
    field: Field, combines: Sequence[Combine], coverage: CoveragePaths, seed: int
) -> CombinePlan | Standstill:
    outline = combine_outline(size_of(combines))
    journeys = [
        Journey(
            path, sweep_of(path, outline, grid_stations(path)), combine.speed, combine.acceleration
        )
        for path, combine in zip(coverage.paths, combines, strict=True)
    ]
    precedence = coverage.precedence
    needs = {
        (m, n): precedence.needed_at(m, n, journey.sweep.stations)
        for m, journey in enumerate(journeys)
        for n, needed in enumerate(precedence.needs[m])
        if n != m and needed.any()
    }
    timetable = time_machines(journeys, needs, seed=seed)
    if isinstance(timetable, Standstill):
        return timetable
    return CombinePlan(field, tuple(combines), coverage, timetable, tuple(journeys))
