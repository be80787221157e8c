"""Combines on a rectangle, planned by hand: rounds of headland first, then swaths in two lands."""

from typing import NamedTuple

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.carts.cart_plan import Supply, ended
from sightfield.systems.numerics.harvest.carts.visits import serve_combines
from sightfield.systems.numerics.harvest.execution.planned_work import PlannedWork
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import (
    Cart,
    Combine,
    cart_outline,
    combine_outline,
)
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath
from sightfield.systems.numerics.planning.car_paths import dubins_paths

WIDE = 9.0


class HandMade(NamedTuple):
    """A field, its combines, when they are where, and the lines of swaths.

    Stops delay the combine that stops, and no other.
    """

    field: Field
    combine: Combine
    plans: list[TimedPath]
    swaths: list[np.ndarray]

    def retime(self, stops):
        """When combines are where that stop."""
        after = list(self.plans)
        for stop in sorted(stops, key=lambda each: each.station):
            after[stop.combine] = with_stop(after[stop.combine], stop, self.combine.acceleration)
        return [ended(plan) for plan in after]


def with_stop(plan, stop, acceleration):
    """A plan that stands for a while at a station, and is later from then on.

    It brakes and speeds up evenly; other machines are not looked at.
    """
    fine = np.unique(np.concatenate([plan.times, np.arange(plan.times[0], plan.end, 0.05)]))
    at, speeds = plan.station_at(fine), plan.speed_at(fine)
    # Braking begins where the speed is the most that can still be lost, and likewise after it.
    allowed = np.sqrt(2 * acceleration * np.abs(at - stop.station))
    slow = np.flatnonzero(speeds > allowed)
    if len(slow) == 0:
        first, last = int(np.searchsorted(at, stop.station)), int(np.searchsorted(at, stop.station))
    else:
        first, last = int(slow[0]) - 1, int(slow[-1]) + 1
    first, last = max(first, 0), min(last, len(fine) - 1)
    way_in, way_out = stop.station - at[first], at[last] - stop.station
    time_in = 2 * way_in / speeds[first] if speeds[first] > 0 else 0.0
    time_out = 2 * way_out / speeds[last] if speeds[last] > 0 else 0.0
    stands = fine[first] + time_in
    goes = stands + stop.duration
    later = goes + time_out - fine[last]
    before, after = plan.times < fine[first], plan.times > fine[last]
    return TimedPath(
        plan.path,
        np.concatenate(
            [
                plan.times[before],
                [fine[first], stands, goes, fine[last] + later],
                plan.times[after] + later,
            ]
        ),
        np.concatenate(
            [
                plan.stations[before],
                [at[first], stop.station, stop.station, at[last]],
                plan.stations[after],
            ]
        ),
        np.concatenate(
            [plan.speeds[before], [speeds[first], 0.0, 0.0, speeds[last]], plan.speeds[after]]
        ),
    )


def joined_lines(lines, radius):
    """Straight lines, each given by two points, cut one after the other, with Dubins turns."""
    poses, cutting, work = [], [], []
    for number, line in enumerate(lines):
        begin, end = (np.array(point, dtype=float) for point in line)
        course = np.arctan2(*(end - begin)[::-1])
        if poses:
            turn = dubins_paths(tuple(poses[-1]), (*begin, course), radius)[0]
            for way in np.cumsum(np.abs(turn.lengths)):
                pose = turn.poses([way])[0]
                if np.hypot(*(pose - poses[-1])[:2]) > 1e-9:
                    poses.append(pose)
                    cutting.append(False)
                    work.append(-1)
            course = poses[-1][2]
        else:
            poses.append(np.array([*begin, course]))
        poses.append(np.array([*end, course]))
        cutting.append(True)
        work.append(number)
    gears = np.ones(len(cutting), dtype=int)
    return MachinePath(np.array(poses), gears, np.array(cutting), np.array(work))


def at_speed(path, begin, combine):
    """From standing to standing at the given acceleration, cruising between."""
    v, a = combine.speed, combine.acceleration
    ramp = v**2 / (2 * a)
    cruise = (path.length - 2 * ramp) / v
    times = begin + np.array([0.0, v / a, v / a + cruise, 2 * v / a + cruise])
    stations = np.array([0.0, ramp, path.length - ramp, path.length])
    return TimedPath(path, times, stations, np.array([0.0, v, v, 0.0]))


