"""A harvest in a few numbers, and in arrays for whoever wants to look closer."""

import math

import numpy as np

from ...systems.numerics.harvest.driving.record import KIND, KINDS, LEAST, TAKES
from ...systems.numerics.harvest.machines.filling import (
    BLOCK_TIME,
    CUT,
    LOST,
    OVERFLOW_TIME,
    STANDING_MODES,
    STOP_TIME,
    TANK,
)
from ...systems.numerics.harvest.machines.outlines import cart_outline, combine_outline
from ...systems.numerics.harvest.machines.watching import (
    CART_TO_CART,
    CART_TO_COMBINE,
    COMBINE_TO_COMBINE,
    CROSSINGS,
    RECORD,
)
from .run import HarvestRun

# Routes that could be so short are not compared with their bound [s].
SHORTEST = 2.0

# Units of the arrays in the log; "1" for numbers without one.
UNITS = {
    "time": "s",
    "combine_pose": "m, m, rad",
    "combine_speed": "m/s",
    "tractor_pose": "m, m, rad",
    "trailer_pose": "m, m, rad",
    "tank": "kg",
    "cart_load": "kg",
    "cutting": "1",
    "delivered": "kg",
    "tank_planned": "kg",
    "station": "m",
    "mode": "1",
    "alongside": "1",
    "task": "1",
    "doing": "1",
}


