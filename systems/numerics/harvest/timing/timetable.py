"""The plan of all machines' times: who goes first at each encounter, and when each is where.

`drive_first_come` gives orders without deadlock; `drive_by_rule` gives the times for given orders.
First come, first served is not always best. So the search goes on from the best timetable so far:
at one of the encounters where time is lost it lets the other machine go first, with the rest as it
is or decided anew, and keeps what is quicker. That may leave no way for all to their ends: then
machines do not arrive, or the banker says so at once, and another encounter is tried.

Where there is no timetable, `explain_standstill` tells which machines block one another, and where.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...errors import require
from ..paths import TimedPath
from .conflicts import GAP, find_conflicts
from .deciding import (
    BUDGET,
    Course,
    drive_first_come,
    in_conflict,
    occupied,
    orders_of,
    reach_of,
    search_course,
)
from .rule import (
    UNDECIDED,
    Meetings,
    Rule,
    cause_of,
    find_dead_ends,
    free_rule,
    gather_meetings,
    hold_of,
    is_dead_end,
    set_orders,
    set_precedence,
)
from .sweep import SAME, Sweep
from .timed_drive import (
    Drive,
    Journey,
    Paces,
    drive_by_rule,
    nearest_stations,
    nominal_durations,
    paces_of,
    timed_paths,
)

# Weight of the mean arrival of all machines, added to the last arrival, so that none loses time for
# nothing.
MEAN_WEIGHT = 0.02

# Largest relative variation of durations by which other orders are found.
VARIATION = 0.15


@dataclass(frozen=True)
class Block:
    """A machine that cannot get to the end of its path.

    Attributes:
        machine: Its number.
        station: How far it can drive [m].
        place: x, y of the middle of what it covers there [m].
        by: Number of the machine that blocks it.
        by_station: Where that one is or, if the machine has no place to let it pass, where it would
            come by [m].
        cause: Why it cannot go on: "crop", "order", "in the way" or "no place to pass".
    """

    machine: int
    station: float
    place: tuple[float, float]
    by: int
    by_station: float
    cause: str

    def __str__(self) -> str:
        x, y = self.place
        reason = {
            "crop": "needs the crop cut by",
            "order": "has to let go first",
            "in the way": "is blocked by",
            "no place to pass": "has no place to let pass",
        }[self.cause]
        return (
            f"machine {self.machine} at {self.station:.0f} m of its path ({x:.0f}, {y:.0f}) "
            f"{reason} machine {self.by} at {self.by_station:.0f} m"
        )


@dataclass(frozen=True)
class Standstill:
    """There is no safe way to drive these paths: wherever all wait, some block one another.

    Attributes:
        blocks: One for each machine that cannot arrive.
        progress: Of all machines when none can be brought on any more.
    """

    blocks: tuple[Block, ...]
    progress: tuple[int, ...]

    def __str__(self) -> str:
        return "; ".join(str(block) for block in self.blocks)


def explain_standstill(
    meetings: Meetings, rule: Rule, progress: np.ndarray, sweeps: list[Sweep]
) -> Standstill:
    """Explain who blocks whom in a state from which the banker can bring no machine on.

    Args:
        meetings: Conflicts.
        rule: With crop precedence, and orders if they are told.
        progress: Of all machines, how far the banker brought them, shape (N,).
        sweeps: Of all machines.
    """
    blocks = [
        _block(meetings, rule, progress, sweeps, m)
        for m in range(len(progress))
        if progress[m] < meetings.cells[m]
    ]
    return Standstill(tuple(blocks), tuple(int(each) for each in progress))


def _block(meetings, rule, progress, sweeps, m) -> Block:
    reach = int(reach_of(meetings, rule, m, progress))
    station = float(sweeps[m].stations[reach + 1])
    place = (float(sweeps[m].discs[reach, 0]), float(sweeps[m].discs[reach, 1]))

    def block(by: int, cell: int, cause: str) -> Block:
        return Block(m, station, place, by, float(sweeps[by].stations[cell]), cause)

    # A machine that can drive on, but comes to no free cell, would be in somebody's way there.
    if reach > progress[m] or reach + 1 == meetings.cells[m]:
        for n in range(len(progress)):
            for j in range(int(occupied(meetings, n, progress)), int(meetings.cells[n])):
                if n != m and in_conflict(meetings, n, j, m, reach):
                    return block(n, j, "no place to pass")
    if hold_of(rule, m, progress) <= reach:
        by, crop = cause_of(rule, m, progress)
        return block(by, int(progress[by]), "crop" if crop else "order")
    for n in range(len(progress)):
        cell = int(occupied(meetings, n, progress))
        if n != m and in_conflict(meetings, m, reach + 1, n, cell):
            return block(n, cell, "in the way")
    raise AssertionError("a machine that nothing stops is not at a standstill")


@dataclass(frozen=True, eq=False)
class MachineTimetable:
    """When each machine is where, and who goes first.

    Attributes:
        paths: Of the machines in time, N of them.
        rule: By which machines drive, with the orders told.
        meetings: Conflicts of all machines, with their encounters.
        first: The machine that goes first at each encounter, shape (E,).
        waiting: Time lost by each machine to each other one, at encounters and for crop, shape
            (N, N, 2) [s].
        stations: Of each machine's grid, N arrays of shape (n + 1,) [m].
    """

    paths: tuple[TimedPath, ...]
    rule: Rule
    meetings: Meetings
    first: np.ndarray
    waiting: np.ndarray
    stations: tuple[np.ndarray, ...]

    @property
    def makespan(self) -> float:
        """When the last machine arrives [s]."""
        return max(path.end for path in self.paths)


def time_machines(
    journeys: Sequence[Journey],
    needs: Mapping[tuple[int, int], np.ndarray] | None = None,
    *,
    trials: int = 60,
    seed: int = 0,
) -> MachineTimetable | Standstill:
    """Decide who goes first wherever paths meet, and when each machine is where.

    All machines are at the beginnings of their paths at time zero.

    Args:
        journeys: Of all machines.
        needs: Crop precedence: needs[m, n] is, for each station of the grid of machine m, the
            station of machine n that n must have passed before m is there, -inf for none, shape
            (cells of m + 1,) [m].
        trials: How many orders to try after the first.
        seed: Random seed of the search.

    Returns:
        The timetable, or why there is none.

    Raises:
        InvalidInput: There is no machine, or needs have a wrong shape or name no station.
    """
    require(len(journeys) > 0, "journeys", "be at least one", len(journeys))
    cells = np.array([journey.sweep.cells for journey in journeys])
    pairs = [(a, b) for a in range(len(cells)) for b in range(a + 1, len(cells))]
    found = {(a, b): find_conflicts(journeys[a].sweep, journeys[b].sweep, GAP) for a, b in pairs}
    meetings = gather_meetings(cells, found)
    rule = free_rule(cells)
    stations = tuple(journey.sweep.stations for journey in journeys)
    for (m, n), passed in (needs or {}).items():
        set_precedence(rule, m, n, needed_progress(stations[m], stations[n], passed))
    search = _Search(meetings, rule, paces_of(list(journeys)))
    nobody = np.full(len(meetings.pairs), UNDECIDED)
    course = search.decide(nobody, search.durations)
    # If two machines never both arrive, whatever they do, there is nothing to search for.
    hopeless = search.begins_in_dead_end()
    if not course.arrived:
        course = search_course(meetings, rule, 0 if hopeless else BUDGET)
    rng = np.random.default_rng(seed)
    for _ in range(0 if hopeless else trials):
        if course.arrived:
            break
        course = search.decide(nobody, search.vary(rng))
    if not course.arrived:
        return explain_standstill(meetings, rule, course.progress, [j.sweep for j in journeys])
    first = search.try_orders(nobody, orders_of(meetings, course))
    assert first is not None, "an order that machines came by leads them to their ends"
    best = search.improve(first, trials, rng)
    search.tell(rule, best.first)
    return MachineTimetable(
        tuple(timed_paths(list(journeys), best.drive, search.paces)),
        rule,
        meetings,
        best.first,
        best.drive.waiting,
        stations,
    )


def with_stops(
    timetable: MachineTimetable,
    journeys: Sequence[Journey],
    stops: Sequence[tuple[int, float, float]],
) -> list[TimedPath]:
    """The times of machines if some of them stand for a while, in the orders of a timetable.

    Machines that have to wait for these stand as well; the orders still lead all to their ends.

    Args:
        timetable: Without the stops.
        journeys: Of all machines.
        stops: Number of the machine, its station [m], and how long it stands [s], of each.
    """
    halting = []
    for number, journey in enumerate(journeys):
        own = [stop for stop in stops if stop[0] == number]
        cells = (
            nearest_stations(journey.sweep.stations[1:-1], np.array([stop[1] for stop in own])) + 1
        )
        at = journey.sweep.stations[cells]
        halting.append(replace(journey, stops=at, dwells=np.array([stop[2] for stop in own])))
    paces = paces_of(halting)
    drive = drive_by_rule(timetable.rule, timetable.meetings, timetable.first, paces)
    return timed_paths(halting, drive, paces)


def needed_progress(stations: np.ndarray, others: np.ndarray, passed: np.ndarray) -> np.ndarray:
    """Progress of another machine that each cell of a machine needs.

    Args:
        stations: Of the machine's grid, shape (n + 1,) [m].
        others: Of the other machine's grid, shape (k + 1,) [m].
        passed: For each station of the machine, what station the other one must have passed, -inf
            for none, shape (n + 1,) [m].

    Returns:
        Shape (n,).

    Raises:
        InvalidInput: The shapes do not fit, or a station is beyond the other's path.
    """
    require(passed.shape == stations.shape, "needs", f"have shape {stations.shape}", passed.shape)
    farthest = passed.max(initial=-np.inf)
    within = bool(farthest <= others[-1] + SAME)
    require(within, "needs", f"be stations up to {others[-1]:.6g} m", farthest)
    both = np.maximum(passed[:-1], passed[1:])
    return np.searchsorted(others, both - SAME)


@dataclass(frozen=True, eq=False)
class _Trial:
    """Orders, which of them were told beforehand, and the drive that came of them."""

    told: np.ndarray
    first: np.ndarray
    drive: Drive
    cost: float


class _Search:
    """Tries orders, and keeps the best."""

    def __init__(self, meetings: Meetings, rule: Rule, paces: Paces) -> None:
        self.meetings, self.paces = meetings, paces
        # One rule has the orders that are told beforehand, one those of a trial.
        self.told = _own_orders(rule)
        self.decided = _own_orders(rule)
        self.dead_ends = find_dead_ends(meetings, rule)
        self.durations = nominal_durations(rule.cells, paces)
        self.ends = np.cumsum(rule.cells + 1) - 1

    def begins_in_dead_end(self) -> bool:
        """Whether two machines are in a dead end where they begin, whatever the others do."""
        count = len(self.meetings.cells)
        pairs = [(a, b) for a in range(count) for b in range(a + 1, count)]
        return any(is_dead_end(self.dead_ends, a, 0, b, 0) for a, b in pairs)

    def tell(self, rule: Rule, first: np.ndarray) -> None:
        """Tell a rule the orders of all encounters."""
        for m in range(len(rule.cells)):
            for n in range(m + 1, len(rule.cells)):
                set_orders(rule, self.meetings, first, m, n)

    def decide(self, told: np.ndarray, durations: np.ndarray) -> Course:
        """Drive first come, first served, at encounters whose order is not told."""
        self.tell(self.told, told)
        # The machine that takes longest is asked first.
        ends = np.add.reduceat(durations, np.cumsum(self.told.cells) - self.told.cells)
        return drive_first_come(
            self.meetings, self.told, self.dead_ends, durations, np.argsort(-ends)
        )

    def try_orders(self, told: np.ndarray, first: np.ndarray) -> _Trial | None:
        """Drive in an order; None if not all arrive."""
        self.tell(self.decided, first)
        drive = drive_by_rule(self.decided, self.meetings, first, self.paces)
        ends = drive.arrivals[self.ends]
        if (drive.progress < self.decided.cells).any():
            return None
        return _Trial(told, first, drive, float(ends.max() + MEAN_WEIGHT * ends.mean()))

    def improve(self, best: _Trial, trials: int, rng: np.random.Generator) -> _Trial:
        """Look for better orders, from the best so far."""
        tried: set[int] = set()
        for trial in range(trials):
            lost = best.drive.by_encounter
            candidates = [e for e in np.flatnonzero(lost > 0) if e not in tried]
            found = []
            if candidates and trial % 4 != 3:
                weights = lost[candidates] / lost[candidates].sum()
                chosen = int(rng.choice(candidates, p=weights))
                tried.add(chosen)
                other = self.meetings.pairs[chosen].sum() - best.first[chosen]
                found = [
                    self.try_orders(best.told, _with(best.first, chosen, other)),
                    self.decide_anew(_with(best.told, chosen, other), self.durations),
                ]
            elif not lost.any():
                break
            else:
                found = [self.decide_anew(best.told, self.vary(rng))]
            for one in found:
                if one is not None and one.cost < best.cost - 1e-9:
                    best = one
                    tried.clear()
        return best

    def vary(self, rng: np.random.Generator) -> np.ndarray:
        """Durations varied from place to place, so that other machines come first."""
        places = np.arange(len(self.durations)) // 50
        factors = rng.uniform(1 - VARIATION, 1 + VARIATION, places[-1] + 1)
        return self.durations * factors[places]

    def decide_anew(self, told: np.ndarray, durations: np.ndarray) -> _Trial | None:
        """Decide the orders that are not told, and drive; None if those told leave no way."""
        course = self.decide(told, durations)
        return self.try_orders(told, orders_of(self.meetings, course)) if course.arrived else None


def _with(values: np.ndarray, number: int, value: int) -> np.ndarray:
    """A copy with one entry changed."""
    changed = values.copy()
    changed[number] = value
    return changed


def _own_orders(rule: Rule) -> Rule:
    """The same rule with a table of orders of its own."""
    return rule._replace(by_order=rule.by_order.copy())
