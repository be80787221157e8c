"""Everything that is settled before a harvest begins: its field, its plan, its schedule."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from ...systems.numerics.errors import require, require_type
from ...systems.numerics.harvest.carts.cart_plan import Failure
from ...systems.numerics.harvest.carts.windows import beside
from ...systems.numerics.harvest.execution.planned_work import PlannedWork, work_of
from ...systems.numerics.harvest.field.field import Field
from ...systems.numerics.harvest.field.yield_map import YieldMap, mean_density
from ...systems.numerics.harvest.plan.harvest_plan import CombinePlan, HarvestPlan, plan_harvest
from ...systems.numerics.harvest.schedule.answer import ScheduleAnswer, answer_schedule
from ...systems.numerics.harvest.schedule.fleet import Fleet, Truck
from .scenario import HarvestScenario

# Of no field are there more tanks or loads of grain, and no harvest takes longer [s].
MOST_LOADS, SEASON = 2_000, 30 * 86_400.0
_DAYS = round(SEASON / 86_400.0)
# What a cart needs beside a combine before grain flows [m].
SETTLE = 8.0


@dataclass(frozen=True, eq=False)
class HarvestJob:
    """A harvest that is ready to begin.

    Attributes:
        scenario: What was asked for.
        field: What is harvested.
        plan: Where every machine is at every time.
        answer: Whether the carts can serve the combines, by the closed forms.
        grown: What grows in fact [kg/m^2]; None: what is planned with.
    """

    scenario: HarvestScenario
    field: Field
    plan: HarvestPlan
    answer: ScheduleAnswer
    grown: float | YieldMap | None = None

    @cached_property
    def work(self) -> PlannedWork:
        """What drivers, combines and carts need of the plan."""
        work = work_of(self.plan, self.grown)
        return replace(work, combines=self.scenario.combines.machines(), cart=self.scenario.carts)

    @property
    def crop(self) -> float | YieldMap:
        """What grows in fact [kg/m^2]."""
        return self.plan.supply.density if self.grown is None else self.grown

    @property
    def trucks(self) -> np.ndarray:
        """Where each cart stands at its truck: x, y, theta of the tractor, shape (K, 3)."""
        return self.plan.supply.trucks

    @property
    def reach(self) -> float:
        """From a combine's middle to that of the box beside it [m]."""
        return beside(self.scenario.combines, self.scenario.carts).left


def prepare_harvest(
    scenario: HarvestScenario,
    folder: Path = Path(),
    progress: Callable[[str, float], None] = lambda stage, share: None,
) -> HarvestJob:
    """Plan a harvest.

    Args:
        scenario: What is asked for.
        folder: Where the field's file is looked for.
        progress: Told what is done, and which part of it, in [0, 1].

    Raises:
        InvalidInput: The field cannot be read, or is too small for the header.
        NoPlan: None was found.
    """
    require_type("scenario", scenario, HarvestScenario)
    field = scenario.field.load(folder)
    density = scenario.yields.load(field, scenario.density, folder)
    grown = None
    if scenario.grown is not None:
        grown = scenario.grown.load(field, density, folder)
    plan = plan_scenario(scenario, field, density, scenario.disturbance.failure, progress)
    progress("schedule", 1.0)
    return HarvestJob(scenario, field, plan, _schedule(scenario, field, plan), grown)


def plan_scenario(
    scenario: HarvestScenario,
    field: Field,
    density: float | YieldMap,
    failure: Failure | None,
    progress: Callable[[str, float], None],
) -> HarvestPlan:
    """The plan of a scenario's machines.

    Args:
        scenario: What is asked for.
        field: Its field.
        density: Of the crop [kg/m^2].
        failure: Of a cart.
        progress: Told what is done, and which part of it, in [0, 1].

    Raises:
        InvalidInput: See `plan_harvest`.
        NoPlan: See `plan_harvest`.
    """
    _require_within_a_season(scenario, mean_density(density, field.polygon) * field.polygon.area)
    return plan_harvest(
        field,
        scenario.planned_combines(),
        scenario.planned_cart,
        carts=scenario.carts.count,
        density=density,
        truck_rate=scenario.carts.truck_rate,
        trucks=scenario.trucks.fleet(scenario.carts.count),
        strategy=scenario.strategy,
        threshold=scenario.threshold,
        visits=scenario.visits,
        pattern=scenario.pattern,
        seed=scenario.seed,
        failure=failure,
        progress=progress,
    )


