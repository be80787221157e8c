"""What machines are to do, as their drivers need it: paths in time, visits, trips and grain."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..carts.cart_motion import CartMotion, trailer_angles, trailer_poses
from ..carts.cart_plan import CartVisit, Supply, Trip
from ..carts.cut_times import CELL, CutTimes, cut_times
from ..coverage.precedence import CropPrecedence
from ..field.field import Field
from ..field.yield_map import YieldMap, grain_on_cells
from ..machines import Cart, Combine, CombineSize, cart_outline, combine_outline, size_of
from ..paths import MachinePath, TimedPath, runs_of
from ..plan.harvest_plan import HarvestPlan
from ..timing.sweep import Sweep, cart_sweep, grid_stations, outline_ways, sweep_of

# Distance of stations between which crop comes in evenly [m].
PIECE = 0.5
# Largest distance that any point of a machine moves on one of the cells for which machines wait
# [m]. A machine may be a cell late relative to one that is near it at the same time in the plan; it
# comes nearer to it by no more than that: of the half metre that plans keep, 0.3 m are left.
LONGEST_CELL = 0.2


@dataclass(frozen=True, eq=False, kw_only=True)
class PlannedWork:
    """A plan of N combines and K carts, which are numbered together, combines first.

    Attributes:
        field: What is cut.
        combines: The combines, of one size.
        cart: One of the equal carts.
        supply: Crop and trucks.
        plans: When each combine is where, with its stops for carts.
        motions: When each cart is where.
        visits, trips: Of the carts.
        precedence: Crop that combines cut for one another; None if it is not given.
        grown: The yield in fact [kg/m^2]; None: as planned.
    """

    field: Field
    combines: Sequence[Combine]
    cart: Cart
    supply: Supply
    plans: Sequence[TimedPath]
    motions: Sequence[CartMotion]
    visits: Sequence[CartVisit] = ()
    trips: Sequence[Trip] = ()
    precedence: CropPrecedence | None = None
    grown: float | YieldMap | None = None

    @property
    def size(self) -> CombineSize:
        """Size of the combines."""
        return size_of(self.combines)

    @property
    def timed(self) -> list[TimedPath]:
        """Timed paths of all machines."""
        return [*self.plans, *(motion.timed for motion in self.motions)]

    @property
    def end(self) -> float:
        """When the last machine has done its work [s]."""
        ends = [path.end for path in self.timed]
        return max([*ends, *(trip.end for trip in self.trips)])

    def tanks_at(self, times: np.ndarray) -> np.ndarray:
        """Planned load of every tank at times, shape (t,) [s] -> (t, N) [kg]."""
        tanks = np.empty((len(times), len(self.plans)))
        for n, plan in enumerate(self.plans):
            tanks[:, n] = np.interp(
                plan.station_at(times), grain_stations(plan.path), self.planned_grain[n]
            )
        for visit in self.visits:
            tanks[:, visit.combine] -= visit.taken * _share(visit.begin, visit.end, times)
        return tanks

    def loads_at(self, times: np.ndarray) -> np.ndarray:
        """Planned load of every cart at times, shape (t,) [s] -> (t, K) [kg]."""
        loads = np.zeros((len(times), len(self.motions)))
        for visit in self.visits:
            loads[:, visit.cart] += visit.taken * _share(visit.begin, visit.end, times)
        for trip in self.trips:
            for each in trip.fillings:
                loads[:, trip.cart] -= each.amount * _share(each.begin, each.end, times)
        return loads

    @cached_property
    def cut(self) -> CutTimes:
        """When and by whom the ground is cut."""
        return cut_times(self.field, self.size, self.plans)

    @cached_property
    def cutting_stations(self) -> np.ndarray:
        """Station at which its combine cuts each cell of the ground, -inf for none.

        Shape (rows, columns) [m].
        """
        found = np.full(self.cut.times.shape, -np.inf)
        for n, plan in enumerate(self.plans):
            own = self.cut.cutter == n
            found[own] = plan.station_at(self.cut.times[own])
        return found

    @cached_property
    def grain(self) -> list[np.ndarray]:
        """What each combine has cut at stations PIECE apart, and at its last; N of (n,) [kg].

        Between them it comes in evenly, and only where the header is down all the way.
        """
        return self.planned_grain if self.grown is None else self._grain_of(self.grown)

    @cached_property
    def planned_grain(self) -> list[np.ndarray]:
        """The same as `grain`, but with the planned yield; N of (n,) [kg]."""
        return self._grain_of(self.supply.density)

    def _grain_of(self, density: float | YieldMap) -> list[np.ndarray]:
        there = grain_on_cells(density, self.cut.corner, CELL, self.cut.times.shape)
        found = []
        for n, plan in enumerate(self.plans):
            edges = grain_stations(plan.path)
            mine = self.cut.cutter == n
            own = _in_whole_pieces(plan.path, self.cutting_stations[mine])
            order = np.argsort(own)
            count = np.searchsorted(own[order], edges, side="right")
            count[-1] = len(own)
            found.append(np.append(0.0, np.cumsum(there[mine][order]))[count])
        return found

    @cached_property
    def towed(self) -> list[tuple[MachinePath, np.ndarray]]:
        """For each cart its path in short pieces, and the trailer's poses at the path's poses."""
        found = []
        for motion in self.motions:
            path, betas = _dense_path(motion)
            found.append((path, trailer_poses(path.poses, betas, self.cart)))
        return found

    @cached_property
    def sweeps(self) -> list[Sweep]:
        """The ground that each machine covers along its path."""
        combine, cart = combine_outline(self.size), cart_outline(self.cart)
        found = []
        for n, plan in enumerate(self.plans):
            # Cells end where it stands for carts, as in the plan.
            stops = [plan.station_at(v.begin) for v in self.visits if v.combine == n]
            halts = np.unique(np.array([s for s in stops if 0 < s < plan.path.length]))
            moved = outline_ways(plan.path.poses, combine)
            grid = grid_stations(plan.path, LONGEST_CELL, halts, moved)
            found.append(sweep_of(plan.path, combine, grid))
        for motion, (path, trailer) in zip(self.motions, self.towed, strict=True):
            timed = motion.timed
            still = np.flatnonzero(np.diff(timed.stations) < 1e-9)
            halts = np.unique(timed.stations[still])
            halts = halts[(halts > 1e-3) & (halts < path.length - 1e-3)]
            moved = np.maximum(
                outline_ways(path.poses, [cart.tractor]), outline_ways(trailer, [cart.trailer])
            )
            grid = grid_stations(path, LONGEST_CELL, halts, moved)
            found.append(cart_sweep(path, trailer, cart, grid))
        return found

    @property
    def starts(self) -> np.ndarray:
        """Where carts begin: x, y, theta, beta of each, shape (K, 4) [m], [m], [rad], [rad]."""
        return np.array([[*motion.timed.path.poses[0], motion.beta] for motion in self.motions])


def work_of(plan: HarvestPlan, grown: float | YieldMap | None = None) -> PlannedWork:
    """What drivers need of a plan.

    Args:
        plan: The plan.
        grown: The yield in fact [kg/m^2]; None: as planned.
    """
    return PlannedWork(
        field=plan.combines.field,
        combines=plan.combines.machines,
        cart=plan.cart,
        supply=plan.supply,
        plans=plan.service.plans,
        motions=plan.service.motions,
        visits=plan.service.visits,
        trips=plan.service.trips,
        precedence=plan.combines.coverage.precedence,
        grown=grown,
    )


def _share(begin: float, end: float, times: np.ndarray) -> np.ndarray:
    """Part of the time from `begin` to `end` that is over at times, in [0, 1]."""
    return np.clip((times - begin) / max(end - begin, 1e-9), 0.0, 1.0)


def grain_stations(path: MachinePath) -> np.ndarray:
    """Stations PIECE apart, from 0 on, and the last one, shape (n,) [m]."""
    return np.append(np.arange(0.0, path.length, PIECE), path.length)


def _in_whole_pieces(path: MachinePath, stations: np.ndarray) -> np.ndarray:
    """Stations moved into the pieces, PIECE long, that lie wholly where the header is down [m].

    If a header is lowered or lifted within a piece, grain would otherwise come in while it is up.
    Stations on stretches of cutting that contain no whole piece stay as they are.
    """
    runs = runs_of(path.cutting)
    if not runs:
        return stations
    begins, ends = path.stations[runs].T
    run = np.clip(np.searchsorted(begins, stations + 1e-9, side="right") - 1, 0, None)
    low = PIECE * np.ceil(begins / PIECE - 1e-9)[run]
    high = PIECE * np.floor(ends / PIECE + 1e-9)[run]
    moved = np.clip(stations, np.minimum(low + PIECE / 2, high), high)
    return np.where(high - low > PIECE / 2, moved, stations)


def _dense_path(motion: CartMotion) -> tuple[MachinePath, np.ndarray]:
    """A cart's path with poses at most half a metre apart, and the trailer's angles at them."""
    path = motion.timed.path
    at = np.unique(np.concatenate([path.stations, path.stations_every(0.5)]))
    if len(at) > 1:
        at = at[np.append(True, np.diff(at) > 1e-9)]
    piece = path.piece_at((at[:-1] + at[1:]) / 2)
    dense = MachinePath(path.pose_at(at), path.gears[piece], path.cutting[piece], path.work[piece])
    betas = trailer_angles(path, motion.cart, motion.beta, at)
    return dense, np.unwrap(betas)
