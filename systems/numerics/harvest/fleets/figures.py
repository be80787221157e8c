"""What a harvest takes: time, engine hours, way, fuel, and what machines wait for.

**Fuel** of combines and of tractors with grain carts, by a model that is stated in full:

An engine whose rated power is P [kW], loaded by the part X of it, with its speed reduced by N
percent, burns (Grisso, Kocher and Vaughan 2004, Predicting tractor fuel consumption, Applied
Engineering in Agriculture 20(5); the form that ASABE EP496.3 and D497 took over)

    Q = (0.22 X + 0.096) (1 + 0.0045 X N - 0.00877 N) P      [l/h]

By ASAE D497.7, Table 2, a combine in small grains needs 20 kW, and 3.6 kWh for each tonne of
material other than grain. By its clause on motion resistance (1 / B_n + 0.04 with B_n = 55), any
machine on wheels on firm soil needs 5.8% of its weight as a force along its way. Assumed here, and
not taken from there: as much straw as grain goes through the combine, four fifths of the power of
an engine reach the wheels, and engines of machines that stand turn at half their speed without a
load.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...errors import require_non_negative, require_positive
from ..carts.cart_plan import Stop
from ..execution.planned_work import work_of
from ..machines import Cart, Combine
from ..paths import TimedPath
from ..plan.harvest_plan import CombinePlan, HarvestPlan
from ..trucks import TruckFleet
from .cart_rounds import CartRounds

# Weight of a kilogram [N].
GRAVITY = 9.80665
# For threshing small grains (D497.7, Table 2): [W], and [J/kg] of material other than grain.
THRESHING, PER_STRAW = 20e3, 3.6 * 3600.0
# Motion resistance over weight on firm soil (D497.7): 1 / B_n + 0.04, B_n = 55 [-].
RESISTANCE = 1.0 / 55.0 + 0.04
# Fuel of an engine by load and without load [l/(kW h)]; effects of a percent less speed [-].
BY_LOAD, WITHOUT_LOAD, BY_BOTH, BY_SPEED = 0.22, 0.096, 0.0045, 0.00877
# Assumed: straw through a combine over grain, and the part of an engine's power that reaches the
# wheels [-].
STRAW, DRIVELINE = 1.0, 0.8
# By how much the speed of standing machines' engines is reduced [%].
IDLING = 50.0

# Time between two samples of a plan [s].
STEP = 1.0
# A machine slower than this counts as standing [m/s]; a combine this near to a place where it waits
# for a cart counts as waiting there [m].
SLOW, AT_STOP = 1e-3, 0.5


def fuel_rate(power: float, load: float, slowed: float = 0.0) -> float:
    """Fuel rate of an engine [l/s].

    Args:
        power: Its rated power [W].
        load: Power that it delivers [W].
        slowed: By how much its speed is reduced [%].

    Raises:
        InvalidInput: A value is out of its range.
    """
    require_positive("power", power)
    require_non_negative("load", load)
    part = load / power
    speed = 1.0 + BY_BOTH * part * slowed - BY_SPEED * slowed
    return (BY_LOAD * part + WITHOUT_LOAD) * speed * power / 1e3 / 3600.0


def idling_rate(power: float) -> float:
    """Fuel rate of the engine of a machine that stands [l/s].

    Args:
        power: Its rated power [W].
    """
    return fuel_rate(power, 0.0, IDLING)


def driving_energy(mass: float, way: float) -> float:
    """Energy that an engine gives to move a mass over firm soil [J].

    Args:
        mass: [kg].
        way: [m].
    """
    return RESISTANCE * GRAVITY * mass * way / DRIVELINE


def driving_fuel(power: float, energy: float, time: float) -> float:
    """Fuel that an engine at full speed burns to give an energy in a time [l].

    The law is linear in the load, so that only the sum of the energy counts.

    Args:
        power: Its rated power [W].
        energy: Energy that it gives [J].
        time: How long it runs [s].
    """
    return (BY_LOAD * energy + WITHOUT_LOAD * power * time) / 3.6e6


def threshing_energy(grain: float, time: float) -> float:
    """Energy that a combine's engine gives to thresh [J].

    Args:
        grain: Grain that goes through it [kg].
        time: How long it works [s].
    """
    return THRESHING * time + PER_STRAW * STRAW * grain


@dataclass(frozen=True, kw_only=True)
class FleetFigures:
    """What a fleet needs for a field.

    Attributes:
        combines, carts, trucks: How many there are; 0 trucks where these hold any amount, one at
            each cart's place.
        makespan: Until the last grain is in a truck and the last combine has parked [s].
        combine_engine_time, cart_engine_time: Total time that engines run, each from the beginning
            until its machine has done its work [s].
        combine_way, cart_way: Total way driven [m].
        combine_fuel, cart_fuel: Total fuel, by the model above [l].
        combines_for_carts: Total time that combines stand with full tanks [s].
        combines_for_combines: Total time that combines wait for one another [s].
        carts_for_grain: Total time that carts stand because no tank is due [s].
        carts_for_trucks: Total time that carts stand because no truck is there [s].
        misses: How many times a combine stands for a cart.
        visits, trips: Numbers of visits to combines and of trips to trucks.
    """

    combines: int
    carts: int
    trucks: int
    makespan: float
    combine_engine_time: float
    cart_engine_time: float
    combine_way: float
    cart_way: float
    combine_fuel: float
    cart_fuel: float
    combines_for_carts: float
    combines_for_combines: float
    carts_for_grain: float
    carts_for_trucks: float
    misses: int
    visits: int
    trips: int

    @property
    def machines(self) -> int:
        """Number of machines, each of which needs a driver."""
        return self.combines + self.carts + self.trucks

    @property
    def fuel(self) -> float:
        """Fuel of combines and carts; what trucks burn on the road is not known [l]."""
        return self.combine_fuel + self.cart_fuel

    @property
    def engine_hours(self) -> float:
        """Engine hours of combines and carts [h]."""
        return (self.combine_engine_time + self.cart_engine_time) / 3600.0


def figures_of_plan(plan: HarvestPlan, trucks: TruckFleet) -> FleetFigures:
    """Figures of a whole plan, read from the ways and times of its machines.

    Args:
        plan: Of the harvest.
        trucks: What takes the grain from carts.
    """
    team, service = plan.combines, plan.service
    numbers = range(len(service.plans))
    ends = np.array([timed.end for timed in service.plans])
    stands = [_standing(timed, service.stops, n) for n, timed in enumerate(service.plans)]
    last = [max((v.end for v in service.visits if v.combine == n), default=0.0) for n in numbers]
    engine = np.maximum(ends, last)
    still = np.array([sum(each) for each in stands]) + engine - ends
    ways = np.array([timed.path.length for timed in service.plans])
    work = work_of(plan)
    grain = np.array([cut[-1] for cut in work.planned_grain])
    cart_engine, cart_moves, hauled, cart_way = 0.0, 0.0, 0.0, 0.0
    for k, motion in enumerate(service.motions):
        trips = [trip.end for trip in service.trips if trip.cart == k]
        end = max([motion.timed.end, *trips])
        times = np.arange(0.0, end + STEP, STEP)
        stations = motion.timed.station_at(times)
        driven = np.diff(stations)
        cart_moves += STEP * int((driven > SLOW * STEP).sum())
        cart_way += float(stations[-1])
        hauled += float((work.loads_at(times)[:-1, k] * driven).sum())
        cart_engine += end
    gives = sum(trip.delivered for trip in service.trips) / plan.supply.truck_rate
    at_trucks = sum(trip.end - trip.begin for trip in service.trips) - gives
    beside_standing = sum(
        visit.end - visit.begin
        for visit in service.visits
        if service.plans[visit.combine].station_at(visit.end)
        - service.plans[visit.combine].station_at(visit.begin)
        < AT_STOP
    )
    idle = cart_engine - cart_moves - beside_standing - gives - at_trucks
    return FleetFigures(
        combines=len(service.plans),
        carts=len(service.motions),
        trucks=trucks.count if math.isfinite(trucks.capacity) else 0,
        makespan=max([plan.makespan, *(trip.end for trip in service.trips)]),
        combine_engine_time=float(engine.sum()),
        cart_engine_time=cart_engine,
        combine_way=float(ways.sum()),
        cart_way=cart_way,
        combine_fuel=_combine_fuel(team.machines, ways, grain, engine - still, still),
        cart_fuel=_cart_fuel(plan.cart, cart_way, hauled, cart_moves, cart_engine),
        combines_for_carts=sum(each[0] for each in stands),
        combines_for_combines=sum(each[1] for each in stands),
        carts_for_grain=max(idle, 0.0),
        carts_for_trucks=max(at_trucks, 0.0),
        misses=len(service.stops),
        visits=len(service.visits),
        trips=len(service.trips),
    )


def figures_of_model(
    team: CombinePlan,
    cart: Cart,
    rounds: CartRounds,
    trucks: TruckFleet,
) -> FleetFigures:
    """Figures of a fleet whose combines are planned and whose carts follow the model.

    Args:
        team: The combines.
        cart: Each of the carts.
        rounds: What carts do.
        trucks: What takes the grain from carts.
    """
    speed = float(np.mean([combine.speed for combine in team.machines]))
    still = team.timetable.waiting.sum(axis=(1, 2)) + rounds.stops
    cart_way, cart_engine = float(rounds.way.sum()), float(rounds.cart_ends.sum())
    takes, gives = float(rounds.beside.sum()), float(rounds.emptying.sum())
    at_trucks = float(rounds.at_trucks.sum())
    moves = min((cart_way - speed * takes) / cart.speed + takes, cart_engine)
    return FleetFigures(
        combines=len(team.paths),
        carts=len(rounds.way),
        trucks=trucks.count if math.isfinite(trucks.capacity) else 0,
        makespan=rounds.makespan,
        combine_engine_time=float(rounds.ends.sum()),
        cart_engine_time=cart_engine,
        combine_way=team.coverage.length,
        cart_way=cart_way,
        combine_fuel=_combine_fuel(
            team.machines,
            np.array([path.length for path in team.coverage.paths]),
            rounds.grain,
            rounds.ends - still,
            still,
        ),
        cart_fuel=_cart_fuel(cart, cart_way, rounds.hauled, moves, cart_engine),
        combines_for_carts=float(rounds.stops.sum()),
        combines_for_combines=float(team.timetable.waiting.sum()),
        carts_for_grain=max(cart_engine - moves - gives - at_trucks, 0.0),
        carts_for_trucks=at_trucks,
        misses=rounds.misses,
        visits=rounds.visits,
        trips=rounds.trips,
    )


def _standing(timed: TimedPath, stops: list[Stop], combine: int) -> tuple[float, float]:
    """How long a combine stands for carts, and how long for other machines [s]."""
    times = np.arange(0.0, timed.end, STEP)
    stations = timed.station_at(times)
    stands = timed.speed_at(times) < SLOW
    for_cart = np.zeros(len(times), dtype=bool)
    for stop in stops:
        if stop.combine == combine:
            for_cart |= np.abs(stations - stop.station) < AT_STOP
    return STEP * int((stands & for_cart).sum()), STEP * int((stands & ~for_cart).sum())


def _combine_fuel(
    combines: Sequence[Combine],
    ways: np.ndarray,
    grain: np.ndarray,
    works: np.ndarray,
    stands: np.ndarray,
) -> float:
    """Fuel of all combines, with tanks half full on average; arrays have shape (N,) [l]."""
    fuel = 0.0
    for n, combine in enumerate(combines):
        time, power = float(works[n]), combine.engine_power
        energy = threshing_energy(float(grain[n]), time)
        energy += driving_energy(combine.mass + combine.capacity / 2, float(ways[n]))
        fuel += driving_fuel(power, energy, time) + idling_rate(power) * float(stands[n])
    return fuel


def _cart_fuel(cart: Cart, way: float, hauled: float, moves: float, runs: float) -> float:
    """Fuel of all carts; `hauled` is grain times way, `moves` and `runs` are times [l]."""
    energy = driving_energy(cart.mass, way) + driving_energy(1.0, hauled)
    power = cart.engine_power
    return driving_fuel(power, energy, moves) + idling_rate(power) * max(runs - moves, 0.0)
