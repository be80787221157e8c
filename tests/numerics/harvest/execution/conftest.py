"""Plans that are driven, with all that the systems do, but without Drake."""

import runpy
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.harvest_log import HarvestLog, Machine, Part, Site
from sightfield.systems.numerics.harvest.carts.cart_motion import trailer_poses
from sightfield.systems.numerics.harvest.carts.cart_plan import Supply
from sightfield.systems.numerics.harvest.execution.advance import Disturbance, advance, pace_of
from sightfield.systems.numerics.harvest.execution.fleet import (
    at_trucks,
    pack_fleet,
    pack_tracks,
    poses_on,
)
from sightfield.systems.numerics.harvest.execution.orders import find_orders
from sightfield.systems.numerics.harvest.execution.planned_work import PlannedWork
from sightfield.systems.numerics.harvest.execution.unloading import (
    NOTHING,
    Loads,
    pour_alongside,
    wanted_by,
    work_together,
)
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import (
    COLUMNS,
    CUT,
    LOST,
    MODE,
    STANDS,
    TANK,
    Cart,
    cart_outline,
    combine_outline,
    pair_up,
)
from sightfield.systems.numerics.harvest.timing.timetable import MachineTimetable, time_machines

HERE = Path(__file__).parent


class Driven(NamedTuple):
    """What came of a run; T ticks, N combines, K carts, M = N + K.

    Attributes:
        times: Shape (T,) [s].
        stations, speeds: Shape (T, M) [m], [m/s].
        tank, load: Shapes (T, N) and (T, K) [kg].
        cut, lost: By each combine, shape (T, N) [kg].
        delivered: Shape (T,) [kg].
        arrived: Whether all are at their ends, with nothing left to pour.
    """

    times: np.ndarray
    stations: np.ndarray
    speeds: np.ndarray
    tank: np.ndarray
    load: np.ndarray
    cut: np.ndarray
    lost: np.ndarray
    delivered: np.ndarray
    arrived: bool


