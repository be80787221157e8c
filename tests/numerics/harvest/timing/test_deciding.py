"""Orders without deadlock, on made-up conflicts, against a search of all ways to the ends."""

import numpy as np
import pytest
from scipy import ndimage

from sightfield.systems.numerics.harvest.timing.conflicts import conflict_set
from sightfield.systems.numerics.harvest.timing.deciding import (
    bring_on,
    drive_first_come,
    orders_of,
    search_course,
)
from sightfield.systems.numerics.harvest.timing.rule import (
    _write_holds,
    find_dead_ends,
    free_rule,
    gather_meetings,
    hold_of,
    is_dead_end,
    set_orders,
    set_precedence,
)


def conflicts_of(matrix):
    change = np.diff(np.pad(matrix.astype(int), ((0, 0), (1, 1))), axis=1)
    row, begins = np.nonzero(change == 1)
    ends = np.nonzero(change == -1)[1]
    rows = np.searchsorted(row, np.arange(len(matrix) + 1))
    return conflict_set(rows, begins, ends, matrix.shape[1])


def strips(rng, rows, columns):
    """Strips across the plane of cells: convoys, meetings head-on, crossings."""
    matrix = np.zeros((rows, columns), dtype=bool)
    for _ in range(rng.integers(1, 5)):
        i, j, along = rng.integers(0, rows), rng.integers(0, columns), rng.choice([-1, 0, 1])
        for _ in range(rng.integers(1, rows)):
            if i >= rows or not 0 <= j < columns:
                break
            matrix[i, j] = True
            i, j = i + 1, j + along
    matrix = ndimage.binary_dilation(matrix, np.ones((3, 3)), iterations=int(rng.integers(1, 3)))
    # Most machines begin and end where nobody passes.
    if rng.random() < 0.8:
        matrix[[0, -1]] = matrix[:, [0, -1]] = False
    matrix[0, 0] = False
    return matrix


class Case:
    """Machines with conflicts, and with crop that some need to be cut by others."""

    def __init__(self, seed, machines=None):
        self.rng = rng = np.random.default_rng(seed)
        count = int(rng.integers(2, 4)) if machines is None else machines
        self.cells = rng.integers(8, {2: 36, 3: 20}.get(count, 60), count)
        pairs = [(a, b) for a in range(count) for b in range(a + 1, count)]
        self.marks = {(a, b): strips(rng, self.cells[a], self.cells[b]) for a, b in pairs}
        self.needs = {}
        for _ in range(rng.choice([0, 0, 1, 3])):
            m, n = (int(each) for each in rng.permutation(count)[:2])
            needed = self.needs.setdefault((m, n), np.zeros(self.cells[m], dtype=np.int64))
            needed[rng.integers(2, self.cells[m])] = rng.integers(1, self.cells[n])
        found = {pair: conflicts_of(marks) for pair, marks in self.marks.items()}
        self.meetings = gather_meetings(self.cells, found)
        self.rule = free_rule(self.cells)
        for (m, n), needed in self.needs.items():
            set_precedence(self.rule, m, n, needed)
        self.dead_ends = find_dead_ends(self.meetings, self.rule)

    def decide(self):
        durations = self.rng.uniform(0.5, 2.0, self.cells.sum())
        priority = self.rng.permutation(len(self.cells))
        return drive_first_come(self.meetings, self.rule, self.dead_ends, durations, priority)

    def tell(self, first):
        for a, b in self.marks:
            set_orders(self.rule, self.meetings, first, a, b)

    def is_clear(self, progress):
        on = np.minimum(progress, self.cells - 1)
        return not any(marks[on[a], on[b]] for (a, b), marks in self.marks.items())

    def is_met(self, m, progress):
        """Whether the crop is cut that machine m needs where it is."""
        met = True
        for (one, other), needed in self.needs.items():
            if one == m and progress[m] < self.cells[m]:
                met = met and needed[progress[m]] <= progress[other]
        return met

    def can_all_arrive(self):
        """Whether any way of moving one cell at a time leads all to their ends."""
        start = (0,) * len(self.cells)
        seen, open_ = {start}, [start]
        while open_:
            here = open_.pop()
            if here == tuple(self.cells):
                return True
            for m in range(len(here)):
                after = (*here[:m], here[m] + 1, *here[m + 1 :])
                if here[m] < self.cells[m] and after not in seen:
                    state = np.array(after)
                    if self.is_clear(state) and self.is_met(m, state):
                        seen.add(after)
                        open_.append(after)
        return False


