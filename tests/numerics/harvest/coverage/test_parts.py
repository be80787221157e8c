"""What plans of coverage are put together from, against brute force."""

import itertools
import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.coverage import cut_ground
from sightfield.systems.numerics.harvest.coverage.cut_ground import CutGround
from sightfield.systems.numerics.harvest.coverage.driver import Driver, Gate, NoWay, drive_gate
from sightfield.systems.numerics.harvest.coverage.loops import (
    crop_to_offset,
    cutting_radius,
    drive_edge,
    drive_line,
    lay_out_loops,
    smooth_line,
)
from sightfield.systems.numerics.harvest.coverage.precedence import (
    can_finish,
    crop_under_bodies,
    find_precedence,
)
from sightfield.systems.numerics.harvest.coverage.swaths import (
    FILLED,
    OPEN,
    STANDS,
    UNTROUBLED,
    SwathTimes,
    lay_out_swaths,
    left_neighbour,
    order_swaths,
    split_chain,
)
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath
from sightfield.systems.numerics.harvest.turns.borders import CROP_CELL

COMBINE = Combine(header_width=7.0, turning_radius=4.0, length=7.5, width=3.2)


def _straight(x0, y0, x1, y1, *, cutting=True):
    theta = math.atan2(y1 - y0, x1 - x0)
    poses = np.array([[x0, y0, theta], [x1, y1, theta]])
    return MachinePath(poses, np.array([1]), np.array([cutting]), np.array([0]))


def test_on_the_cutting_radius_the_body_s_corner_follows_the_header_s_end():
    radius = cutting_radius(COMBINE)
    assert radius > COMBINE.turning_radius
    corner = math.hypot(radius + COMBINE.width / 2, COMBINE.length)
    assert corner == pytest.approx(radius + COMBINE.header_width / 2)


def test_a_polyline_along_an_arc_is_driven_as_nearly_that_arc():
    angles = np.linspace(0.0, 2.0, 41)
    points = 20.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    path = drive_line(points, cutting=True)
    assert path.curvatures[1:-1] == pytest.approx(np.full(len(path.lengths) - 2, 0.05), rel=0.02)


@pytest.mark.parametrize("before_end", [1.5, 4.0, 40.0])
def test_a_line_is_driven_no_more_sharply_than_asked_however_near_to_its_end_it_turns(before_end):
    radius = 6.3
    lean = 0.7
    line = shapely.LineString(
        [(0, 0), (50, 0), (50 + before_end * math.cos(lean), before_end * math.sin(lean))]
    )
    for each in (line, shapely.reverse(line)):
        path = drive_line(np.array(smooth_line(each, radius).coords), cutting=True)
        assert np.abs(path.curvatures).max() < 1.1 / radius
        ends = path.poses[[0, -1], :2] - np.array(each.coords)[[0, -1]]
        # The arc leaves the corner by this much, and the ends no more.
        assert np.hypot(*ends.T).max() < radius * (1 / math.cos(lean / 2) - 1) + 0.05


def test_a_line_that_comes_round_to_where_it_began_keeps_its_length():
    angles = np.linspace(0.1, 0.1 + 2 * math.pi + 2.0 / 60.0, 120)
    points = 60.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    # A turn nearer to its beginning than the radius.
    points[0] *= 1.02
    line = shapely.LineString(points)
    smoothed = smooth_line(line, 6.3)
    assert smoothed.length == pytest.approx(line.length, abs=6.0)
    assert smoothed.hausdorff_distance(line) < 1.3
    assert not smoothed.equals_exact(line, 1e-6)


@pytest.mark.parametrize("name", ["circle_12", "blob_5"])
def test_a_round_by_one_combine_begins_and_ends_where_it_should_wherever_that_is(
    field_makers, name
):
    combine = Combine()
    field = field_makers[name]()
    region, ground = crop_to_offset(field, combine), CutGround.of(field, combine)
    loop = lay_out_loops(region, combine, 0, ground.has_room)[0]
    for begin in np.arange(0.0, loop.length, 17.3):
        path = drive_edge(loop, begin, begin + loop.length + 2.0, (0.0, 0.0), combine)
        for pose, station in ((path.poses[0], begin), (path.poses[-1], begin + 2.0)):
            assert np.hypot(*(pose - loop.pose(station))[:2]) < 0.3


@pytest.mark.parametrize("direction", [0.0, 0.7, 2.5])
def test_swaths_cover_a_region_with_a_notch_and_a_hole(direction):
    region = (
        shapely.box(0, 0, 150, 90) - shapely.box(60, 40, 80, 95) - shapely.box(100, 10, 120, 30)
    )
    swaths = lay_out_swaths(region, direction, COMBINE)
    strips = [
        shapely.LineString(swath.ends).buffer(COMBINE.header_width / 2, cap_style="flat")
        for swath in swaths
    ]
    left = region.difference(shapely.union_all(strips))
    # Pieces of less than a fiftieth of the header squared are left.
    assert left.area < 0.02 * COMBINE.header_width**2 * len(swaths) * 0.5
    # None goes on across the notch.
    notch = shapely.box(60, 40, 80, 95)
    assert max(shapely.LineString(swath.ends).intersection(notch).length for swath in swaths) < 15


# Draws in which crop on the left changes what is best.
@pytest.mark.parametrize("seed", [0, 1, 2, 4, 6])
def test_annealing_finds_the_best_order_of_five_swaths(seed):
    rng = np.random.default_rng(seed)
    # Strips 0 to 3 from the right to the left, the last one beside crop of somebody else, and one
    # by itself.
    left = np.array([1, OPEN, 2, 0, 3, 1, STANDS, 2, OPEN, OPEN])
    times = SwathTimes(
        rng.uniform(5, 60, (10, 10)),
        rng.uniform(5, 60, 10),
        left,
        rng.uniform(20, 60, 10),
        rng.uniform(0.2, 0.8, 5),
    )
    totals, without = {}, {}
    for order in itertools.permutations(range(5)):
        for ways in itertools.product((0, 1), repeat=5):
            nodes = [2 * i + way for i, way in zip(order, ways, strict=True)]
            between = sum(times.between[a, b] for a, b in itertools.pairwise(nodes))
            without[tuple(nodes)] = times.first[nodes[0]] + between
            closed, runs = 0.0, [0.0]
            for place, node in enumerate(nodes):
                beside = int(left[node])
                if beside == STANDS or (beside != OPEN and beside not in order[:place]):
                    closed += times.closed[node]
                    runs[-1] += times.fill[node // 2]
                else:
                    runs.append(0.0)
            full = FILLED * sum(max(run - UNTROUBLED, 0.0) ** 2 for run in runs)
            totals[tuple(nodes)] = without[tuple(nodes)] + closed + full
    order = tuple(order_swaths(times, 3))
    assert totals[order] == pytest.approx(min(totals.values()))
    assert order != min(without, key=without.__getitem__)
    assert sorted(node // 2 for node in order) == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(("fill", "apart"), [(0.2, False), (0.8, True)])
def test_two_closed_swaths_are_driven_apart_if_both_together_overfill_a_tank(fill, apart):
    # Two with crop on their left on either way, and an open one that is out of the way.
    between = np.full((6, 6), 20.0)
    between[4:] = between[:, 4:] = 40.0
    left = np.array([STANDS] * 4 + [OPEN] * 2)
    closed, fills = np.full(6, 30.0), np.array([fill, fill, 0.1])
    order = order_swaths(SwathTimes(between, np.full(6, 10.0), left, closed, fills), 0)
    assert (order[1] // 2 == 2) == apart


def test_on_the_left_of_a_swath_is_the_one_beside_most_of_it():
    # A notch from the north parts the upper strips; a piece apart lies beside none of them.
    region = shapely.box(0, 0, 150, 28) - shapely.box(60, 14, 160, 30)
    swaths = lay_out_swaths(region | shapely.box(0, 60, 150, 67), 0.0, COMBINE)
    lengths = [round(swath.length) for swath in swaths]
    assert lengths == [152, 152, 62, 62, 152]
    forth = [left_neighbour(tuple(swaths), k, back=False) for k in range(5)]
    back = [left_neighbour(tuple(swaths), k, back=True) for k in range(5)]
    assert forth == [1, None, 3, None, None]
    assert back == [None, 0, 1, 2, None]


def test_a_chain_is_split_so_that_the_latest_ends_earliest():
    rng = np.random.default_rng(2)
    # The second worker takes longer for each work than the first, the third less.
    times = rng.uniform(10, 50, 9) * np.array([[1.0], [1.4], [0.7]])
    begins = np.array([40.0, 0.0, 25.0])
    parts = split_chain(times, begins)
    each = zip(begins, times, parts, strict=True)
    latest = max(begin + own[part].sum() for begin, own, part in each)
    best = min(
        max(
            begins[0] + times[0, :i].sum(),
            begins[1] + times[1, i:j].sum(),
            begins[2] + times[2, j:].sum(),
        )
        for i in range(10)
        for j in range(i, 10)
    )
    assert latest == pytest.approx(best, abs=1e-3)


def test_who_crosses_a_swath_waits_until_it_is_cut_there():
    field = Field.rectangle(60.0, 7.0)
    cutter = _straight(-5.0, 3.5, 65.0, 3.5)
    # Goes north across the swath at x = 40, its header up.
    crosser = _straight(40.0, -20.0, 40.0, 30.0, cutting=False)
    precedence = find_precedence(field, (cutter, crosser), COMBINE)
    needed = precedence.needs[1][0]
    # Crop up to the body's far side is cut once the header's middle is past it.
    assert needed[-1] == pytest.approx(45.0 + COMBINE.width / 2, abs=0.8)
    # The body's front is behind the header, which enters the crop at station 20.
    assert needed[int(20.0 + COMBINE.header_depth / 2) - 3] == 0.0
    assert needed[int(20.0 + COMBINE.header_depth / 2) + 2] > 40.0
    assert not precedence.needs[0][1].any()
    assert precedence.crop_under_bodies == 0.0
    assert can_finish(precedence)


@pytest.mark.parametrize(("begins", "share"), [(0.0, 1.0), (1000.0, 0.0)])
def test_who_crosses_a_swath_before_it_is_cut_drives_over_crop(begins, share):
    field = Field.rectangle(60.0, 7.0)
    cutter = _straight(-5.0, 3.5, 65.0, 3.5)
    crosser = _straight(40.0, -20.0, 40.0, 30.0, cutting=False)
    # At one metre a second.
    timed = [
        TimedPath(
            path, first + np.array([0.0, path.length]), np.array([0.0, path.length]), np.ones(2)
        )
        for path, first in ((cutter, 100.0), (crosser, begins))
    ]
    under = crop_under_bodies(field, timed, COMBINE)
    assert under == pytest.approx(share * 7.0 * COMBINE.width, rel=0.1)


def test_a_body_that_drives_over_crop_nobody_cuts_is_told():
    field = Field.rectangle(60.0, 30.0)
    path = _straight(20.0, -20.0, 20.0, 60.0, cutting=False)
    under = find_precedence(field, (path,), COMBINE).crop_under_bodies
    assert under == pytest.approx(30.0 * COMBINE.width, rel=0.2)


def test_the_tail_treads_on_crop_outside_of_a_circle_that_is_narrower_than_the_cutting_radius():
    field, radius = Field.rectangle(80.0, 80.0), 7.0
    angles = np.linspace(0.0, 2 * math.pi, 200)
    ring = 40.0 + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    path = drive_line(ring, cutting=True)
    corner = math.hypot(radius + COMBINE.width / 2, COMBINE.length)
    end = radius + COMBINE.header_width / 2
    assert corner > end + 0.5
    # Besides, where it begins, all of the body stands on crop.
    expected = math.pi * (corner**2 - end**2) + COMBINE.width * (COMBINE.length - 1.0)
    found = find_precedence(field, (path,), COMBINE).crop_under_bodies
    assert found == pytest.approx(expected, rel=0.2)


def test_combines_that_need_each_other_s_first_swath_cannot_finish():
    field = Field.rectangle(60.0, 60.0)

    def first_there_then_here(here, there):
        # Over the swath of the other, its header up, and back over its own.
        over, own = (
            _straight(-10.0, there, 50.0, there, cutting=False),
            _straight(50, here, -9, here),
        )
        poses = np.concatenate([over.poses, own.poses])
        down = np.array([False, False, True])
        return MachinePath(poses, np.ones(3, dtype=int), down, np.arange(3))

    paths = first_there_then_here(10.0, 40.0), first_there_then_here(40.0, 10.0)
    assert not can_finish(find_precedence(field, paths, COMBINE))


def test_combines_that_would_wait_for_a_strip_of_each_other_s_crop_drive_over_it():
    field = Field.rectangle(200.0, 200.0)

    def beside_the_crop_then_into_it(first, last, swath):
        # The body reaches 0.8 m over the edge, across the other one's swath, its header up.
        north = [[-0.8, first], [-0.8, last], [-30.0, last], [-30.0, swath]]
        poses = [[x, y, math.pi / 2] for x, y in north]
        poses += [[-30.0, swath, 0.0], [205.0, swath, 0.0]]
        down = np.array([False, False, False, False, True])
        return MachinePath(np.array(poses), np.ones(5, dtype=int), down, np.arange(5))

    paths = (
        beside_the_crop_then_into_it(120.0, 150.0, 60.0),
        beside_the_crop_then_into_it(40.0, 75.0, 140.0),
    )
    precedence = find_precedence(field, paths, COMBINE)
    assert can_finish(precedence)
    # One waits for the other still, of whom all that it drives over is told.
    waits = [bool(precedence.needs[m][1 - m].any()) for m in (0, 1)]
    assert sorted(waits) == [False, True]
    ways = np.array([30.0, 35.0]) + COMBINE.length - 1.0
    crossed = COMBINE.header_width * np.array(waits)
    assert precedence.crop_under_bodies == pytest.approx(0.8 * (ways - crossed).sum(), rel=0.15)


def test_a_narrow_header_leaves_the_ring_round_a_pole_as_it_came_there(field_makers, monkeypatch):
    # Where there is no way, a long search finds none either.
    monkeypatch.setattr(cut_ground, "EXPANSIONS", 600)
    field, narrow = field_makers["pole_6"](), Combine(header_width=4.5)
    ground = CutGround.of(field, narrow)
    loops = lay_out_loops(crop_to_offset(field, narrow), narrow, 0, ground.has_room)
    ring = next(loop for loop in loops if loop.hole)
    points = np.array(ring.line.coords)
    x, y = points[np.argmin(points[:, 1])]
    ground.crop.mark(shapely.box(0, 0, 25, 200), stands=False)
    start, on_ring = np.array([12.0, y, 0.0]), np.array([x, y, 0.0])
    gate = Gate((ring,), None, start, MachinePath.of([start, on_ring], cutting=True), x - 12.0)
    driver = Driver(ground, [])
    driver.go(start)
    drive_gate(driver, gate, None, np.inf)
    goal = np.array([10.0, 60.0, math.pi / 2])
    came = driver.path.length
    driver.go(goal)
    assert driver.pose[:2] == pytest.approx(goal[:2])
    assert math.remainder(driver.pose[2] - goal[2], math.tau) == pytest.approx(0.0, abs=1e-9)
    way = driver.paths[-1]
    # Backwards at least from the ring to the edge, on what it has cut.
    assert way.lengths[way.gears < 0].sum() > gate.length
    assert way.length < came + 120.0
    assert ground.admits(way)
    # Else there is none.
    with pytest.raises(NoWay):
        driver.way_to(ring.pose(0.3 * ring.length), goal)


def test_a_loop_without_corners_goes_all_the_way_round():
    combine = Combine(header_width=6.0, turning_radius=6.0)
    disc = shapely.Point(3.0, -2.0).buffer(40.0, quad_segs=200)
    (loop,) = lay_out_loops(disc, combine, 0, lambda pose: True)
    assert len(loop.corners) == 0
    # Half a header inside the edge, to the 2 cm to which it is simplified.
    places = shapely.points(shapely.get_coordinates(shapely.segmentize(loop.line, 0.5)))
    assert shapely.distance(places, disc.exterior) == pytest.approx(3.0, abs=0.03)


@pytest.mark.parametrize("end", np.linspace(0.6, 2.6, 21))
def test_what_lies_under_the_very_end_of_a_way_is_waited_for(end):
    field = Field.rectangle(60.0, 7.0)
    cutter = _straight(-5.0, 3.5, 65.0, 3.5)
    crosser = _straight(40.0, -20.0, 40.0, end, cutting=False)
    needed = find_precedence(field, (cutter, crosser), COMBINE).needs[1][0][-1]
    # How far the body, which begins behind the header, stands in the crop.
    depth = end - COMBINE.header_depth / 2
    if depth > CROP_CELL:
        assert needed == pytest.approx(45.0 + COMBINE.width / 2, abs=0.8)
    elif depth < 0.0:
        assert needed == 0.0
