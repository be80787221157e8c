"""Distances of boxes and closed moments, against Shapely and fine samples."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.carts.cart_motion import standing_motion
from sightfield.systems.numerics.harvest.carts.cart_plan import Stop
from sightfield.systems.numerics.harvest.carts.traffic import (
    blocked_along,
    cart_boxes,
    cart_traffic,
    combine_traffic,
    during,
    gap_between,
    joined,
    without,
)
from sightfield.systems.numerics.harvest.machines import Cart, combine_outline


def polygon(box, pose):
    rear, front, half = box
    corners = np.array([[rear, -half], [front, -half], [front, half], [rear, half]])
    c, s = np.cos(pose[2]), np.sin(pose[2])
    return shapely.Polygon(corners @ np.array([[c, s], [-s, c]]) + pose[:2])


def test_gaps_of_boxes_are_those_of_polygons():
    rng = np.random.default_rng(7)
    touching = 0
    for _ in range(500):
        boxes = [(-rng.uniform(0, 6), rng.uniform(0.2, 4), rng.uniform(0.3, 5)) for _ in range(2)]
        poses = rng.uniform([-8, -8, -4], [8, 8, 4], (2, 3))
        gap = gap_between(np.array(boxes[0]), poses[0], np.array(boxes[1]), poses[1])
        truth = polygon(boxes[0], poses[0]).distance(polygon(boxes[1], poses[1]))
        assert gap == pytest.approx(truth, abs=1e-9)
        touching += truth == 0
    assert 50 < touching < 450


def test_between_open_moments_nobody_is_too_near(hand_made):
    made = hand_made(120.0, 90.0, 2)
    cart = Cart(length=4.0)
    traffic = combine_traffic(made.combine, made.plans)
    boxes = cart_boxes(cart)
    rng = np.random.default_rng(2)
    first = rng.uniform([0, 0, -3], [120, 90, 3], (25, 3))
    second = first - np.stack(
        [4 * np.cos(first[:, 2]), 4 * np.sin(first[:, 2]), 0 * first[:, 2]], 1
    )
    begin, step, count = 50.0, 0.5, 800
    blocked = blocked_along(traffic, boxes, first, second, 0.7, begin, step, count)
    assert 0.0 < blocked.mean() < 0.3
    times = np.arange(begin, begin + (count - 1) * step, 0.1)
    parts = combine_outline(made.combine)
    others = []
    for plan in made.plans:
        poses = plan.pose_at(times)
        for part in parts:
            box = (part[:, 0].min(), part[:, 0].max(), part[:, 1].max())
            others.append(np.array([polygon(box, pose) for pose in poses]))
    early = 0
    for k in range(len(first)):
        near = np.min(
            [
                shapely.distance(polygon(box, pose), each)
                for box, pose in zip(boxes, (first[k], second[k]), strict=True)
                for each in others
            ],
            axis=0,
        )
        cell = np.floor((times - begin) / step + 1e-9).astype(int)
        open_all = ~blocked[k, cell] & ~blocked[k, np.minimum(cell + 1, count - 1)]
        assert (near[open_all] >= 0.7).all()
        early += (near[~open_all] > 3.0).sum()
    # What is closed is near indeed.
    assert early < 30


def test_a_machine_that_stands_closes_its_place_for_ever():
    cart = Cart()
    stands = standing_motion(cart, np.array([10.0, 5.0, 0.4]), 3.0)
    traffic = cart_traffic(cart, [[stands]], 4)
    here = np.array([[11.0, 6.0, 1.0], [60.0, 6.0, 1.0]])
    behind = here - np.array([2.0, 4.0, 0.0])
    blocked = blocked_along(traffic, cart_boxes(cart), here, behind, 0.5, 100.0, 1.0, 50)
    assert blocked[0].all()
    assert not blocked[1].any()
    both = joined(traffic, cart_traffic(cart, [[stands]], 5))
    assert without(both, 4).machine.tolist() == [5, 5]
    # Tractor and trailer of each, numbered on from the first.
    assert cart_traffic(cart, [[stands], [stands]], 4).machine.tolist() == [4, 4, 5, 5]


def test_traffic_that_changes_later_is_as_if_made_anew(hand_made, stopped):
    made = hand_made(120.0, 90.0, 2)
    before = combine_traffic(made.combine, made.plans)
    since = 83.3
    stopped = stopped(made.plans[1], Stop(1, float(made.plans[1].station_at(90.0)), 50.0), 0.5)
    plans = [made.plans[0], stopped]
    fresh, again = (
        combine_traffic(made.combine, plans),
        combine_traffic(made.combine, plans, before, since),
    )
    for name in ("poses", "middles", "sway"):
        assert np.abs(getattr(fresh, name) - getattr(again, name)).max() < 1e-9
    same = during(before, 0.0, stopped.end).poses
    assert np.abs(fresh.poses[:, : same.shape[1]] - same[:, : fresh.poses.shape[1]]).max() > 1.0
    # The middle of each box is where its corners say.
    corners = combine_outline(made.combine).body
    c, s = np.cos(fresh.poses[1, 400, 2]), np.sin(fresh.poses[1, 400, 2])
    middle = corners.mean(axis=0) @ np.array([[c, s], [-s, c]]) + fresh.poses[1, 400, :2]
    assert fresh.middles[1, 400] == pytest.approx(middle)