def test_a_way_is_found_where_there_is_one():
    by_banker = possible = 0
    for seed in range(150):
        case = Case(seed)
        course = case.decide()
        truth = case.can_all_arrive()
        by_banker, possible = by_banker + course.arrived, possible + truth
        if not course.arrived:
            course = search_course(case.meetings, case.rule)
        assert course.arrived == truth
        if course.arrived:
            assert (course.progress == case.cells).all()
    # Steps without harm are not all that there are, so that the search is needed for a few.
    assert 0.9 * possible < by_banker < possible < 140


def test_who_keeps_the_orders_never_meets_nor_waits_for_ever():
    for seed in range(400):
        case = Case([17, seed], machines=2 + seed % 4)
        # Every other order comes from the search.
        course = case.decide() if seed % 8 < 4 else search_course(case.meetings, case.rule)
        if not course.arrived:
            continue
        case.tell(orders_of(case.meetings, course))
        progress = np.zeros(len(case.cells), dtype=np.int64)
        while (progress < case.cells).any():
            last = progress + 1 == case.cells
            able = [
                m
                for m in np.flatnonzero(progress < case.cells)
                if last[m] or hold_of(case.rule, m, progress) > progress[m]
            ]
            assert able, "a deadlock"
            m = case.rng.choice(able)
            progress[m] += 1
            assert case.is_clear(progress)
            assert case.is_met(m, progress)


def test_events_are_numbered_in_the_order_in_which_they_are_possible():
    case = Case([17, 3], machines=3)
    course = case.decide()
    assert course.arrived
    nodes = np.cumsum(case.cells + 1) - (case.cells + 1)
    machine = np.searchsorted(nodes, np.arange(len(course.entered)), side="right") - 1
    progress = np.zeros(3, dtype=np.int64)
    for node in np.argsort(course.entered, kind="stable"):
        m = machine[node]
        progress[m] = node - nodes[m]
        assert case.is_clear(progress)
        assert case.is_met(m, progress)


def test_who_comes_first_goes_first_and_who_is_told_to_goes_first():
    marks = np.zeros((12, 15), dtype=bool)
    marks[4:7, 5:9] = True
    meetings = gather_meetings(np.array([12, 15]), {(0, 1): conflicts_of(marks)})
    rule = free_rule(meetings.cells)
    dead_ends = find_dead_ends(meetings, rule)
    for slow, expected in ((0, 1), (1, 0)):
        durations = np.repeat([4.0 if slow == 0 else 1.0, 1.0 if slow == 0 else 4.0], [12, 15])
        course = drive_first_come(meetings, rule, dead_ends, durations, np.array([0, 1]))
        assert orders_of(meetings, course).tolist() == [expected]
        set_orders(rule, meetings, np.array([slow]), 0, 1)
        told = drive_first_come(meetings, rule, dead_ends, durations, np.array([0, 1]))
        assert orders_of(meetings, told).tolist() == [slow]
        set_orders(rule, meetings, np.array([-1]), 0, 1)


@pytest.mark.parametrize("end", [0, 11])
def test_a_machine_that_stands_where_it_begins_or_ends_goes_first_or_last(end):
    marks = np.zeros((12, 15), dtype=bool)
    marks[end, 5:9] = True
    meetings = gather_meetings(np.array([12, 15]), {(0, 1): conflicts_of(marks)})
    durations = np.repeat([1.0, 1.5], [12, 15])
    rule = free_rule(meetings.cells)
    dead_ends = find_dead_ends(meetings, rule)
    course = drive_first_come(meetings, rule, dead_ends, durations, np.array([1, 0]))
    assert course.arrived
    assert orders_of(meetings, course).tolist() == [0 if end == 0 else 1]


