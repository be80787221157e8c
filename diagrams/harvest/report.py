"""What a harvest leaves in its folder: numbers, arrays, log, plots and replay."""

import json
import math
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ...systems.numerics.harvest.audit.audit import audit_harvest
from ...systems.numerics.harvest.audit.harvest_log import (
    ARRAYS,
    LOG_FILE,
    MACHINES_FILE,
    HarvestLog,
    site_of,
)
from ...systems.numerics.harvest.carts.cart_motion import trailer_poses
from ...systems.numerics.harvest.field.field_files import TASKDATA_FILE
from ...systems.numerics.harvest.field.yield_map import YieldMap, known_part
from ...systems.numerics.harvest.machines import (
    DONE,
    FULL,
    LOST,
    OVERFLOW_TIME,
    cart_outline,
    combine_outline,
)
from ...systems.numerics.harvest.plan.plan_files import plan_geojson, plan_taskdata
from ..outputs import write_json
from ..visuals.replay import write_replay
from .colours import combine_colour
from .driver_map import draw_map
from .pictures import draw_cut, draw_timetable
from .run import HarvestRun

# What a combine may be beside the place where it is to wait for a cart [m].
AT_STOP = 0.5
# Slower is standing [m/s].
SLOW = 1e-3

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
    "late": "s",
}

_TONNE = 1000.0
# As terminals look for it.
TASKDATA = f"TASKDATA/{TASKDATA_FILE}"