def round_lines(width, height, inset):
    """Clockwise, from the upper left corner: each edge is driven on until the field ends."""
    low, right, top = inset, width - inset, height - inset
    return [
        ((0.0, top), (width, top)),
        ((right, height), (right, 0.0)),
        ((width, low), (0.0, low)),
        ((low, 0.0), (low, height)),
    ]


def make_hand_made(width, height, combines, margin=22.0, acceleration=0.5):
    """One or two combines: each its rounds of headland, then half of the swaths."""
    combine = Combine(header_width=WIDE, acceleration=acceleration)
    field = Field.rectangle(width, height, margin=margin)
    head = 2 * WIDE
    columns = np.arange(head + WIDE / 2, width - head, WIDE)
    lands = np.array_split(columns, combines)
    swaths = [np.array([[x, head], [x, height - head]]) for x in columns]
    plans = []
    for number, land in enumerate(lands):
        lines = round_lines(width, height, WIDE / 2 + number * WIDE)
        if combines == 1:
            lines += round_lines(width, height, 1.5 * WIDE)
        for k, x in enumerate(land):
            ends = (head - 1.0, height - head + 1.0)
            low, high = ends if k % 2 == 0 else ends[::-1]
            lines.append(((x, low), (x, high)))
        path = joined_lines(lines, combine.turning_radius)
        plans.append(at_speed(path, 5.0 + 60.0 * number, combine))
    return HandMade(field, combine, plans, swaths)


def make_served():
    """A plan of one combine on a rectangle, by hand, and of a cart that serves it."""
    made = make_hand_made(126.0, 100.0, 1)
    cart = Cart(capacity=20000.0, hitch_offset=0.6)
    supply = Supply(density=1.6, trucks=np.array([[60.0, -13.0, 0.1]]))
    combines = [made.combine] * len(made.plans)
    plan = serve_combines(made.field, combines, cart, made.plans, made.swaths, supply, made.retime)
    return PlannedWork(
        field=made.field,
        combines=combines,
        cart=cart,
        supply=supply,
        plans=plan.plans,
        motions=plan.motions,
        visits=plan.visits,
        trips=plan.trips,
    )


@pytest.fixture(scope="session")
def hand_made():
    """Makes them: width and height of the field [m], number of combines."""
    return make_hand_made


@pytest.fixture(scope="session")
def stopped():
    """A plan with a stop, and the acceleration with which it brakes."""
    return with_stop


def placed(outlines, poses):
    """Convex outlines, each at each pose, by hand: (parts, 4, 2) and (n, 3) -> (n, parts)."""
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    turn = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
    corners = np.einsum("nij,pkj->npki", turn, outlines) + poses[:, None, None, :2]
    return shapely.polygons(corners)