def _require_within_a_season(scenario: HarvestScenario, grain: float) -> None:
    """Refuse tanks and augers so small that a plan, or what is reckoned of it, would never end.

    Args:
        scenario: What is asked for.
        grain: On the field [kg].
    """
    team, carts, trucks = scenario.combines.machines(), scenario.carts, scenario.trucks
    for name, room in (
        ("combines.capacity", min(combine.capacity for combine in team)),
        ("carts.capacity", carts.capacity),
        ("trucks.capacity", trucks.capacity),
    ):
        least = grain / MOST_LOADS
        what = f"hold at least {least:.4g} kg, a part in {MOST_LOADS} of the field's grain"
        require(room >= least, name, what, room)
    for name, rate in (
        ("combines.unload_rate", min(combine.unload_rate for combine in team)),
        ("carts.truck_rate", carts.truck_rate),
    ):
        least = grain / SEASON
        what = f"be at least {least:.4g} kg/s, with which the field's grain takes {_DAYS} days"
        require(rate >= least, name, what, rate)
    loads = grain / trucks.capacity / trucks.fleet(carts.count).count
    if loads > 0:
        most = SEASON / loads
        what = f"be at most {most:.4g} s, with which the field's grain takes {_DAYS} days"
        require(trucks.road_time <= most, "trucks.road_time", what, trucks.road_time)


def travel_times(team: CombinePlan, cart_speed: float, radius: float) -> np.ndarray:
    """How long a cart's ways between combines take at most, as far as the field tells.

    The greatest distance of two combines that work at one time, overtaking at the cart's speed,
    and a turn round; at most until all is cut, also for a cart that overtakes nobody, and meets
    combines only as they come back. Shape (N, N) [s].

    Args:
        team: Who works where and when.
        cart_speed: Of the carts [m/s].
        radius: Of a cart's turn [m].
    """
    count = len(team.paths)
    clock = np.linspace(0.0, team.makespan, 600)
    poses = [timed.pose_at(clock)[:, :2] for timed in team.paths]
    # Whoever has still to cut counts, on the way between two pieces of work too.
    working = [(clock >= timed.times[0]) & (clock < timed.end) for timed in team.paths]
    times = np.zeros((count, count))
    for n in range(count):
        for m, ahead in enumerate(team.machines):
            if n != m:
                gaps = np.hypot(*(poses[n] - poses[m]).T)[working[n] & working[m]]
                far = float(np.max(gaps, initial=0.0))
                way = far + math.tau * radius + SETTLE
                gains = cart_speed - ahead.speed
                overtakes = way / gains if gains > 0 else math.inf
                times[n, m] = min(overtakes, team.makespan)
    return times


def _schedule(scenario: HarvestScenario, field: Field, plan: HarvestPlan) -> ScheduleAnswer:
    team, carts = scenario.combines.machines(), scenario.carts
    count = len(team)
    density = mean_density(plan.supply.density, field.polygon)
    if scenario.travel_time is None:
        times = travel_times(plan.combines, carts.speed, carts.turning_radius)
    else:
        numbers = np.arange(count)
        times = scenario.travel_time * np.abs(numbers[:, None] - numbers)
    fleet = Fleet(
        capacities=tuple(combine.capacity for combine in team),
        fill_rates=tuple(combine.fill_rate(density) for combine in team),
        unload_rates=tuple(combine.unload_rate for combine in team),
        travel_times=tuple(tuple(float(t) for t in row) for row in times),
    )
    truck = None
    if math.isfinite(carts.capacity):
        corners = np.array(field.outline.exterior.coords)
        trucks = plan.supply.trucks[None, :, :2]
        far = np.hypot(*(corners[:, None] - trucks).reshape(-1, 2).T).max()
        truck = Truck(
            cart_capacity=carts.capacity,
            travel_time=float(far) / carts.speed,
            unload_rate=carts.truck_rate,
        )
    return answer_schedule(fleet, carts.count, truck, scenario.fill, neighbours=True)
