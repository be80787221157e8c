"""Nobody overtakes, nobody waits for each other, and the left stays open."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.pace.holds import Holds, station_limits
from sightfield.systems.numerics.harvest.field.pace.timeline import run_timeline
from sightfield.systems.numerics.harvest.field.pace.waiting import least_delays

HEADER = 9.0


@pytest.fixture(scope="module")
def plan():
    """Three combines on a field with a bent edge."""
    corners = [(0, 0), (220, 0), (220, 120), (120, 170), (0, 150)]
    return plan_coverage(Field(make_world(corners)), HEADER, 7.0, 3)


def drive(plan, speeds):
    """Progress of combines that drive at speeds of their own, step by step, (k, N) [m]."""
    ends = np.array([path.length for path in plan.paths])
    now = np.zeros(len(ends))
    rows = [now]
    while (now < ends).any():
        wanted = np.minimum(now + speeds(len(rows)), ends)
        now = np.maximum(now, np.minimum(wanted, plan.station_limits(now)))
        rows.append(now)
        assert len(rows) < 50_000, "somebody is stuck"
    return np.array(rows)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_combines_that_stop_at_random_finish_and_keep_the_left_open(plan, seed):
    rng = np.random.default_rng(seed)
    progress = drive(plan, lambda step: 2.0 * (rng.random(3) < rng.uniform(0.2, 1.0, 3)))
    closed, looked = 0, 0
    for now in progress[::7]:
        standing = plan.cells.standing(now)
        for n, path in enumerate(plan.paths):
            if path.loop_at(now[n]) < 0 or path.gear_at(now[n]) < 0 or now[n] >= path.length:
                continue
            looked += 1
            row, column, on = plan.cells.cell_of(path.alongside(HEADER, now[n])[:2])
            by = plan.cells.cut_by[row, column]
            # Crop of a later row may be on the left of a combine that cuts on into a corner.
            if by >= 0 and by != n:
                turn = plan.paths[by].turn_at(plan.cells.cut_at[row, column])
                closed += int(on and standing[row, column] and turn < path.turn_at(now[n]))
    # Holds are given for places a quarter of a header apart.
    assert closed <= 0.002 * looked


def test_followers_start_when_there_is_room(plan):
    for n, rows in enumerate(plan.gaps):
        if n > 0:
            assert rows[:, 1].min() > 0


def test_the_timeline_ends_when_all_have_arrived(plan):
    ends = [path.length for path in plan.paths]
    np.testing.assert_allclose(plan.timeline.progress[-1], ends)
    speeds = np.diff(plan.timeline.progress, axis=0) / np.diff(plan.timeline.clock)[:, None]
    assert speeds.min() >= 0
    assert speeds.max() <= 1 + 1e-9


def test_a_follower_waits_for_its_leader_to_pass():
    """By hand: the leader starts at 0, and at 50 m the follower needs it at 80 m."""
    hold = Holds(1, 0, True, np.array([50.0]), np.array([70.0]), np.array([80.0]))
    assert station_limits([hold], np.array([79.0, 0.0])).tolist() == [np.inf, 50.0]
    assert station_limits([hold], np.array([80.0, 0.0])).tolist() == [np.inf, np.inf]
    timeline = run_timeline([100.0, 100.0], np.zeros(2), [hold], 1.0)
    assert timeline.clock[-1] == pytest.approx(130.0, abs=1.0)
    assert timeline.waits.tolist() == pytest.approx([0.0, 30.0], abs=1.0)
    assert timeline.clock_at(1, np.array([50.0]))[0] == pytest.approx(80.0, abs=1.0)
    assert timeline.stops(1).tolist() == [50.0]


def test_a_follower_that_starts_late_does_not_wait():
    hold = Holds(1, 0, True, np.array([50.0]), np.array([70.0]), np.array([80.0]))
    timeline = run_timeline([100.0, 100.0], np.array([0.0, 30.0]), [hold], 1.0)
    assert timeline.waits.tolist() == [0.0, 0.0]


def test_delays_give_what_followers_need_up_to_a_bound():
    """The leader is to be at 80 m when the follower is at 50 m, and at 95 m when it is at 60 m."""
    stations, needs = np.array([50.0, 60.0]), np.array([80.0, 95.0])
    hold = Holds(1, 0, True, stations, needs - 10.0, needs)
    assert least_delays([hold], 2, 100.0).tolist() == [0.0, 35.0]
    assert least_delays([hold], 2, 20.0).tolist() == [0.0, 20.0]


def test_a_timeline_is_what_a_plain_simulation_gives(plan):
    """Looking through every row of every hold in every step."""
    step = HEADER / 4
    ends = np.array([path.length for path in plan.paths])
    delays = np.array([path.start_delay for path in plan.paths])
    timeline = run_timeline(ends, delays, plan.holds, step)
    now, clock = np.zeros(len(ends)), 0.0
    for progress in timeline.progress:
        assert progress == pytest.approx(now)
        limits = ends.copy()
        for hold in plan.holds:
            blocked = hold.stations[hold.needs > now[hold.other] + 1e-9]
            limits[hold.waiting] = min(limits[hold.waiting], blocked.min(initial=np.inf))
        able = np.clip(clock + step - delays, 0.0, step)
        now = np.maximum(now, np.minimum(now + able, limits))
        clock += step
    assert (timeline.progress[-1] == ends).all()
