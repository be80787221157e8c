"""When the ground is cut, against strips of headers as polygons."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.carts.cart_plan import Stop
from sightfield.systems.numerics.harvest.carts.cut_times import (
    CELL,
    cut_times,
    free_cells,
    opened,
    opens_along,
)
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine, combine_outline
from sightfield.systems.numerics.harvest.paths import TimedPath


def middles(cut):
    rows, columns = np.indices(cut.times.shape)
    return cut.corner + CELL * (np.stack([columns, rows], axis=-1) + 0.5)


def test_cells_are_cut_when_the_first_header_is_over_them(hand_made):
    made = hand_made(120.0, 90.0, 2)
    cut = cut_times(made.field, made.combine, made.plans)
    points = middles(cut)
    rng = np.random.default_rng(4)
    chosen = rng.integers([0, 0], cut.times.shape, (400, 2))
    header = combine_outline(made.combine).header
    corners = np.vstack([header, header[:1]])
    strips, times, who = [], [], []
    for number, plan in enumerate(made.plans):
        at = np.arange(0.0, plan.end + 1.0, 0.5)
        poses = plan.pose_at(at)
        c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        x = poses[:, :1] + c * corners[:, 0] - s * corners[:, 1]
        y = poses[:, 1:2] + s * corners[:, 0] + c * corners[:, 1]
        down = plan.path.cutting[plan.path.piece_at(plan.station_at(at))]
        for k in np.flatnonzero(down[1:] & down[:-1]):
            both = np.concatenate([np.stack([x[k], y[k]], 1), np.stack([x[k + 1], y[k + 1]], 1)])
            strips.append(shapely.MultiPoint(both).convex_hull)
            times.append(at[k + 1])
            who.append(number)
    tree, times, who = shapely.STRtree(strips), np.array(times), np.array(who)
    grown = 0
    for row, column in chosen:
        point = shapely.Point(points[row, column])
        if not made.field.polygon.contains(point):
            assert cut.times[row, column] == -np.inf
            continue
        over = tree.query(point, predicate="intersects")
        if len(over) == 0:
            # A sliver takes the time of what is beside it.
            grown += 1
            continue
        first = over[np.argmin(times[over])]
        assert cut.times[row, column] == pytest.approx(times[first], abs=1.0)
        assert cut.cutter[row, column] == who[first]
    assert grown < 8


def test_crop_that_nobody_cuts_stays(hand_made):
    made = hand_made(120.0, 90.0, 1)
    plan = made.plans[0]
    half = TimedPath(plan.path, plan.times[:2], plan.stations[:2], plan.speeds[:2])
    cut = cut_times(made.field, made.combine, [half])
    header = made.combine.header_width * (half.stations[-1] + made.combine.header_depth / 2)
    finite = np.isfinite(cut.times).sum() * CELL**2
    assert finite == pytest.approx(header, rel=0.2)
    assert (cut.times == np.inf).sum() * CELL**2 == pytest.approx(120 * 90 - finite, rel=0.01)


def test_what_is_later_is_marked_anew_and_nothing_else(hand_made, stopped):
    made = hand_made(120.0, 90.0, 2)
    before = cut_times(made.field, made.combine, made.plans)
    stop = Stop(1, float(made.plans[1].station_at(150.0)), 40.0)
    plans = [made.plans[0], stopped(made.plans[1], stop, 0.5)]
    since = 140.0
    fresh = cut_times(made.field, made.combine, plans)
    again = cut_times(made.field, made.combine, plans, before, since)
    assert (again.times == fresh.times).all()
    assert (again.cutter == fresh.cutter).all()
    assert (again.times != before.times).mean() > 0.02
    assert (again.times[before.times <= since] == before.times[before.times <= since]).all()


def test_an_open_box_touches_no_obstacle_and_stays_on_the_ground():
    pond = [(30.0, 20.0), (41.0, 24.0), (37.0, 35.0)]
    world = make_world([(0, 0), (70, 5), (60, 60), (-3, 50)], [pond])
    field = Field(world, 8.0)
    cut = cut_times(field, Combine(), [])
    cut = cut._replace(times=np.full(cut.times.shape, -np.inf))
    ground = opened(free_cells(field, cut), cut)
    rng = np.random.default_rng(1)
    poses = rng.uniform([-15, -10, -3], [85, 75, 3], (3000, 3))
    box = np.array([-0.7, 2.6, 1.3])
    opens = opens_along(ground, box, poses)
    corners = np.array([[-0.7, -1.3], [2.6, -1.3], [2.6, 1.3], [-0.7, 1.3]])
    c, s = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    x = poses[:, :1] + c * corners[:, 0] - s * corners[:, 1]
    y = poses[:, 1:2] + s * corners[:, 0] + c * corners[:, 1]
    shapes = shapely.polygons(np.stack([x, y], axis=-1))
    inside = shapely.contains_properly(field.ground, shapes)
    inside &= shapely.distance(shapes, field.obstacles[0]) > 0.5
    free = opens == -np.inf
    assert not (free & ~inside).any()
    # Nor is much given away: what is a metre off is open.
    roomy = shapely.contains_properly(field.ground.buffer(-1.6), shapes)
    assert (free[roomy]).all()
    assert roomy.sum() > 500