def summarise_harvest(run: HarvestRun, scenario: str) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Distances, crop under bodies and the faults are those of the audit of the log.

    Args:
        run: A finished run.
        scenario: What to call it.

    Returns:
        scenario, strategy, pattern, combines, carts, field_area [m^2], yields_known (part of the
        field of which a file of yields tells; null without one), coverage (part of the crop that
        was cut), finished (whether all was cut that the plan cuts, and all grain delivered),
        stopped (why not), audit_faults (how many), makespan (until the last grain was delivered)
        and makespan_planned [s], makespan_over_bound (the combines' time over that of headers that
        are always full, at top speed), path_over_bound (the same of their way), waiting (part of
        the combines' time that they stand for others), combine_wait_time, combine_stop_time
        (standing for a cart, all combines together) [s], min_combine_to_combine,
        min_cart_to_combine, min_cart_to_cart, min_to_obstacle [m], crop_under_bodies [m^2],
        feasible (whether the closed forms say that the carts suffice), unloads, unloads_missed (for
        which a combine had to stop), trips, grain_harvested, grain_delivered, grain_in_carts,
        grain_in_tanks, grain_lost, grain_error (what is harvested beyond the sum of these) [kg],
        overflow_time (of all combines, spilling) [s], cart_idle_fraction (neither driving nor
        taking or giving grain), load_deviation (mean difference between tanks as simulated and as
        planned, in tanks), latest (how late a machine was at most), wall_time [s].
    """
    job, scenario_ = run.job, run.job.scenario
    team, coverage = scenario_.combines, run.job.plan.combines.coverage
    arrays = log_arrays(run)
    log = HarvestLog(**{name: arrays[name] for name in ARRAYS})
    audit = audit_harvest(log, site_of(machines(run)))
    found = audit.figures
    harvested, lost = float(run.harvested.sum()), float(run.account[:, LOST].sum())
    delivered, loads = float(run.delivered.sum()), float(run.load.sum())
    tanks = float(run.log["tank"][-1].sum())
    working = run.log["mode"] != DONE
    ended = float(run.times[np.flatnonzero(working.any(axis=1)).max(initial=0)])
    each = job.work.combines
    full = job.field.area / team.header_width
    tank_sizes = np.array([combine.capacity for combine in each])
    stops, waits = _standing(run)
    apart = (np.abs(run.log["tank"] - arrays["tank_planned"]) / tank_sizes).mean()
    pours = run.log["alongside"] >= 0
    return {
        "scenario": scenario,
        "strategy": scenario_.strategy,
        "pattern": scenario_.pattern,
        "combines": team.count,
        "carts": scenario_.carts.count,
        "field_area": job.field.area,
        "yields_known": known_part(job.plan.supply.density),
        "coverage": found["coverage"],
        "finished": run.finished,
        "stopped": run.stopped,
        "audit_faults": len(audit.faults),
        "makespan": run.makespan,
        "makespan_planned": job.work.end,
        "makespan_over_bound": ended / (full / sum(combine.speed for combine in each)),
        "path_over_bound": coverage.length / full,
        "waiting": waits / (ended * team.count) if ended > 0 else 0.0,
        "combine_wait_time": waits,
        "combine_stop_time": stops,
        **{
            name: found[name]
            for name in (
                "min_combine_to_combine",
                "min_cart_to_combine",
                "min_cart_to_cart",
                "min_to_obstacle",
                "crop_under_bodies",
            )
        },
        "feasible": job.answer.feasible,
        "unloads": int((pours[1:] & ~pours[:-1]).sum()),
        "unloads_missed": len(job.plan.service.stops),
        "trips": len(job.plan.service.trips),
        "grain_harvested": harvested,
        "grain_delivered": delivered,
        "grain_in_carts": loads,
        "grain_in_tanks": tanks,
        "grain_lost": lost,
        "grain_error": harvested - delivered - loads - tanks - lost,
        "overflow_time": float(run.account[:, OVERFLOW_TIME].sum()),
        "cart_idle_fraction": _idle(run),
        "load_deviation": float(apart),
        "latest": float(run.log["late"].max(initial=0.0)),
        "wall_time": run.wall_time,
    }


def _standing(run: HarvestRun) -> tuple[float, float]:
    """How long combines stand for carts, and for others, all together [s]."""
    stations, lasting = run.log["station"], np.diff(run.times)
    stands = (run.log["speed"] < SLOW) & (run.log["mode"] != DONE)
    stands &= (stations[-1] > 0) & (np.diff(stations, axis=0, append=stations[-1:]) < SLOW)
    for_cart = run.log["mode"] == FULL
    for stop in run.job.plan.service.stops:
        for_cart[:, stop.combine] |= np.abs(stations[:, stop.combine] - stop.station) < AT_STOP
    stops = float(((stands & for_cart)[:-1] * lasting[:, None]).sum())
    waits = float(((stands & ~for_cart)[:-1] * lasting[:, None]).sum())
    return stops, waits


def _idle(run: HarvestRun) -> float:
    """Part of the time in which a cart neither drives nor takes or gives grain."""
    moves = np.hypot(*np.moveaxis(np.diff(run.log["state"][..., :2], axis=0), -1, 0)) > SLOW
    numbers = np.arange(moves.shape[1])
    takes = (run.log["alongside"][:-1, :, None] == numbers).any(axis=1)
    gives = run.log["emptying"][:-1] > 0.5
    return float(1.0 - (moves | takes | gives).mean())


def planned_tanks(run: HarvestRun) -> np.ndarray:
    """What the plan says of every tank at the samples, shape (T, N) [kg]."""
    return run.job.work.tanks_at(run.times)


def log_arrays(run: HarvestRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in UNITS, time first along every array's first axis.

    What an audit reads comes first: see `HarvestLog`.
    """
    log, cart = run.log, run.job.scenario.carts
    paths = [plan.path for plan in run.job.plan.service.plans]
    gears = [
        path.gears[path.piece_at(at)] if len(path.gears) else np.ones(len(at))
        for path, at in zip(paths, log["station"].T, strict=True)
    ]
    tractor = log["state"][..., :3]
    trailer = trailer_poses(tractor.reshape(-1, 3), log["state"][..., 3].ravel(), cart)
    return {
        "time": run.times,
        "combine_pose": log["pose"],
        "combine_speed": np.stack(gears, axis=1) * log["speed"],
        "tractor_pose": tractor,
        "trailer_pose": trailer.reshape(tractor.shape),
        "tank": log["tank"],
        "cart_load": log["load"],
        "cutting": log["cutting"],
        "delivered": log["delivered"].sum(axis=1),
        "tank_planned": planned_tanks(run),
        **{name: log[name] for name in ("station", "mode", "alongside", "late")},
    }


def machines(run: HarvestRun) -> dict[str, object]:
    """The machines and the field of a run as an audit reads them, ready for JSON: see `Site`."""
    scenario, field = run.job.scenario, run.job.field
    team, cart = scenario.combines, scenario.carts
    combine_shape, cart_shape = combine_outline(team), cart_outline(cart)
    combines = [
        {
            "header": combine_shape.header.tolist(),
            "body": combine_shape.body.tolist(),
            "capacity": combine.capacity,
            "acceleration": combine.acceleration,
            "turning_radius": combine.turning_radius,
        }
        for combine in run.job.work.combines
    ]
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
        "no_go": [list(map(list, each.exterior.coords)) for each in field.no_go],
    }
    return {
        "combines": combines,
        "carts": [trailer] * cart.count,
        "parts": [part],
        "margin": field.margin,
        **_crop(run.job.crop),
    }


