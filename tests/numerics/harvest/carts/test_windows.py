"""Windows beside combines, against the auger's reach, strips of headers and outlines."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.carts.cart_motion import CartMotion
from sightfield.systems.numerics.harvest.carts.cart_plan import Stop
from sightfield.systems.numerics.harvest.carts.cut_times import cut_times, free_cells, opened
from sightfield.systems.numerics.harvest.carts.traffic import combine_traffic
from sightfield.systems.numerics.harvest.carts.windows import (
    SHORTEST,
    beside,
    drive_beside,
    find_windows,
    gentle_runs,
    lane_beside,
)
from sightfield.systems.numerics.harvest.coverage.loops import drive_line
from sightfield.systems.numerics.harvest.machines import (
    Cart,
    Combine,
    cart_outline,
    combine_outline,
    is_alongside,
)
from sightfield.systems.numerics.harvest.paths import TimedPath


@pytest.mark.parametrize("hitch", [0.0, 0.9])
def test_in_a_window_grain_flows_and_the_ground_was_cut_before(hand_made, outlines_at, hitch):
    made = hand_made(160.0, 130.0, 2)
    cart = Cart(hitch_offset=hitch, length=4.6)
    cut = cut_times(made.field, made.combine, made.plans)
    ground = opened(free_cells(made.field, cut), cut)
    traffic = combine_traffic(made.combine, made.plans)
    windows = find_windows([made.combine] * len(made.plans), cart, made.plans, ground, traffic)
    reach = made.combine.header_width / 2 + made.combine.cart_gap + cart.width / 2
    assert {window.combine for window in windows} == {0, 1}
    strips, times = [], []
    for plan in made.plans:
        at = np.arange(0.0, plan.end + 1.0, 1.0)
        header = np.array(combine_outline(made.combine))[:1]
        boxes = outlines_at(header, plan.pose_at(at))[:, 0]
        hulls = shapely.convex_hull(
            shapely.multipolygons(np.stack([boxes[:-1], boxes[1:]], axis=1))
        )
        down = plan.path.cutting[plan.path.piece_at(plan.station_at(at))]
        strips.append(hulls[down[1:] & down[:-1]])
        times.append(at[1:][down[1:] & down[:-1]])
    strips, times = np.concatenate(strips), np.concatenate(times)
    tree = shapely.STRtree(strips)
    tractor, trailer = (np.array(part)[None] for part in cart_outline(cart))
    for window in windows:
        plan, other = made.plans[window.combine], made.plans[1 - window.combine]
        assert plan.station_at(window.end) - plan.station_at(window.begin) >= SHORTEST
        timed = drive_beside(plan, window.lane, window.begin, window.end)
        leg = CartMotion(timed, cart, 0.0)
        for moment in np.linspace(window.begin, window.end, 12):
            pose = plan.pose_at(moment)
            first, second = leg.poses_at(np.array([moment]))
            state = np.array([*first[0], 0.0])
            assert is_alongside(pose, state, cart.length, hitch, reach, False)
            boxes = [outlines_at(tractor, first)[0, 0], outlines_at(trailer, second)[0, 0]]
            away = outlines_at(np.array(combine_outline(made.combine)), other.pose_at([moment]))
            own = outlines_at(np.array(combine_outline(made.combine)), pose[None])
            for box in boxes:
                assert min(box.distance(each) for each in away[0]) >= 0.5
                assert min(box.distance(each) for each in own[0]) >= 0.5
                assert made.field.ground.contains(box)
                under = box.intersection(made.field.polygon)
                known = tree.query(box, predicate="intersects")
                done = strips[known[times[known] <= moment - 4.0]]
                left = under.difference(shapely.union_all(done))
                assert left.buffer(-0.25).area < 1e-3


@pytest.mark.parametrize("stands_at", np.linspace(31.3, 58.7, 7))
def test_a_tractor_stands_beside_a_combine_that_stands_in_a_bend(stands_at, stopped):
    """Rounding of the ways between let stations decrease."""
    combine, cart = Combine(), Cart()
    angles = np.linspace(0.0, 0.9, 60)
    arc = 90.0 * np.column_stack([np.sin(angles), 1 - np.cos(angles)])
    path = drive_line(arc, cutting=True)
    times = np.array([0.0, path.length / combine.speed])
    driven = TimedPath(path, times, np.array([0.0, path.length]), np.full(2, combine.speed))
    plan = stopped(driven, Stop(0, stands_at, 37.3), combine.acceleration)
    lane = lane_beside(path, 0.0, path.length, beside(combine, cart))
    timed = drive_beside(plan, lane, 6.1, 6.1 + stands_at / combine.speed + 20.0)
    assert timed.speeds.min() >= 0.0
    assert timed.speeds[-1] == 0.0


@pytest.mark.parametrize("side", [1, -1])
def test_a_cart_stays_beside_a_combine_along_a_polygon(side):
    """The combine turns by a little within a metre at each corner, to the right or to the left."""
    combine, cart = Combine(), Cart()
    angles = side * np.linspace(0.0, 2.0, 25)
    path = drive_line(200.0 * np.column_stack([np.cos(angles), np.sin(angles)]), cutting=True)
    assert np.abs(path.curvatures).max() > 1 / 20.0
    assert gentle_runs(path) == [(0.0, path.length)]
    times = np.array([0.0, path.length / combine.speed])
    plan = TimedPath(path, times, np.array([0.0, path.length]), np.full(2, combine.speed))
    place = beside(combine, cart)
    lane = lane_beside(path, 0.0, path.length, place)
    timed = drive_beside(plan, lane, 10.0, times[1] - 5.0)
    assert np.abs(np.diff(timed.speeds) / np.diff(timed.times)).max() < cart.acceleration / 2
    beside_it = CartMotion(timed, cart, 0.0)
    assert np.abs(beside_it.timed.path.curvatures).max() < 1 / cart.turning_radius
    moments = np.linspace(10.0, times[1] - 5.0, 300)
    tractor, trailer = beside_it.poses_at(moments)
    angles = np.remainder(tractor[:, 2] - trailer[:, 2] + np.pi, 2 * np.pi) - np.pi
    for pose, ahead, angle in zip(plan.pose_at(moments), tractor, angles, strict=True):
        state = np.array([*ahead, angle])
        assert is_alongside(pose, state, cart.length, cart.hitch_offset, place.left, False)


def test_gentle_runs_end_where_the_path_turns(hand_made):
    made = hand_made(160.0, 130.0, 1)
    path = made.plans[0].path
    runs = gentle_runs(path)
    inside = np.zeros(len(path.lengths), dtype=bool)
    for first, last in runs:
        headings = path.pose_at(np.linspace(first + 1e-6, last - 1e-6, 9))[:, 2]
        assert np.ptp(headings) < 1e-9
        middles = (path.stations[:-1] + path.stations[1:]) / 2
        inside |= (middles > first) & (middles < last)
    # All work is in them, and what they leave out bends, or is short.
    assert inside[path.cutting].all()
    left = path.lengths[~inside & (path.curvatures == 0.0)]
    assert left.max(initial=0.0) < SHORTEST
