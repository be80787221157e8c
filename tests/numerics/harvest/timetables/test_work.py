"""What a combine cuts when, and where a cart can be filled."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines.alongside import box_middle, is_alongside
from sightfield.systems.numerics.harvest.machines.cart import Cart
from sightfield.systems.numerics.harvest.routes.lane import lanes_beside
from sightfield.systems.numerics.harvest.timetables.work import beside, work_of

HEADER, REACH, DENSITY, SPEED = 10.0, 7.75, 0.5, 1.5


@pytest.fixture(scope="module")
def coverage():
    return plan_coverage(Field.rectangle(120.0, 90.0), HEADER, 6.0, 2)


@pytest.fixture(scope="module")
def lanes(coverage):
    room = coverage.field.ground.buffer(-2.5)
    return [lanes_beside(path, room, HEADER, REACH, 5.0) for path in coverage.paths]


def test_all_grain_is_cut_when_the_plan_says(coverage, lanes):
    for n, path in enumerate(coverage.paths):
        work = work_of(path, n, coverage.timeline, lanes[n], REACH, DENSITY, SPEED)
        assert work.grain[-1] == pytest.approx(DENSITY * path.cut_area.sum())
        assert (np.diff(work.grain) >= 0).all()
        assert work.grain[len(work.grain) // 2] < 0.9 * work.grain[-1]
        assert work.grain[work.done] == pytest.approx(work.grain[-1])


def test_a_cart_is_reached_on_straights_and_not_where_the_combine_backs_up(coverage, lanes):
    path = coverage.paths[0]
    work = work_of(path, 0, coverage.timeline, lanes[0], REACH, DENSITY, SPEED)
    times = work.step * (np.arange(len(work.reachable)) + 0.5)
    stations = coverage.timeline.station_at(0, times * SPEED)
    moving = np.diff(coverage.timeline.station_at(0, SPEED * np.append(times, times[-1] + 1))) > 0.5
    back = path.gear_at(stations) < 0
    assert not work.reachable[back & moving].any()
    assert 0.3 < work.reachable[times < work.step * work.done].mean() < 1.0


def test_a_trailer_at_a_place_that_counts_is_alongside(coverage, lanes):
    """The auger's own test, for a cart that stands straight on the lane."""
    cart = Cart()
    path, lane = coverage.paths[0], lanes[0][0]
    stations = np.linspace(lane.begin, lane.end, 200)
    sure = beside(path, lane, REACH, stations)
    assert sure.any()
    lead = cart.length * 0.85 + cart.hitch_offset
    for station in stations[sure]:
        x, y, theta = lane.pose_at(lane.slot_at(station))[:3]
        state = np.array([x + lead * np.cos(theta), y + lead * np.sin(theta), theta, 0.0])
        middle = box_middle(state, cart.length, cart.hitch_offset)
        assert middle[:2] == pytest.approx((x, y))
        pose = path.pose_at(station)
        assert is_alongside(pose, state, cart.length, cart.hitch_offset, REACH, False)