def trailer_by_integration(motion, times):
    """Poses of the trailer's axle, from the velocity of the hitch: it cannot move sideways.

    Small steps along the tractor's way; shape (n, 3).
    """
    cart, path = motion.cart, motion.timed.path
    at = path.stations_every(0.01)
    poses = path.pose_at(at)
    hitch = poses[:, :2] - cart.hitch_offset * np.stack(
        [np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1
    )
    headings = np.empty(len(at))
    heading = poses[0, 2] - motion.beta
    headings[0] = heading
    for k in range(len(at) - 1):
        step = hitch[k + 1] - hitch[k]
        middle = heading
        for _ in range(2):
            across = np.cos(middle) * step[1] - np.sin(middle) * step[0]
            middle = heading + across / cart.length / 2
        heading += across / cart.length
        headings[k + 1] = heading
    stations = motion.timed.station_at(times)
    along = np.interp(stations, at, headings)
    x, y = (np.interp(stations, at, column) for column in hitch.T)
    return np.stack(
        [x - cart.length * np.cos(along), y - cart.length * np.sin(along), along], axis=1
    )


class Audit(NamedTuple):
    """What is found by hand about carts among combines.

    Attributes:
        combine_gap, cart_gap: Least distance of outlines of a cart to a combine, of two carts [m].
        crop: Largest area of crop under any cart at any time [m^2].
        outside: Farthest that a cart gets beyond the margin or into an obstacle [m].
        along, across: Largest accelerations [m/s^2].
        curvature: Largest [1/m].
    """

    combine_gap: float
    cart_gap: float
    crop: float
    outside: float
    along: float
    across: float
    curvature: float


def audit_carts(field, combine, cart, plans, motions, spacing=0.25):
    """Outlines as polygons, finely sampled in time."""
    end = max(motion.timed.end for motion in motions) + 1.0
    times = np.arange(0.0, end, spacing)
    harvesters = [placed(np.array(combine_outline(combine)), plan.pose_at(times)) for plan in plans]
    outlines = []
    for motion in motions:
        tractor, trailer = np.array(cart_outline(cart))
        boxes = np.concatenate(
            [
                placed(tractor[None], motion.timed.pose_at(times)),
                placed(trailer[None], trailer_by_integration(motion, times)),
            ],
            axis=1,
        )
        outlines.append(boxes)
    near = min(
        shapely.distance(own[:, :, None], other[:, None, :]).min()
        for own in outlines
        for other in harvesters
    )
    apart = np.inf
    for k, own in enumerate(outlines):
        for other in outlines[:k]:
            apart = min(apart, shapely.distance(own[:, :, None], other[:, None, :]).min())
    # Standing crop at a time: the field without the strips of headers until then.
    strips, cut = [], []
    for plan in plans:
        fine = np.arange(0.0, plan.end + 1.0, 1.0)
        headers = placed(np.array(combine_outline(combine))[:1], plan.pose_at(fine))[:, 0]
        down = plan.path.cutting[plan.path.piece_at(plan.station_at(fine))]
        hulls = shapely.convex_hull(
            shapely.multipolygons(np.stack([headers[:-1], headers[1:]], axis=1))
        )
        strips.append(hulls[down[:-1] & down[1:]])
        cut.append(fine[1:][down[:-1] & down[1:]])
    strips, cut = np.concatenate(strips), np.concatenate(cut)
    tree = shapely.STRtree(strips)
    crop, outside = 0.0, 0.0
    beyond = shapely.box(*field.ground.buffer(99.0).bounds).difference(
        field.outline.buffer(field.margin, quad_segs=32)
    )
    wrong = shapely.union_all([beyond, *field.obstacles])
    shapely.prepare(wrong)
    for motion, boxes in zip(motions, outlines, strict=True):
        moving = np.flatnonzero(motion.timed.speed_at(times) > 0)[::4]
        for k in moving:
            for box in boxes[k]:
                number = tree.query(box, predicate="intersects")
                known = number[cut[number] <= times[k]]
                under = box.intersection(field.polygon)
                if not under.is_empty:
                    standing = under.difference(shapely.union_all(strips[known]))
                    # What no header ever covers, narrower than half a metre, is no crop to mind.
                    crop = max(crop, standing.buffer(-0.25).buffer(0.25).area)
                if wrong.intersects(box):
                    outside = max(outside, box.intersection(wrong).area)
    along = across = bent = 0.0
    for motion in motions:
        timed = motion.timed
        lasting = np.diff(timed.times)
        rates = np.diff(timed.speeds)[lasting > 1e-9] / lasting[lasting > 1e-9]
        along = max(along, np.abs(rates).max(initial=0.0))
        # Stations, speeds and times belong together.
        ways = np.diff(timed.stations) - (timed.speeds[:-1] + timed.speeds[1:]) / 2 * lasting
        assert np.abs(ways).max(initial=0.0) < 1e-6
        at = timed.station_at(times)
        curvature = np.abs(timed.path.curvatures)[timed.path.piece_at(at)]
        bent = max(bent, curvature.max())
        across = max(across, (timed.speed_at(times) ** 2 * curvature).max())
    return Audit(near, apart, crop, outside, along, across, bent)


@pytest.fixture(scope="session")
def audit():
    """Audits carts among combines."""
    return audit_carts


@pytest.fixture(scope="session")
def integrated():
    """Poses of a trailer behind its tractor by small steps of the hitch."""
    return trailer_by_integration


@pytest.fixture(scope="session")
def outlines_at():
    """Polygons of outlines at poses."""
    return placed
