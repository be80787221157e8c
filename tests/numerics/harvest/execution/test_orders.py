"""What machines need of one another: never more than the plan has done by then."""

from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.carts.traffic import cart_boxes
from sightfield.systems.numerics.harvest.execution.advance import Disturbance, advance, pace_of
from sightfield.systems.numerics.harvest.execution.orders import (
    PASSED,
    _more,
    entering_times,
    find_orders,
    hold_by,
)
from sightfield.systems.numerics.harvest.execution.planned_work import PIECE, grain_stations
from sightfield.systems.numerics.harvest.execution.unloading import Loads, tie_hold
from sightfield.systems.numerics.harvest.paths import MachinePath


def entered_and_ends(work):
    """When each machine enters its cells, and where these end."""
    entered = [entering_times(t, s) for t, s in zip(work.timed, work.sweeps, strict=True)]
    return entered, [sweep.stations[1:] for sweep in work.sweeps]


def check_that_one_can_go_on(work, rng, states=200):
    """From anywhere, the machine whose next cell the plan enters first may enter it."""
    orders = find_orders(work)
    entered, ends = entered_and_ends(work)
    count = len(ends)
    for _ in range(states):
        clock = rng.uniform(0, work.end)
        on = np.array(
            [
                np.searchsorted(times, clock + rng.uniform(-300, 300), side="right") - 1
                for times in entered
            ]
        )
        on = np.clip(on, 0, [len(each) - 1 for each in ends])
        stations = np.array([each[k] for each, k in zip(ends, on, strict=True)])
        coming = [
            times[k + 1] if k + 1 < len(times) else np.inf
            for times, k in zip(entered, on, strict=True)
        ]
        m = int(np.argmin(coming))
        if coming[m] == np.inf:
            continue
        for n in range(count):
            if n != m:
                assert hold_by(orders, m, n, stations[n]) >= ends[m][on[m] + 1] - PASSED


@pytest.mark.parametrize("kind", range(4))
def test_of_combines_anywhere_one_can_go_on(combines_only, kind):
    rng = np.random.default_rng([5, kind])
    check_that_one_can_go_on(combines_only(kind, rng, 3), rng)


def test_of_a_cart_and_combines_anywhere_one_can_go_on(served):
    check_that_one_can_go_on(served, np.random.default_rng(0))


def test_a_cart_waits_for_the_ground_under_it_to_be_cut(served):
    # By hand: middles of cells of the raster under its boxes, for what the combine has passed.
    orders = find_orders(served)
    motion, cut = served.motions[0], served.cut
    times = np.linspace(0.0, motion.timed.end, 60)
    poses = motion.poses_at(times)
    stations = motion.timed.station_at(times)
    looked = 0
    for k in range(len(times)):
        needed = -np.inf
        for box, (x, y, theta) in zip(cart_boxes(served.cart), (p[k] for p in poses), strict=True):
            ahead, aside = np.meshgrid(
                np.linspace(box[0], box[1], 12), np.linspace(-box[2], box[2], 6)
            )
            px = x + np.cos(theta) * ahead - np.sin(theta) * aside
            py = y + np.sin(theta) * ahead + np.cos(theta) * aside
            column = ((px - cut.corner[0]) / 0.5).astype(int)
            row = ((py - cut.corner[1]) / 0.5).astype(int)
            needed = max(needed, served.cutting_stations[row, column].max())
        if needed > 5.0:
            looked += 1
            assert hold_by(orders, 1, 0, needed - 3.0) <= stations[k] + 0.6
    assert looked > 5


def test_a_tie_has_the_stations_of_both_and_counts_the_grain(served):
    ties = find_orders(served).ties
    assert len(ties.machines) == len(served.visits)
    total = 0.0
    for visit, begin, given in zip(served.visits, ties.begins, ties.given, strict=True):
        plan, motion = served.plans[visit.combine], served.motions[visit.cart]
        assert begin == pytest.approx(
            [plan.station_at(visit.begin), motion.timed.station_at(visit.begin)]
        )
        total += visit.taken
        assert given == pytest.approx(total) or given == np.inf
    assert ties.last.sum() == 1
    assert ties.last[-1]
    # The last one takes all that there is.
    assert np.isfinite(ties.given[:-1]).all()
    assert ties.given[-1] == np.inf


def test_who_is_left_alone_after_a_visit_may_go_though_the_tank_fills_again(crew_of, served):
    crew = crew_of(served)
    ties, (visit, *_) = crew.orders.ties, served.visits
    combine = served.plans[visit.combine]
    stations = np.array([ties.ends[0, 0] + 8.0, ties.ends[0, 1]])
    # Some kilograms less have flown than planned, and there are as many in the tank again.
    loads = Loads(
        np.array([500.0]),
        np.array([ties.given[0] - 400.0]),
        np.zeros(1),
        np.array([10000.0]),
        np.array([9000.0]),
    )
    late = float(combine.times[-1])
    pace = pace_of(Disturbance(slowness=1e-3))

    def drive():
        reached, _ = advance(
            crew.fleet, crew.orders, pace, loads, stations, np.zeros(2), late, 0.25
        )
        return reached

    assert drive()[1] > stations[1]
    # While the combine is still there the cart waits for the grain.
    stations[0] = ties.ends[0, 0]
    assert drive()[1] == stations[1]


def test_a_combine_does_not_leave_a_cart_that_stands_before_its_last_grain_has_flowed(
    crew_of, served
):
    crew = crew_of(served)
    ties = crew.orders.ties
    t = int(np.flatnonzero(ties.ends[:, 0] > ties.begins[:, 0] + PASSED)[0])
    ties = ties._replace(last=np.arange(len(ties.last)) == t)
    # The cart has come, and is stopped there; the auger is fast enough until the visit's end.
    stations = np.array([ties.begins[t, 0], ties.begins[t, 1] + ties.waits[t, 1]])
    speeds = np.array([1.0, 0.0])
    left = 0.9 * crew.fleet.unload_rates[0] * (ties.ends[t, 0] - ties.begins[t, 0] - 1.0)
    loads = Loads(
        np.array([left]),
        np.array([ties.given[t] - left]),
        np.ones(1),
        np.array([10000.0]),
        np.array([9000.0]),
    )
    hold = tie_hold(crew.fleet, ties, loads, stations, speeds, 0, False)
    beside = ties.begins[t, 0] + ties.waits[t, 1] + ties.slacks[t, 0]
    assert hold == pytest.approx(min(beside, ties.ends[t, 0]))
    assert hold < ties.ends[t, 0]


@pytest.mark.parametrize("planned", [1e-3, 0.5, 2.0, 4000.0])
def test_how_much_more_has_grown_is_told_of_a_handful_as_of_a_tank(planned):
    path = MachinePath.of([[0.0, 0.0, 0.0], [4 * PIECE, 0.0, 0.0]])
    share = np.linspace(0.0, 1.0, len(grain_stations(path)))
    work = SimpleNamespace(
        plans=[SimpleNamespace(path=path)],
        grown=object(),
        planned_grain=[planned * share],
        grain=[1.7 * planned * share],
    )
    assert _more(work, 0, 3.1 * PIECE) == pytest.approx(1.7)
    # Before anything was to be cut nothing tells how much more there is.
    assert _more(work, 0, 0.0) == 1.0