def is_lost(case, a, b, i, j, known):
    """Whether machines a and b never arrive from a progress, by a search of all ways."""
    if (i, j) not in known:
        last_a, last_b = case.cells[a], case.cells[b]
        lost = (i, j) != (last_a, last_b)
        if lost and i < last_a:
            needed = case.needs.get((a, b), np.zeros(last_a + 1, dtype=int))
            may = i + 1 == last_a or needed[1 : i + 2].max() <= j
            lost = not may or is_lost(case, a, b, i + 1, j, known)
        if lost and j < last_b:
            needed = case.needs.get((b, a), np.zeros(last_b + 1, dtype=int))
            may = j + 1 == last_b or needed[1 : j + 2].max() <= i
            lost = not may or is_lost(case, a, b, i, j + 1, known)
        on = min(i, last_a - 1), min(j, last_b - 1)
        known[i, j] = bool(lost or case.marks[a, b][on])
    return known[i, j]


@pytest.mark.parametrize("seed", range(40))
def test_dead_ends_are_those_of_a_search_of_all_ways(seed):
    case = Case(seed, machines=2 + seed % 2)
    for a, b in case.marks:
        known = {}
        for i in range(case.cells[a] + 1):
            for j in range(case.cells[b] + 1):
                lost = is_lost(case, a, b, i, j, known)
                assert is_dead_end(case.dead_ends, a, i, b, j) == lost
                assert is_dead_end(case.dead_ends, b, j, a, i) == lost


@pytest.mark.parametrize("count", [2, 3, 5])
def test_a_convoy_round_a_field_arrives_though_no_state_is_safe(count):
    # One and a half rounds each, one behind another, on a ring; they park out of the way.
    ring, cells = 20 * count, 30 * count
    on = np.arange(cells)
    marks = {}
    for a in range(count):
        for b in range(a + 1, count):
            apart = (20 * (a - b) + on[:, None] - on[None, :]) % ring
            marks[a, b] = (apart <= 2) | (apart >= ring - 2)
            marks[a, b][-1] = marks[a, b][:, -1] = False
    meetings = gather_meetings(
        np.full(count, cells), {pair: conflicts_of(each) for pair, each in marks.items()}
    )
    rule = free_rule(meetings.cells)
    assert not bring_on(meetings, rule, np.zeros(count, dtype=np.int64))
    rng = np.random.default_rng(count)
    course = drive_first_come(
        meetings,
        rule,
        find_dead_ends(meetings, rule),
        rng.uniform(0.9, 1.1, count * cells),
        rng.permutation(count),
    )
    assert course.arrived
    # Replayed in the order of its events, no two are ever in conflict.
    progress = np.zeros(count, dtype=int)
    nodes = np.arange(count) * (cells + 1)
    for event in range(1, course.entered.max() + 1):
        node = int(np.flatnonzero(course.entered == event)[0])
        m = node // (cells + 1)
        progress[m] = node - nodes[m]
        at = np.minimum(progress, cells - 1)
        assert not any(marks[a, b][at[a], at[b]] for a, b in marks)
    assert (progress == cells).all()


@pytest.mark.parametrize("seed", range(20))
def test_a_progress_allows_all_cells_up_to_the_first_that_needs_more(seed):
    rng = np.random.default_rng([31, seed])
    others = int(rng.integers(1, 9))
    # Some need more than the other one ever does; the first may.
    needed = rng.integers(0, others + 2, int(rng.integers(1, 12)))
    table = np.full(others + 4, -7)
    _write_holds(needed, table, 2, others)
    for progress in range(others + 1):
        more = np.flatnonzero(needed > progress)
        assert table[2 + progress] == (more[0] if len(more) else len(needed)) - 1
    assert table[[0, 1, -1]].tolist() == [-7, -7, -7]
