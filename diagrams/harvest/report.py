"""What a harvest leaves in its folder: numbers, log, plots and replay."""

import json
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from ...systems.numerics.harvest.audit.harvest_log import LOG_FILE, MACHINES_FILE
from ...systems.numerics.harvest.field.taskdata import NAME as TASKDATA_FILE
from ...systems.numerics.harvest.plan_files.plan_geojson import plan_geojson
from ...systems.numerics.harvest.plan_files.plan_taskdata import plan_taskdata
from ..visuals.replay import write_replay
from .colours import combine_colour
from .coverage_picture import draw_cut
from .driver_map import draw_map
from .run import HarvestRun
from .summary import UNITS, log_arrays, machines, planned_tanks
from .timetable_picture import draw_timetable

_TONNE = 1000.0
# As terminals look for it.
TASKDATA = f"TASKDATA/{TASKDATA_FILE}"


def write_harvest_report(run: HarvestRun, summary: dict[str, object], folder: Path) -> list[str]:
    """Write everything that is known of a run; return the names of the files.

    Args:
        run: A finished run; with a recording scene, a replay is written too.
        summary: From `summarise_harvest`.
        folder: Exists.
    """
    names = ["summary.json", LOG_FILE, MACHINES_FILE, "log_units.json", "loads.png", "field.png"]
    names += ["plan.geojson", TASKDATA, "timetable.png", "map.png"]
    (folder / names[0]).write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    np.savez_compressed(folder / names[1], **log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    (folder / names[2]).write_text(json.dumps(machines(run), indent=2) + "\n", encoding="utf-8")
    (folder / names[3]).write_text(json.dumps(UNITS, indent=2) + "\n", encoding="utf-8")
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
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return figure