class Crew:
    """The machines of a plan."""

    def __init__(self, work, step=0.25):
        self.work, self.step = work, step
        self.orders, self.fleet = find_orders(work), pack_fleet(work)
        self.tracks = pack_tracks([timed.path for timed in work.timed])
        self.ends = np.array([timed.path.length for timed in work.timed])

    def states(self, stations):
        """x, y, theta, beta of the carts, shape (K, 4)."""
        found = np.zeros((len(self.work.motions), 4))
        for k, motion in enumerate(self.work.motions):
            at = stations[len(self.work.plans) + k]
            found[k, :3] = motion.timed.path.pose_at(at)
            found[k, 3] = np.interp(at, *motion._table)
        return found

    def run(self, disturbance=None, patience=3.0):
        """Drive until all have arrived, or the plan should long have ended."""
        work, fleet, step = self.work, self.fleet, self.step
        count, carts = len(work.plans), len(work.motions)
        pace = pace_of(disturbance or Disturbance())
        stations, speeds = np.zeros(count + carts), np.zeros(count + carts)
        accounts = np.zeros((count, COLUMNS))
        received, delivered = np.zeros(carts), np.zeros(carts)
        combine, cart = work.size, work.cart
        reach = combine.header_width / 2 + combine.cart_gap + cart.width / 2
        rows, tick, arrived = [], 0, False
        while not arrived and tick * step < patience * work.end + 600.0:
            load = received - delivered
            room = np.maximum(cart.capacity - load, 0.0)
            tank = accounts[:, TANK].copy()
            given = accounts[:, CUT] - accounts[:, LOST] - tank
            loads = Loads(tank, given, np.zeros(count), room, load)
            wanted, asked = wanted_by(fleet, self.orders.ties, loads, stations)
            alongside = np.full(count, -1)
            if (wanted >= 0).any():
                alongside = pair_up(
                    poses_on(self.tracks, stations)[: 3 * count].reshape(-1, 3),
                    self.states(stations),
                    wanted,
                    STANDS[accounts[:, MODE].astype(int)],
                    cart.length,
                    cart.hitch_offset,
                    reach,
                ).astype(int)
            pour_alongside(fleet, self.orders.ties, loads, stations, alongside)
            emptying = at_trucks(fleet, stations[count:], load, tick * step)
            rows.append(
                (
                    tick * step,
                    stations.copy(),
                    speeds.copy(),
                    tank,
                    load,
                    accounts[:, CUT].copy(),
                    accounts[:, LOST].copy(),
                    delivered.sum(),
                )
            )
            there = bool((stations >= self.ends - 1e-6).all())
            arrived = (
                there
                and not emptying.any()
                and not ((loads.free > NOTHING) & (tank > NOTHING)).any()
            )
            after, after_speeds = advance(
                fleet, self.orders, pace, loads, stations, speeds, tick * step, step
            )
            more = np.zeros(carts)
            work_together(
                fleet,
                accounts,
                after[:count],
                self.ends[:count],
                alongside,
                np.minimum(room, asked),
                more,
                step,
            )
            received += more
            delivered += np.where(
                emptying > 0.5, np.minimum(work.supply.truck_rate * step, load), 0.0
            )
            stations, speeds = after, after_speeds
            tick += 1
        return Driven(*(np.array(column) for column in zip(*rows, strict=True)), arrived)

    def audit(self, driven, every=2):
        """The audit of what was driven."""
        work, rows = self.work, slice(None, None, every)
        at, count = driven.stations[rows], len(work.plans)
        pieces = [p.path.piece_at(at[:, n]) for n, p in enumerate(work.plans)]
        both = list(zip(work.plans, pieces, strict=True))
        tractors, trailers = np.zeros((2, len(at), len(work.motions), 3))
        for k, motion in enumerate(work.motions):
            tractors[:, k] = motion.timed.path.pose_at(at[:, count + k])
            betas = np.interp(at[:, count + k], *motion._table)
            trailers[:, k] = trailer_poses(tractors[:, k], betas, work.cart)
        log = HarvestLog(
            time=driven.times[rows],
            combine_pose=np.stack(
                [p.path.pose_at(at[:, n]) for n, p in enumerate(work.plans)], axis=1
            ),
            combine_speed=driven.speeds[rows, :count]
            * np.stack([p.path.gears[piece] for p, piece in both], axis=1),
            tractor_pose=tractors,
            trailer_pose=trailers,
            tank=driven.tank[rows],
            cart_load=driven.load[rows],
            cutting=np.stack([p.path.cutting[piece] for p, piece in both], axis=1) * 1.0,
            delivered=driven.delivered[rows],
        )
        header, body = combine_outline(work.size)
        tractor, trailer = cart_outline(work.cart)
        combines = tuple(
            Machine(
                front=header,
                rear=body,
                capacity=combine.capacity,
                acceleration=combine.acceleration,
                turning_radius=combine.turning_radius,
            )
            for combine in work.combines
        )
        cart = Machine(
            front=tractor,
            rear=trailer,
            capacity=work.cart.capacity,
            acceleration=work.cart.acceleration,
            lateral_acceleration=work.cart.lateral_acceleration,
            turning_radius=work.cart.turning_radius,
        )
        site = Site(
            combines,
            (cart,) * len(work.motions),
            (Part(work.field.outline, work.field.obstacles),),
            work.field.margin,
        )
        return audit_harvest(log, site)


@pytest.fixture(scope="session")
def crew_of():
    """Makes the machines of a plan ready to drive."""
    return Crew


@pytest.fixture(scope="session")
def combines_only():
    """Makes plans of combines on made-up paths of a kind from 0 to 3, and their sweeps."""
    fleets = runpy.run_path(str(HERE.parent / "timing" / "conftest.py"))

    def make(kind, rng, count):
        while True:
            paths = fleets["KINDS"][kind](rng, count)
            journeys = [fleets["journey"](path) for path in paths]
            timetable = time_machines(journeys, trials=5)
            if isinstance(timetable, MachineTimetable):
                break
        cart = Cart()
        return PlannedWork(
            field=Field.rectangle(10.0, 10.0),
            combines=[fleets["COMBINE"]] * len(timetable.paths),
            cart=cart,
            supply=Supply(density=0.8, trucks=np.zeros((0, 3))),
            plans=timetable.paths,
            motions=[],
        )

    return make


@pytest.fixture(scope="session")
def served():
    """A plan of one combine on a rectangle, by hand, and of a cart that serves it."""
    return runpy.run_path(str(HERE.parent / "carts" / "conftest.py"))["make_served"]()
