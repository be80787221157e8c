"""Journeys, needs and blocks at their very limits."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.paths import MachinePath, fastest_profile
from sightfield.systems.numerics.harvest.timing.conflicts import (
    cells_are_near,
    find_conflicts,
    run_discs,
)
from sightfield.systems.numerics.harvest.timing.deciding import search_course
from sightfield.systems.numerics.harvest.timing.rule import (
    DeadEnds,
    cause_of,
    first_nodes,
    free_rule,
    gather_meetings,
    hold_of,
    is_within,
    set_orders,
    set_precedence,
)
from sightfield.systems.numerics.harvest.timing.sweep import (
    Sweep,
    grid_stations,
    outline_ways,
    sweep_of,
)
from sightfield.systems.numerics.harvest.timing.timed_drive import (
    Journey,
    crossing,
    nearest_stations,
    nominal_durations,
    paces_of,
)
from sightfield.systems.numerics.harvest.timing.timetable import (
    Block,
    Standstill,
    explain_standstill,
    needed_progress,
    time_machines,
)


def test_the_nearest_station_is_the_later_one_of_two_as_near():
    stations = np.array([0.0, 1.0, 4.0, 4.5])
    wanted = [-3.0, 0.0, 0.4, 0.5, 0.6, 2.4, 2.6, 4.2, 9.0]
    assert nearest_stations(stations, wanted).tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 3]


def test_what_a_station_needs_counts_for_the_cells_on_both_its_sides():
    stations, others = np.array([0.0, 0.0, 2.0, 4.0, 4.0]), np.array([0.0, 0.0, 3.0, 6.0, 6.0])
    passed = np.array([-np.inf, -np.inf, 3.0, 3.1, -np.inf])
    assert needed_progress(stations, others, passed).tolist() == [0, 2, 3, 3]
    passed = np.array([-np.inf, -np.inf, -np.inf, 6.0 + 9e-7, -np.inf])
    assert needed_progress(stations, others, passed).tolist() == [0, 0, 3, 3]
    with pytest.raises(InvalidInput, match="`needs` must be stations up to 6 m"):
        needed_progress(stations, others, passed + 2e-7)
    with pytest.raises(InvalidInput, match="`needs` must have shape"):
        needed_progress(stations, others, passed[1:])


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        ("crop", "needs the crop cut by"),
        ("order", "has to let go first"),
        ("in the way", "is blocked by"),
        ("no place to pass", "has no place to let pass"),
    ],
)
def test_a_block_is_told_in_a_sentence(cause, words):
    block = Block(2, 31.6, (4.4, -7.6), 1, 12.2, cause)
    sentence = f"machine 2 at 32 m of its path (4, -8) {words} machine 1 at 12 m"
    assert str(block) == sentence
    assert str(Standstill((block, block), (3, 4))) == f"{sentence}; {sentence}"


def test_a_number_is_in_an_interval_from_its_begin_to_before_its_end():
    rows, begins, ends = np.array([0, 2, 2, 3]), np.array([1, 5, 0]), np.array([3, 6, 2])
    intervals = DeadEnds(np.zeros((1, 1), dtype=np.int64), rows, begins, ends)
    inside = [[j for j in range(8) if is_within(intervals, row, j)] for row in range(3)]
    assert inside == [[1, 2, 5], [], [0, 1]]


def test_the_hold_is_the_last_cell_before_the_first_that_lacks_something():
    rule = free_rule(np.array([4, 3, 5]))
    assert first_nodes(rule.cells).tolist() == [0, 5, 9]
    progress = np.zeros(3, dtype=np.int64)
    assert [hold_of(rule, m, progress) for m in range(3)] == [3, 2, 4]
    assert cause_of(rule, 0, progress) == (-1, False)
    set_precedence(rule, 0, 2, np.array([9, 0, 2, 1]))
    set_precedence(rule, 1, 0, np.array([0, 0, 4]))
    # The first cell is not asked.
    holds = []
    for k in range(6):
        progress[2] = k
        holds.append(hold_of(rule, 0, progress))
    assert holds == [1, 1, 3, 3, 3, 3]
    progress[:] = 0
    assert cause_of(rule, 0, progress) == (2, True)
    assert cause_of(rule, 1, progress) == (0, True)
    assert [hold_of(rule, 1, np.array([k, 0, 0])) for k in range(5)] == [1, 1, 1, 1, 2]
    rule.by_order[rule.places[1, 0] : rule.places[1, 0] + 5] = 0
    assert cause_of(rule, 1, progress) == (0, False)


def straight(length, fleets):
    return fleets.drive((0.0, 0.0, 0.2), (length, 0.0))


def test_a_journey_allows_what_lies_at_its_limits(fleets):
    path = fleets.drive((0.0, 0.0, 0.2), (20.0, 0.0), (-8.0, 0.1))
    sweep = sweep_of(path, fleets.outline, grid_stations(path, 1.0, [3.3]))
    assert Journey(path, sweep, 1.0, 0.5, np.array([3.3 + 1.9e-6]), np.array([0.0])).dwells == [0]
    for told, word in (
        ((1.0, 0.5, np.array([3.3 + 2.1e-6]), np.zeros(1)), "sweep"),
        ((1.0, 0.5, np.array([3.3]), np.array([-1e-9])), "dwells"),
        ((1.0, 0.0), "acceleration"),
        ((np.append(np.ones(len(path.lengths) - 1), 0.0), 0.5), "limits"),
    ):
        with pytest.raises(InvalidInput, match=f"`{word}` must"):
            Journey(path, sweep, *told)


@pytest.mark.parametrize(
    ("first", "last", "length", "expected"),
    [
        # Standing, it speeds up and slows down, with an even stretch where there is room.
        (0.0, 0.0, 2.0, (2 * 2.0**0.5 / 0.5**0.5, 2.0**0.5 * 0.5**0.5)),
        (0.0, 0.0, 40.0, (1.5 / 0.5 + 40.0 / 1.5, 1.5)),
        # At the limit of what counts as standing.
        (0.25, 0.09, 1.0, None),
        (0.2500001, 0.09, 1.0, (2.0 / 0.8, 0.0)),
        (1.0, 2.25, 3.0, (6.0 / 2.5, 0.0)),
        (0.0, 0.0, 0.0, (0.0, 0.0)),
    ],
)
def test_a_cell_is_crossed_with_or_without_a_peak(first, last, length, expected):
    taken, peak = crossing(first, last, length, 1.5, 0.5)
    if expected is None:
        top = ((first + last) / 2 + 0.5 * length) ** 0.5
        expected = ((2 * top - first**0.5 - last**0.5) / 0.5, top)
    assert (taken, peak) == pytest.approx(expected, rel=1e-6)


def test_a_dwell_is_at_the_end_of_its_cell_and_dwells_in_one_place_add_up(fleets):
    path = straight(12.0, fleets)
    sweep = sweep_of(path, fleets.outline, grid_stations(path, 2.0, [5.0]))
    stops, dwells = np.array([5.0, 12.0, 5.0]), np.array([7.0, 3.0, 0.5])
    paces = paces_of([Journey(path, sweep, 1.5, 0.5, stops, dwells)])
    free = paces_of([Journey(path, sweep, 1.5, 0.5, np.array([5.0]), np.array([0.0]))])
    cells = np.array([sweep.cells])
    more = nominal_durations(cells, paces) - nominal_durations(cells, free)
    at = {5.0: 7.5}
    # The last two stations are in one place: the stop is at the first of them.
    ends = sweep.stations[1:]
    expected = [at.get(float(end), 0.0) for end in ends]
    expected[-2 if more[-2] > 0 else -1] = 3.0
    assert more == pytest.approx(expected)


def test_a_grid_keeps_its_longest_cell_and_stops_at_both_ends(fleets):
    path = straight(6.0, fleets)
    assert grid_stations(path, 2.0) == pytest.approx([0, 0, 2, 4, 6, 6])
    assert grid_stations(path, 1.999) == pytest.approx([0, 0, 1.5, 3, 4.5, 6, 6])
    assert grid_stations(path, 2.0, [0.0, 6.0, 4.0 + 5e-7]) == pytest.approx([0, 0, 2, 4, 6, 6])
    assert len(grid_stations(path, 2.0, [4.0 + 2e-6])) == 7
    for stop in (-1e-9, 6.0 + 1e-9):
        with pytest.raises(InvalidInput, match="`stops` must be from 0 to 6 m"):
            grid_stations(path, 2.0, [stop])
    with pytest.raises(InvalidInput, match="`spacing` must be positive"):
        grid_stations(path, 0.0)
    tiny = MachinePath.of([[1.0, 2.0, 0.0], [1.0 + 9e-7, 2.0, 0.0]])
    assert grid_stations(tiny).tolist() == [0.0, 0.0]


def test_points_off_the_axle_go_farther_in_turns_by_what_the_turn_adds():
    poses = np.array([[0.0, 0.0, 0.1], [3.0, 0.2, 0.9], [8.0, 5.0, 0.9]])
    outline = [np.array([[2.0, -1.0], [-4.0, 0.5]]), np.array([[0.5, 3.0]])]
    chord, turn = np.hypot(3.0, 0.2), 0.8
    length = chord * (turn / 2) / np.sin(turn / 2)
    each = [np.hypot(length + turn * y, turn * x) for x, y in ((2, 1), (4, 0.5), (0.5, 3))]
    assert outline_ways(poses, outline) == pytest.approx([max(each), np.hypot(5.0, 4.8)])


def box_sweep(x, y, margin):
    """One cell with one square of 2 m."""
    points = np.array([[x, y], [x + 2.0, y], [x + 2.0, y + 2.0], [x, y + 2.0]])
    discs = np.array([[x + 1.0, y + 1.0, 2.0**0.5]])
    return Sweep(np.zeros(2), points, np.array([0, 4]), 1, np.array([margin]), discs, discs)


@pytest.mark.parametrize(
    ("x", "y", "gap", "near"),
    [
        (2.5, 0.0, 0.375, False),
        (2.5, 0.0, 0.376, True),
        (2.3, 2.4, 0.374, False),
        (2.3, 2.4, 0.376, True),
        (-2.3, -2.4, 0.376, True),
        (-2.3, 2.4, 0.374, False),
        (1.0, 1.0, 0.0, True),
        (0.0, 9.0, 0.376, False),
    ],
)
def test_cells_are_near_if_squares_are_nearer_than_the_gap_and_both_margins(x, y, gap, near):
    one, other = box_sweep(0.0, 0.0, 0.1), box_sweep(x, y, 0.025)
    apart = shapely.box(0, 0, 2, 2).distance(shapely.box(x, y, x + 2, y + 2))
    assert (apart < gap + 0.125 - 1e-12) == near
    assert cells_are_near(one, other, 0, 0, gap) == near
    assert cells_are_near(other, one, 0, 0, gap) == near


def test_touching_squares_are_near_only_if_a_distance_is_asked_for():
    one, other = box_sweep(0.0, 0.0, 0.0), box_sweep(2.0, 0.5, 0.0)
    assert not cells_are_near(one, other, 0, 0, 0.0)
    assert cells_are_near(one, other, 0, 0, 1e-6)


def test_discs_round_runs_cover_discs_of_cells_and_their_margins(fleets):
    path = fleets.drive((1.0, 2.0, 0.3), (50.0, 0.0), (20.0, 0.1), (11.0, 0.0))
    sweep = sweep_of(path, fleets.outline, grid_stations(path))
    runs = run_discs(sweep)
    assert len(runs) == -(-sweep.cells // 32)
    for number, (x, y, radius) in enumerate(runs):
        own = slice(32 * number, 32 * number + 32)
        discs = sweep.discs[own]
        assert [x, y] == pytest.approx(discs[:, :2].mean(axis=0))
        beyond = np.hypot(*(discs[:, :2] - [x, y]).T) + discs[:, 2] + sweep.margins[own]
        assert radius == pytest.approx(beyond.max())


def test_between_stops_in_one_cell_a_machine_speeds_up_and_slows_down(fleets):
    path, acceleration = straight(14.0, fleets), 0.4
    stops, dwells = np.array([4.0, 4.7, 6.0, 8.0, 12.25]), np.array([2.0, 0.0, 3.0, 1.0, 2.5])
    sweep = sweep_of(path, fleets.outline, grid_stations(path, 2.0, stops))
    limits = np.full(len(path.lengths), 0.6)
    timed = time_machines([Journey(path, sweep, limits, acceleration, stops, dwells)]).paths[0]
    begin = 0.0
    ends = [*stops, 14.0]
    for first, last, dwell in zip([0.0, *stops], ends, [*dwells, 0.0], strict=True):
        alone = fastest_profile(straight(last - first, fleets), 0.6, acceleration)
        at = np.linspace(0.0, alone.end, 200)
        # On these cells it is as quick as can be, with speeds that change within them.
        there = timed.station_at(begin + at) - first
        np.testing.assert_allclose(there, alone.station_at(at), atol=1e-6)
        pace = timed.speed_at(begin + at)[1:-1]
        np.testing.assert_allclose(pace, alone.speed_at(at)[1:-1], atol=1e-6)
        arrives = timed.times[np.abs(timed.stations - last) < 1e-9]
        assert arrives[0] == pytest.approx(begin + alone.end)
        begin = arrives[0] + dwell
        assert last == 14.0 or arrives[-1] == pytest.approx(begin)
    assert timed.end == arrives[-1]


def blocks_of(found, sweeps):
    for each in found.blocks:
        assert each.by != each.machine
        assert each.station in sweeps[each.machine].stations
        assert each.by_station in sweeps[each.by].stations
        assert each.place in [tuple(disc[:2]) for disc in sweeps[each.machine].discs.tolist()]
    return [(each.machine, each.by, each.cause, each.by_station) for each in found.blocks]


def test_machines_in_a_row_are_blocked_each_by_the_one_that_it_is_in(fleets):
    starts = [(0.0, 0.0, 0.2), (1.0, 3.0, 1.2), (2.0, 90.0, 0.4), (3.0, 93.0, 1.1)]
    journeys = [fleets.journey(fleets.drive(start, (30.0, 0.0))) for start in starts]
    found = time_machines(journeys)
    blocks = blocks_of(found, [each.sweep for each in journeys])
    assert [each[:3] for each in blocks] == [
        (machine, machine ^ 1, "in the way") for machine in range(4)
    ]
    assert [each[3] for each in blocks] == [0.0] * 4
    assert found.progress == (0, 0, 0, 0)


def test_machines_that_come_head_on_name_where_the_other_would_come_by(fleets):
    one = fleets.journey(fleets.drive((0.0, 0.0, 0.2), (60.0, 0.0)))
    x, y = 60 * np.cos(0.2), 60 * np.sin(0.2)
    other = fleets.journey(fleets.drive((x, y, 0.2 + np.pi), (60.0, 0.0)))
    beside = fleets.journey(fleets.drive((-40.0, 80.0, 0.2), (20.0, 0.0)))
    found = time_machines([one, beside, other])
    sweeps = [each.sweep for each in (one, beside, other)]
    blocks = blocks_of(found, sweeps)
    assert [each[:3] for each in blocks] == [
        (0, 2, "no place to pass"),
        (2, 0, "no place to pass"),
    ]
    # The way of the other leads past all the places that a machine can get to.
    for block in found.blocks:
        assert block.station + block.by_station == pytest.approx(60.0, abs=21.0)
    assert found.progress == (0, beside.sweep.cells, 0)


def test_orders_that_nobody_can_keep_are_told(fleets):
    lines = [
        fleets.drive((0.0, 0.0, 0.1), (80.0, 0.0)),
        fleets.drive((40.0, -40.0, 1.7), (80.0, 0.0)),
        fleets.drive((10.0, 40.0, -1.0), (80.0, 0.0)),
    ]
    sweeps = [fleets.journey(path).sweep for path in lines]
    cells = np.array([each.cells for each in sweeps])
    pairs = [(0, 1), (0, 2), (1, 2)]
    found = {(a, b): find_conflicts(sweeps[a], sweeps[b]) for a, b in pairs}
    meetings, rule = gather_meetings(cells, found), free_rule(cells)
    # Each waits for the next one, in a ring.
    first = np.array([{(0, 1): 1, (0, 2): 0, (1, 2): 2}[tuple(pair)] for pair in meetings.pairs])
    for a, b in pairs:
        set_orders(rule, meetings, first, a, b)
    # All stand at their holds.
    progress = np.zeros(3, dtype=np.int64)
    progress[:] = [hold_of(rule, m, progress) for m in range(3)]
    explained = explain_standstill(meetings, rule, progress, sweeps)
    waits_for = {(m, n) for m, n, cause, _ in blocks_of(explained, sweeps) if cause == "order"}
    assert waits_for == {(0, 1), (1, 2), (2, 0)}
    assert explained.progress == tuple(progress)
    for block in explained.blocks:
        assert block.station == sweeps[block.machine].stations[progress[block.machine] + 1]
        assert block.by_station == sweeps[block.by].stations[progress[block.by]]


def test_without_a_way_it_is_told_how_far_machines_were_brought(fleets):
    paths = [((0.0, 0.0), 0.2, 60.0), ((60 * np.cos(0.2), 60 * np.sin(0.2)), 0.2 + np.pi, 60.0)]
    paths += [((-40.0, 80.0), 0.2, 20.0)]
    sweeps = [
        fleets.journey(fleets.drive((*place, course), (way, 0.0))).sweep
        for place, course, way in paths
    ]
    cells = np.array([each.cells for each in sweeps])
    found = {(0, 1): find_conflicts(sweeps[0], sweeps[1])}
    meetings, rule = gather_meetings(cells, found), free_rule(cells)
    for budget in (0, 50):
        course = search_course(meetings, rule, budget)
        assert not course.arrived
        assert course.progress.tolist() == [0, 0, cells[2]]
        assert (course.entered == -1).all()
    # With the first budget nothing was looked at, not even what is simple.
    alone, free = gather_meetings(cells[2:], {}), free_rule(cells[2:])
    assert not search_course(alone, free, 0).arrived
    easy = search_course(alone, free, 1)
    assert easy.arrived
    assert easy.entered.tolist() == list(range(cells[2] + 1))