def summarise(run: HarvestRun, scenario: str) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Args:
        run: A finished run.
        scenario: What to call it.

    Returns:
        scenario, strategy, combines, carts, field_area [m^2], harvested_area_fraction, finished,
        makespan [s], feasible (whether the plan is), grain_harvested, grain_delivered (to trucks),
        grain_in_carts, grain_in_tanks, grain_lost, grain_error (what is harvested beyond the sum
        of these) [kg], overflow_time (of all combines, spilling), combine_stop_time (standing
        full), combine_wait_time (held up by others) [s], cart_idle_fraction, crop_crossings (steps
        in which a cart was over standing crop), min_separation (least of the following),
        min_cart_to_combine, min_cart_to_cart, min_combine_to_combine [m], load_deviation (mean
        difference between tanks as simulated and as planned, in tanks), routes (how many of each
        kind: "car" and "optimal" are time-optimal for a car and for the cart, "search" was searched
        for, "aside" makes room), route_time_ratio_median and _worst (of the time on a route to one
        that certainly no route can beat, crop or not), wall_time [s].
    """
    job, account, record = run.job, run.account, run.record
    scenario_ = job.scenario
    harvested, lost = float(account[:, CUT].sum()), float(account[:, LOST].sum())
    delivered, loads = float(run.delivered.sum()), float(run.load.sum())
    tanks = float(account[:, TANK].sum())
    gaps = [record[k] for k in (CART_TO_COMBINE, CART_TO_CART, COMBINE_TO_COMBINE)]
    far = [float(gap) if math.isfinite(gap) else None for gap in gaps]
    apart = np.abs(run.log["tank"] - planned_tanks(run)).mean() / scenario_.combines.capacity
    return {
        "scenario": scenario,
        "strategy": scenario_.strategy,
        "combines": len(job.coverage.paths),
        "carts": scenario_.carts.count,
        "field_area": job.coverage.field.area,
        "harvested_area_fraction": harvested / scenario_.density / job.coverage.field.area,
        "finished": run.finished,
        "makespan": run.makespan,
        "feasible": job.answer.feasible,
        "grain_harvested": harvested,
        "grain_delivered": delivered,
        "grain_in_carts": loads,
        "grain_in_tanks": tanks,
        "grain_lost": lost,
        "grain_error": harvested - delivered - loads - tanks - lost,
        "overflow_time": float(account[:, OVERFLOW_TIME].sum()),
        "combine_stop_time": float(account[:, STOP_TIME].sum()),
        "combine_wait_time": float(account[:, BLOCK_TIME].sum()),
        "cart_idle_fraction": float(record[RECORD:].mean()) / run.makespan,
        "crop_crossings": int(record[CROSSINGS]),
        "min_separation": min((gap for gap in far if gap is not None), default=None),
        "min_cart_to_combine": far[0],
        "min_cart_to_cart": far[1],
        "min_combine_to_combine": far[2],
        "load_deviation": float(apart),
        **_routes_in_numbers(run.routes),
        "wall_time": run.wall_time,
    }


def _routes_in_numbers(routes: np.ndarray) -> dict[str, object]:
    kinds = routes[:, KIND].astype(int)
    names = {name: int((kinds == k).sum()) for k, name in enumerate(KINDS) if k > 0}
    counted = (routes[:, LEAST] >= SHORTEST) & (kinds != KINDS.index("aside"))
    ratios = routes[counted, TAKES] / routes[counted, LEAST]
    return {
        "routes": names,
        "route_time_ratio_median": float(np.median(ratios)) if len(ratios) else None,
        "route_time_ratio_worst": float(ratios.max()) if len(ratios) else None,
    }


def planned_tanks(run: HarvestRun) -> np.ndarray:
    """What the timetable says of every tank at the samples, shape (T, N) [kg]."""
    return np.stack([line(run.times) for line in run.job.timetable.tanks], axis=1)


def log_arrays(run: HarvestRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in UNITS, time first along every array's first axis.

    What an audit reads comes first: see `HarvestLog`.
    """
    log, team, cart = run.log, run.job.scenario.combines, run.job.scenario.carts
    gears = np.stack(
        [
            path.gears[np.clip(np.searchsorted(path.stations, at, side="right") - 1, 0, last)]
            for path, at in zip(run.job.coverage.paths, log["station"].T, strict=True)
            for last in [len(path.gears) - 1]
        ],
        axis=1,
    )
    drives = ~np.isin(log["mode"], STANDING_MODES)
    x, y, theta, beta = np.moveaxis(log["state"], -1, 0)
    heading = theta - beta
    return {
        "time": run.times,
        "combine_pose": log["pose"],
        "combine_speed": np.where(drives, gears * team.speed, 0.0),
        "tractor_pose": log["state"][..., :3],
        "trailer_pose": np.stack(
            [
                x - cart.hitch_offset * np.cos(theta) - cart.length * np.cos(heading),
                y - cart.hitch_offset * np.sin(theta) - cart.length * np.sin(heading),
                heading,
            ],
            axis=-1,
        ),
        "tank": log["tank"],
        "cart_load": log["load"],
        # The header is down whenever a combine drives forwards.
        "cutting": (drives & (gears > 0)).astype(float),
        "delivered": log["delivered"].sum(axis=1),
        "tank_planned": planned_tanks(run),
        **{name: log[name] for name in ("station", "mode", "alongside", "task", "doing")},
    }


def machines(run: HarvestRun) -> dict[str, object]:
    """The machines and the field of a run as an audit reads them, ready for JSON: see `Site`."""
    scenario, field = run.job.scenario, run.job.coverage.field
    team, cart = scenario.combines, scenario.carts
    combine_shape, cart_shape = combine_outline(team), cart_outline(cart)
    combine = {
        "header": combine_shape.header.tolist(),
        "body": combine_shape.body.tolist(),
        "capacity": team.capacity,
        "acceleration": team.acceleration,
        "turning_radius": team.turning_radius,
    }
    trailer = {
        "tractor": cart_shape.tractor.tolist(),
        "trailer": cart_shape.trailer.tolist(),
        "capacity": cart.capacity if math.isfinite(cart.capacity) else None,
        "acceleration": cart.acceleration,
        "lateral_acceleration": cart.lateral_acceleration,
        "turning_radius": cart.turning_radius,
    }
    part = {
        "boundary": field.world.boundary.tolist(),
        "holes": [ring.tolist() for ring in field.world.obstacles],
    }
    return {
        "combines": [combine] * len(run.job.coverage.paths),
        "carts": [trailer] * cart.count,
        "parts": [part],
        "margin": field.margin,
        "density": scenario.density,
    }
