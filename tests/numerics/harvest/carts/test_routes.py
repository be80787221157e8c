"""Routes of a cart: from a truck to a combine, beside it, and back; audited by outlines."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.carts.cart_motion import (
    CartMotion,
    Moving,
    join_motions,
    standing_motion,
)
from sightfield.systems.numerics.harvest.carts.cut_times import cut_times, free_cells, opened
from sightfield.systems.numerics.harvest.carts.roadmap import make_roadmap
from sightfield.systems.numerics.harvest.carts.routes import Standing, make_planner
from sightfield.systems.numerics.harvest.carts.surroundings import field_lines
from sightfield.systems.numerics.harvest.carts.traffic import cart_traffic, combine_traffic
from sightfield.systems.numerics.harvest.carts.windows import beside, drive_beside, find_windows
from sightfield.systems.numerics.harvest.machines import Cart, cart_outline, combine_outline
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath

TRUCK = np.array([100.0, -14.0, 0.3])


def placed(place, pose):
    """The pose of a tractor beside a combine that drives straight."""
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return pose + np.array([c * place.ahead - s * place.left, s * place.ahead + c * place.left, 0])


@pytest.mark.parametrize("hitch", [0.0, 0.7])
def test_a_cart_drives_from_its_truck_to_every_window_and_back(hand_made, audit, hitch):
    # Room for a cart with an offset hitch to turn at the corners.
    made = hand_made(180.0, 150.0, 1, margin=28.0)
    cart = Cart(hitch_offset=hitch)
    cut = cut_times(made.field, made.combine, made.plans)
    ground = opened(free_cells(made.field, cut), cut)
    combines = combine_traffic(made.combine, made.plans)
    roadmap = make_roadmap(ground, cart, field_lines(made.field, made.combine, made.swaths))
    planner = make_planner(ground, cart, roadmap, combines, TRUCK[None])
    windows = find_windows([made.combine] * len(made.plans), cart, made.plans, ground, combines)
    place, alone = beside(made.combine, cart), cart_traffic(cart, [], 1)
    motions = [standing_motion(cart, TRUCK, 0.0)]
    served = 0
    for window in windows:
        plan = made.plans[window.combine]
        begin, end = window.begin + 12.0, window.end - 5.0
        if begin < motions[-1].timed.end + 40.0:
            continue
        stands = Standing(motions[-1].last_pose, motions[-1].last_angle, motions[-1].timed.end)
        goal = placed(place, plan.pose_at(begin))
        to = planner.route_to(stands, goal, Moving(begin, float(plan.speed_at(begin))), alone)
        if to is None:
            continue
        assert to.timed.end == pytest.approx(begin)
        timed = drive_beside(plan, window.lane, begin, end)
        along = CartMotion(timed, cart, to.last_angle)
        speed = float(plan.speed_at(end))
        truck = TRUCK if served % 2 == 0 else None
        off = planner.route_from(
            along.last_pose, along.last_angle, Moving(end, speed), alone, truck
        )
        assert off is not None
        motions += [to, along, off]
        served += 1
        # The auger pours into the middle of the box all along.
        times = np.linspace(begin, end, 50)
        poses = plan.pose_at(times)
        _, trailer = along.poses_at(times)
        middle = trailer[:, :2] + 0.15 * cart.length * np.stack(
            [np.cos(trailer[:, 2]), np.sin(trailer[:, 2])], axis=1
        )
        away = middle - poses[:, :2]
        c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
        reach = made.combine.header_width / 2 + made.combine.cart_gap + cart.width / 2
        assert np.abs(c * away[:, 0] + s * away[:, 1]).max() < 0.5
        assert np.abs(c * away[:, 1] - s * away[:, 0] - reach).max() < 0.5
    assert served >= 6
    found = audit(made.field, made.combine, cart, made.plans, [join_motions(motions)])
    assert found.combine_gap >= 0.5
    assert found.crop < 0.05
    assert found.outside == 0.0
    assert found.along <= cart.acceleration + 1e-6
    assert found.across <= cart.lateral_acceleration + 1e-6
    assert found.curvature <= 1 / cart.turning_radius + 1e-9


def test_no_way_out_leads_past_a_combine_that_has_parked(hand_made, outlines_at):
    """A cart drove between two combines that parked there, and had to stay."""
    made = hand_made(180.0, 150.0, 1, margin=28.0)
    cart, plan = Cart(), made.plans[0]
    cut = cut_times(made.field, made.combine, made.plans)
    ground = opened(free_cells(made.field, cut), cut)
    roadmap = make_roadmap(ground, cart, field_lines(made.field, made.combine, made.swaths))
    nodes, edges = roadmap.nodes, roadmap.edges
    parked = combine_traffic(made.combine, made.plans)
    planner = make_planner(ground, cart, roadmap, parked, TRUCK[None])
    # By outlines, at samples of the edges; what passes by on half a metre may be left out.
    own = outlines_at(np.array(combine_outline(made.combine)), plan.pose_at([plan.end]))[0]
    parts = [np.array(part)[None] for part in cart_outline(cart)]
    tractor = outlines_at(parts[0], edges.tractor)[:, 0]
    trailer = outlines_at(parts[1], edges.trailer)[:, 0]
    gaps = np.min([shapely.distance(box, each) for box in own for each in (tractor, trailer)], 0)
    gaps = np.minimum.reduceat(gaps, edges.first[:-1])
    assert np.count_nonzero(gaps == 0.0) > 10

    def with_way_out(usable):
        known = np.zeros(len(nodes), dtype=bool)
        known[planner.exits] = True
        for _ in range(len(nodes)):
            reached = known.copy()
            reached[edges.source[usable & known[edges.target]]] = True
            if (reached == known).all():
                break
            known = reached
        return known

    opened_once = edges.opens < np.inf
    found = planner.ways_out < np.inf
    assert (found <= with_way_out(opened_once & (gaps > 0.5))).all()
    assert (found >= with_way_out(opened_once & (gaps > 1.5))).all()
    assert 0 < found.sum() < with_way_out(opened_once).sum()


def test_the_audit_sees_a_cart_that_drives_where_it_likes(hand_made, audit):
    made = hand_made(120.0, 90.0, 1)
    poses = np.array([[-40.0, 45.0, 0.0], [110.0, 45.0, 0.0]])
    one = np.ones(1, dtype=int)
    path = MachinePath(poses, one, one < 0, -one)
    quick = TimedPath(path, np.array([0.0, 25.0]), np.array([0.0, 150.0]), np.array([6.0, 6.0]))
    plan = made.plans[0]
    meets = CartMotion(
        TimedPath(plan.path, plan.times + 30.0, plan.stations, plan.speeds), Cart(), 0.1
    )
    found = audit(made.field, made.combine, Cart(), made.plans, [CartMotion(quick, Cart()), meets])
    assert found.crop > 8.0
    assert found.outside > 1.0
    assert found.combine_gap == 0.0
    assert found.along == pytest.approx(0.5, rel=0.1)
    assert found.curvature == pytest.approx(1 / made.combine.turning_radius)
