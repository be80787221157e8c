"""The plan of the combines: paths that cut the field, and the times at which they drive them."""

from dataclasses import dataclass

from ..coverage.plan_coverage import BUILT, CoveragePaths, find_coverages
from ..field.field import Field
from ..machines.combine import Combine
from ..machines.outlines import combine_outline
from ..no_plan import NoPlan
from ..paths.timed_path import TimedPath
from ..timing.standstill import Standstill
from ..timing.sweep import grid_stations, sweep_of
from ..timing.timed_drive import Journey
from ..timing.timetable import Timetable, time_machines


@dataclass(frozen=True, eq=False)
class CombinePlan:
    """When every combine is where, if nothing goes wrong, and who goes first if something does.

    Attributes:
        field: What is cut.
        combine: Each of the combines.
        coverage: Their paths.
        timetable: Their times, and the orders at all places where paths meet.
        journeys: Their paths with the ground that they cover.
    """

    field: Field
    combine: Combine
    coverage: CoveragePaths
    timetable: Timetable
    journeys: tuple[Journey, ...]

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
        combine = self.combine
        bound = self.field.area / (combine.header_width * combine.speed * len(self.paths))
        return self.makespan / bound

    @property
    def waiting(self) -> float:
        """Part of the combines' time that they wait for one another, no unit."""
        return float(self.timetable.waiting.sum()) / (self.makespan * len(self.paths))


def plan_combines(
    field: Field, combine: Combine, count: int, *, pattern: str = "lands", seed: int = 0
) -> CombinePlan:
    """Plan how combines cut a field: of the best ways to cut it the one that is done first.

    Where combines would block one another in all of them, other ways are tried, until none is left.

    Args:
        field: The field.
        combine: One of equal combines.
        count: Of combines.
        pattern: Of the paths; see `plan_coverage`.
        seed: Of the orders that are tried.

    Raises:
        InvalidInput: A value is out of its range.
        NoPlan: The combines cannot cut the field, or block one another.
    """
    best: CombinePlan | None = None
    blocked: list[Standstill] = []
    for number, coverage in enumerate(find_coverages(field, combine, count, pattern=pattern)):
        if best is not None and coverage.times.max() >= best.makespan:
            break
        plan = _time(field, combine, coverage, seed)
        if isinstance(plan, Standstill):
            blocked.append(plan)
        elif best is None or plan.makespan < best.makespan:
            best = plan
        if best is not None and number + 1 >= BUILT:
            break
    if best is None:
        raise NoPlan(
            f"`count` must be less, for combines would block one another in all of {len(blocked)} "
            f"ways to cut the field, as in the first of them: {blocked[0]}"
        )
    return best


def _time(
    field: Field, combine: Combine, coverage: CoveragePaths, seed: int
) -> CombinePlan | Standstill:
    outline = combine_outline(combine)
    journeys = [
        Journey(
            path, sweep_of(path, outline, grid_stations(path)), combine.speed, combine.acceleration
        )
        for path in coverage.paths
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
    return CombinePlan(field, combine, coverage, timetable, tuple(journeys))