def _crop(crop: float | YieldMap) -> dict[str, object]:
    """What grows, as an audit reads it."""
    if not isinstance(crop, YieldMap):
        return {"density": crop}
    values = np.round(crop.values, 5).tolist()
    return {"yields": {"corner": crop.corner.tolist(), "side": crop.side, "values": values}}


def write_harvest_report(run: HarvestRun, summary: dict[str, object], folder: Path) -> list[str]:
    """Write everything that is known of a run; return the names of the files.

    Args:
        run: A finished run; with a recording scene, a replay is written too.
        summary: From `summarise_harvest`.
        folder: Exists.
    """
    names = ["summary.json", LOG_FILE, MACHINES_FILE, "log_units.json", "loads.png", "field.png"]
    names += ["plan.geojson", TASKDATA, "timetable.png", "map.png"]
    write_json(folder / names[0], summary)
    np.savez_compressed(folder / names[1], **log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    write_json(folder / names[2], machines(run))
    write_json(folder / names[3], UNITS)
    draw_tank_loads(run).savefig(folder / names[4], dpi=120)
    draw_field(run).savefig(folder / names[5], dpi=120)
    plan = run.job.plan
    text = json.dumps(plan_geojson(plan), ensure_ascii=False)
    (folder / names[6]).write_text(text + "\n", encoding="utf-8")
    (folder / names[7]).parent.mkdir()
    (folder / names[7]).write_bytes(plan_taskdata(plan))
    draw_timetable(run.job).savefig(folder / names[8], dpi=120)
    draw_map(run.job).savefig(folder / names[9], dpi=150)
    if run.scene is not None:
        write_replay(run.scene, folder / "replay.html", title="Sightfield: harvest")
        names.append("replay.html")
    return names


def draw_tank_loads(run: HarvestRun) -> Figure:
    """Loads against time, as simulated and as planned, a row for each tank and one for carts."""
    tanks, planned = run.log["tank"] / _TONNE, planned_tanks(run) / _TONNE
    minutes, count = run.times / 60, tanks.shape[1]
    figure = Figure(figsize=(11, 1.6 * (count + 1) + 0.8), layout="constrained")
    axes = figure.subplots(count + 1, 1, sharex=True, squeeze=False)[:, 0]
    for n, combine in enumerate(run.job.work.combines):
        capacity = combine.capacity / _TONNE
        axes[n].plot(minutes, tanks[:, n], color=combine_colour(n), label="simulated")
        axes[n].plot(minutes, planned[:, n], "--", color="0.4", linewidth=0.9, label="planned")
        axes[n].axhline(capacity, color="0.7", linewidth=0.8)
        axes[n].set_ylim(0, 1.08 * capacity)
        axes[n].set_ylabel(f"combine {n}\n[t]")
        axes[n].grid(alpha=0.3)
    axes[0].legend(frameon=False, loc="upper right", ncols=2)
    for k in range(run.log["load"].shape[1]):
        axes[-1].plot(minutes, run.log["load"][:, k] / _TONNE, label=f"cart {k}")
    axes[-1].set_ylabel("carts\n[t]")
    axes[-1].set_xlabel("time [min]")
    axes[-1].grid(alpha=0.3)
    axes[-1].legend(frameon=False, loc="upper left", ncols=4)
    return figure


def draw_field(run: HarvestRun) -> Figure:
    """The field as it was cut, with the combines' paths and the ways of the carts."""
    job = run.job
    figure = Figure(figsize=(10, 7), layout="constrained")
    axes = figure.subplots()
    colours = [combine_colour(n) for n in range(job.scenario.combines.count)]
    draw_cut(axes, job.field, job.work.cut, colours)
    for n, colour in enumerate(colours):
        axes.plot(*run.log["pose"][:, n, :2].T, color=colour, linewidth=0.8, label=f"combine {n}")
    shades = matplotlib.colormaps["Greys"](np.linspace(0.9, 0.5, run.log["state"].shape[1]))
    for k, shade in enumerate(shades):
        way = run.log["state"][:, k, :2]
        axes.plot(*way.T, color=shade, linewidth=0.7, label=f"cart {k}")
        axes.plot(*job.trucks[k, :2], marker="s", color=shade, markersize=7)
    axes.plot([], [], "s", color="gray", markersize=7, label="truck")
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure
