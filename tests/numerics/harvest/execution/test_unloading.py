"""What a combine cuts, pours, keeps and spills in a step, against small steps; and in visits."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.execution.advance import Disturbance
from sightfield.systems.numerics.harvest.execution.fleet import cut_up_to
from sightfield.systems.numerics.harvest.execution.orders import REST, find_ties
from sightfield.systems.numerics.harvest.execution.planned_work import (
    PIECE,
    _in_whole_pieces,
    grain_stations,
)
from sightfield.systems.numerics.harvest.execution.unloading import (
    NEAR,
    Loads,
    full_hold,
    work_for,
)
from sightfield.systems.numerics.harvest.machines import (
    BLOCKED,
    COLUMNS,
    CUT,
    CUTTING,
    DONE,
    FULL,
    LOST,
    MODE,
    STATION,
    STOP_TIME,
    TANK,
    UNLOADING,
)
from sightfield.systems.numerics.harvest.paths import MachinePath


def account(tank, station=10.0):
    found = np.zeros(COLUMNS)
    found[TANK], found[CUT], found[STATION] = tank, tank, station
    return found


def by_small_steps(tank, cut, capacity, rate, room, duration, count=20000):
    """Tank, what was given and what was spilt, from the rates."""
    given = lost = 0.0
    for _ in range(count):
        tank += cut / count
        out = min(rate * duration / count, tank, room - given)
        tank, given = tank - out, given + out
        over = max(tank - capacity, 0.0)
        tank, lost = tank - over, lost + over
    return tank, given, lost


@pytest.mark.parametrize(
    ("tank", "cut", "capacity", "rate", "room"),
    [
        (500.0, 8.0, 9000.0, 0.0, 1e9),
        (500.0, 8.0, 9000.0, 120.0, 1e9),
        (12.0, 8.0, 9000.0, 120.0, 1e9),
        (0.0, 8.0, 9000.0, 120.0, 1e9),
        (500.0, 8.0, 9000.0, 120.0, 7.0),
        (8995.0, 8.0, 9000.0, 0.0, 1e9),
    ],
)
def test_amounts_of_a_step_are_those_of_many_small_ones(tank, cut, capacity, rate, room):
    found = account(tank)
    given = work_for(found, 12.0, 100.0, cut, capacity, rate, room, 0.5)
    expected = by_small_steps(tank, cut, capacity, rate, room, 0.5)
    assert [found[TANK], given, found[LOST]] == pytest.approx(expected, abs=2e-3)
    assert found[CUT] == pytest.approx(found[TANK] + given + found[LOST], abs=1e-9)


@pytest.mark.parametrize(
    ("station", "tank", "rate", "mode"),
    [
        (12.0, 500.0, 0.0, CUTTING),
        (12.0, 500.0, 120.0, UNLOADING),
        (10.0, 500.0, 0.0, BLOCKED),
        (10.0, 9000.0, 0.0, FULL),
        (100.0, 500.0, 0.0, DONE),
    ],
)
def test_modes_tell_what_it_does(station, tank, rate, mode):
    found = account(tank)
    cut = 0.0 if station == 10.0 else 1.0
    work_for(found, station, 100.0, cut, 9000.0, rate, 1e9, 0.5)
    assert found[MODE] == mode
    assert found[STATION] == station
    assert found[STOP_TIME] == (0.5 if mode == FULL else 0.0)


def test_what_rounding_leaves_over_in_a_full_tank_is_no_loss():
    found = account(8999.0)
    work_for(found, 12.0, 100.0, 1.0 + 1e-12, 9000.0, 0.0, 0.0, 0.5)
    assert found[TANK] == 9000.0
    assert found[LOST] == 0.0
    assert found[CUT] == 9000.0


def full_carts(served):
    """The same plan with a cart that it fills to the brim."""
    most = served.loads_at(np.arange(0.0, served.end, 0.25)).max()
    return replace(served, cart=replace(served.cart, capacity=float(most)))


def early_leaving(served):
    """The same plan with a first visit that leaves a tonne in the tank to the second one."""
    first, second, *others = sorted(served.visits, key=lambda visit: visit.begin)
    shifted = [
        each._replace(taken=each.taken + more) for each, more in ((first, -1e3), (second, 1e3))
    ]
    return replace(served, visits=[*shifted, *others])


@pytest.mark.parametrize("step", [0.1, 0.5])
def test_a_visit_gives_what_it_should_and_no_more_whatever_the_step(crew_of, served, step):
    crew = crew_of(early_leaving(served), step=step)
    driven = crew.run(Disturbance(slowness=0.2, stops=6.0, seed=2))
    ties, given = crew.orders.ties, (driven.cut - driven.tank)[:, 0]
    assert len(ties.given) > 2
    before = 0.0
    for t in range(len(ties.given) - 1):
        following = driven.stations[:, 0] < ties.begins[t + 1, 0] - NEAR
        most = given[following].max()
        assert before + 1000.0 < most <= ties.given[t] + 1e-6
        before = most


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
def test_full_carts_leave_nothing_in_a_tank(crew_of, served, seed):
    work = full_carts(early_leaving(served))
    disturbance = None if seed is None else Disturbance(slowness=0.2, stops=6.0, seed=seed)
    driven = crew_of(work, step=0.5).run(disturbance)
    assert driven.arrived
    assert driven.load.max() <= work.cart.capacity + 1e-6
    assert driven.load.max() > work.cart.capacity - 200.0
    held = driven.tank.sum(axis=1) + driven.load.sum(axis=1) + driven.delivered
    assert held == pytest.approx(driven.cut.sum(axis=1), abs=1e-6)
    assert driven.lost.max() == 0.0
    assert driven.delivered[-1] == pytest.approx(work.grain[0][-1], abs=1e-6)


def tight_tanks(served):
    """The same plan with little crop, and a tank that is full to the brim when a cart comes once.

    With much crop a tank that is full too early is so only a few metres before the cart.
    """
    thin = replace(served, grown=0.4)
    ties, at = find_ties(thin), grain_stations(thin.plans[0].path)
    tanks = np.interp(ties.begins[:, 0], at, thin.grain[0]) - np.append(0.0, ties.given[:-1])
    combines = [replace(each, capacity=float(tanks.max())) for each in thin.combines]
    return replace(thin, combines=combines)


@pytest.mark.parametrize("seed", [None, 0, 1, 2, 3])
def test_a_tank_that_is_planned_full_gets_to_where_the_cart_comes(crew_of, served, seed):
    work = tight_tanks(early_leaving(served))
    ties = find_ties(work)
    assert ties.rooms.min() == pytest.approx(0.0, abs=1e-6)
    disturbance = None if seed is None else Disturbance(slowness=0.2, stops=6.0, seed=seed)
    driven = crew_of(work, step=0.5).run(disturbance)
    assert driven.arrived
    assert driven.lost.max() == 0.0
    assert driven.delivered[-1] == pytest.approx(work.grain[0][-1], abs=1e-6)
    # Behind a visit no more is left of what it should give than there is room for.
    given, at = (driven.cut - driven.tank)[:, 0], driven.stations[:, 0]
    for t in range(len(ties.given) - 1):
        following = at > ties.ends[t, 0] + 1e-6
        assert ties.given[t] - given[following].min() <= ties.rooms[t] + 1e-6


def test_what_a_visit_may_leave_is_what_the_next_cart_and_the_tank_have_room_for(served):
    at = grain_stations(served.plans[0].path)
    for work in (served, full_carts(served), tight_tanks(served)):
        ties = find_ties(work)
        rooms = ties.rooms[:-1]
        # One combine: what visits take, and what may come on top of it from the one before.
        taken = [visit.taken for visit in sorted(work.visits, key=lambda each: each.begin)]
        on_top = np.append(0.0, rooms)
        tours = np.searchsorted([trip.begin for trip in work.trips], [v.begin for v in work.visits])
        for tour in np.unique(tours):
            assert (np.add(taken, on_top))[tours == tour].sum() <= work.cart.capacity + 1e-6
        cut = np.interp(ties.begins[1:, 0], at, work.grain[0])
        assert (cut - ties.given[:-1] + rooms <= work.combines[0].capacity + 1e-6).all()
        assert ties.rooms[-1] == np.inf
        assert ties.given[-1] == np.inf
    assert find_ties(served).rooms.min() > REST * served.combines[0].unload_rate
    assert (find_ties(full_carts(served)).rooms == 0.0).any()


def test_all_is_cut_when_the_last_visit_is_over(served):
    at = grain_stations(served.plans[0].path)
    end = find_ties(served).ends[-1, 0]
    assert np.interp(end, at, served.grain[0]) == served.grain[0][-1]


def test_a_full_tank_goes_on_as_far_as_the_cart_alongside_has_still_to_take(crew_of, served):
    crew = crew_of(served)
    fleet, tank = crew.fleet, float(served.combines[0].capacity)
    loads = Loads(np.array([tank]), np.zeros(1), np.array([40.0]), np.full(1, 1e9), np.zeros(1))
    begin = 200.0
    hold = full_hold(fleet, loads, begin, 0)
    assert cut_up_to(fleet, 0, hold) - cut_up_to(fleet, 0, begin) == pytest.approx(40.0)


@pytest.mark.parametrize("seed", range(10))
def test_grain_comes_in_where_the_header_is_down_over_a_whole_piece(seed):
    """However long the stretches of cutting, and however little falls on whole pieces of them."""
    rng = np.random.default_rng([17, seed])
    ends = np.cumsum(rng.uniform(0.2, 7.0, 9))
    poses = np.column_stack([ends, np.zeros((9, 2))])
    path = MachinePath.of(poses)
    path = replace(path, cutting=np.arange(8) % 2 == 0)
    begins, ends = path.stations[:-1][path.cutting], path.stations[1:][path.cutting]
    stretch = rng.integers(0, len(begins), 40)
    at = begins[stretch] + rng.uniform(0.0, 1.0, 40) * (ends - begins)[stretch]
    moved = _in_whole_pieces(path, at)
    for k, own in enumerate(stretch):
        pieces = [
            n * PIECE
            for n in range(200)
            if begins[own] <= n * PIECE + 1e-9 and (n + 1) * PIECE <= ends[own] + 1e-9
        ]
        if not pieces:
            assert moved[k] == at[k]
            continue
        low, high = pieces[0], pieces[-1] + PIECE
        assert low < moved[k] <= high
        if low + PIECE / 2 <= at[k] <= high:
            assert moved[k] == at[k]
