"""Conflicts, orders and times of a few machines on made-up paths are as they were recorded."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.machines import Cart, cart_outline
from sightfield.systems.numerics.harvest.timing import conflicts, deciding, rule, sweep
from sightfield.systems.numerics.harvest.timing.timed_drive import (
    Journey,
    nominal_durations,
    paces_of,
)
from sightfield.systems.numerics.harvest.timing.timetable import time_machines, with_stops


def told(paths):
    return [(path.times, path.stations, path.speeds) for path in paths]


def met(journeys, needs=None):
    """Meetings of all machines, and the rule with what crop precedence needs."""
    sweeps = [each.sweep for each in journeys]
    cells = np.array([each.cells for each in sweeps])
    found = {
        (a, b): conflicts.find_conflicts(sweeps[a], sweeps[b], 0.7)
        for b in range(len(sweeps))
        for a in range(b)
    }
    meetings, free = rule.gather_meetings(cells, found), rule.free_rule(cells)
    for (m, n), needed in (needs or {}).items():
        rule.set_precedence(free, m, n, needed)
    return meetings, free


# Kind of paths, how many machines, and what draws them.
CASES = [(0, 3, 4), (1, 2, 1), (1, 3, 6), (2, 3, 2), (3, 4, 9)]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: "-".join(map(str, case)))
def journeys(request, fleets):
    kind, count, seed = request.param
    rng = np.random.default_rng([55, seed])
    return fleets.journeys_of(fleets.kinds[kind](rng, count), rng)


def test_encounters_and_dead_ends_are_as_recorded(journeys, as_recorded):
    needed = np.zeros(journeys[1].sweep.cells, dtype=np.int64)
    needed[len(needed) // 3 :] = journeys[0].sweep.cells // 4
    meetings, told_rule = met(journeys, {(1, 0): needed})
    as_recorded(meetings, "meetings")
    as_recorded(rule.find_dead_ends(meetings, told_rule), "dead ends")
    as_recorded(told_rule, "rule")


def test_first_come_first_served_and_the_search_are_as_recorded(journeys, as_recorded):
    meetings, free = met(journeys)
    durations = nominal_durations(free.cells, paces_of(journeys))
    as_recorded(durations, "durations")
    dead_ends = rule.find_dead_ends(meetings, free)
    course = deciding.drive_first_come(
        meetings, free, dead_ends, durations, np.arange(len(journeys))[::-1].copy()
    )
    as_recorded(course, "first come")
    as_recorded(deciding.orders_of(meetings, course), "orders")
    as_recorded(deciding.search_course(meetings, free, 300), "searched")


def test_times_and_waits_are_as_recorded(journeys, as_recorded):
    found = time_machines(journeys, trials=9, seed=3)
    if not hasattr(found, "paths"):
        as_recorded([found, str(found)])
        return
    as_recorded([told(found.paths), found.first, found.waiting, found.rule.by_order])
    stops = [(0, 17.3, 12.5), (1, 31.8, 40.0), (0, 44.1, 5.25)]
    as_recorded(told(with_stops(found, journeys, stops)), "with stops")


def test_cells_of_a_cart_are_as_recorded(fleets, as_recorded):
    path = fleets.drive((1.0, 2.0, 0.3), (12.0, 0.0), (9.0, 0.12), (-4.0, -0.1), (8.0, 0.05))
    behind = path.poses - 5.5 * np.column_stack(
        [np.cos(path.poses[:, 2] - 0.2), np.sin(path.poses[:, 2] - 0.2), 0.0 * path.poses[:, 2]]
    )
    behind[:, 2] -= 0.2 + 0.01 * path.stations
    outline = cart_outline(Cart(length=6.0, hitch_offset=0.9, width=2.7))
    stations = sweep.grid_stations(path, 1.7, [5.5, 14.25], sweep.outline_ways(path.poses, outline))
    found = sweep.cart_sweep(path, behind, outline, stations)
    # How many corners a hull has on a straight is a matter of rounding, its area is not.
    areas = [
        [shapely.Polygon(each).area for each in fleets.polygons_of(found, cell)]
        for cell in range(found.cells)
    ]
    as_recorded([found.margins, found.discs, found.polygon_discs, np.array(areas)], "sweep")
    as_recorded(conflicts.run_discs(found), "runs")
    limits = np.linspace(0.8, 2.4, len(path.lengths))
    other = Journey(path, found, limits, 0.45, np.array([5.5, 14.25]), np.array([3.0, 7.5]))
    as_recorded(paces_of([other]), "paces")
    as_recorded(told(time_machines([other]).paths), "times")


def test_what_machines_may_do_next_is_as_recorded(journeys, as_recorded):
    needed = np.zeros(journeys[1].sweep.cells, dtype=np.int64)
    needed[len(needed) // 3 :] = journeys[0].sweep.cells // 4
    meetings, told_rule = met(journeys, {(1, 0): needed})
    dead_ends = rule.find_dead_ends(meetings, told_rule)
    rng, said = np.random.default_rng(17), []
    for _ in range(250):
        progress = rng.integers(0, meetings.cells + 1)
        m, n = rng.permutation(len(progress))[:2]
        k = int(rng.integers(1, meetings.cells[m]))
        j = int(deciding.occupied(meetings, n, progress))
        said.append(
            [
                deciding.is_free(meetings, m, k, progress),
                deciding.gets_in_the_way(meetings, m, k, progress),
                deciding.in_conflict(meetings, m, k, n, j),
                deciding.reach_of(meetings, told_rule, m, progress),
                rule.hold_of(told_rule, m, progress),
                *rule.cause_of(told_rule, m, progress),
                rule.is_dead_end(dead_ends, m, progress[m], n, progress[n]),
                rule.is_dead_end(dead_ends, n, progress[n], m, progress[m]),
                *deciding._stops(meetings, told_rule, m, progress)[-2:],
            ]
        )
        on = progress.copy()
        moved = progress[m] < meetings.cells[m] and deciding.run_on(meetings, told_rule, m, on)
        brought = progress.copy()
        arrived = deciding.bring_on(meetings, told_rule, brought)
        closed = progress.copy()
        moves = deciding._close(meetings, told_rule, closed)
        assert (closed == brought).all()
        said.append([moved, *on, arrived, *brought, len(moves), *moves.ravel()[-2:]])
    as_recorded(np.array([float(each) for row in said for each in row]))


def test_machines_decide_by_who_is_asked_first_as_recorded(journeys, as_recorded):
    meetings, free = met(journeys)
    durations = nominal_durations(free.cells, paces_of(journeys))
    dead_ends = rule.find_dead_ends(meetings, free)
    rng = np.random.default_rng(3)
    for number in range(3):
        varied = durations * rng.uniform(0.6, 1.4, len(durations))
        priority = rng.permutation(len(journeys))
        course = deciding.drive_first_come(meetings, free, dead_ends, varied, priority)
        as_recorded([course, deciding.orders_of(meetings, course)], f"{number}")
