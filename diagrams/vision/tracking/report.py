"""What a run of tracking on pictures leaves in its folder: numbers, log, plots and replay."""

import json
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ...tracking.report import draw_tracks
from ...visuals.replay import write_replay
from .run import PictureRun
from .summary import PICTURE_UNITS, picture_log_arrays
from .sweep import WeightSweep


def write_picture_report(run: PictureRun, summary: dict[str, object], folder: Path) -> list[str]:
    """Write everything that is known of a run; return the names of the files.

    Args:
        run: A finished run; with a recording scene, a replay is written too.
        summary: From `summarise_picture_tracking`.
        folder: Exists.
    """
    names = ["summary.json", "log.npz", "log_units.json", "tracks.png", "estimates.png"]
    (folder / names[0]).write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    np.savez_compressed(folder / names[1], **picture_log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    (folder / names[2]).write_text(json.dumps(PICTURE_UNITS, indent=2) + "\n", encoding="utf-8")
    draw_tracks(run.tracking).savefig(folder / names[3], dpi=120)
    draw_estimates(run).savefig(folder / names[4], dpi=120)
    if run.tracking.scene is not None and run.tracking.scene.recording:
        write_replay(run, folder / "replay.html", title="Sightfield: tracking on pictures")
        names.append("replay.html")
    return names


def draw_estimates(run: PictureRun) -> Figure:
    """Draw how far estimates are off, and how far away pursuers keep, over time."""
    figure = Figure(figsize=(8, 5.4), layout="constrained")
    errors, distances = figure.subplots(2, 1, sharex=True)
    times, log = run.tracking.times, run.tracking.log
    shells = run.game.scenario.vision.evader_shells
    for j, shell in enumerate(shells):
        colour = np.array(shell.colour) / 255
        errors.plot(times, 1000 * run.errors[:, j], color=colour, label=f"evader {j}")
        seen = run.valid[:, :, j].any(axis=1)
        errors.plot(times[~seen], 0 * times[~seen], "|", color=colour, markersize=8)
    errors.set_ylabel("estimate off by [mm]")
    errors.set_title("distance of the joint estimate from the truth; ticks: no picture gave one")
    errors.legend(frameon=False)
    for i in range(log["pursuer_position"].shape[1]):
        offsets = log["evader_position"] - log["pursuer_position"][:, [i]]
        for j, shell in enumerate(shells):
            own = np.where(
                log["assignment"][:, i] == j, np.linalg.norm(offsets[:, j], axis=1), np.nan
            )
            label = f"pursuer {i} to evader {j}" if np.isfinite(own).any() else None
            style = ("-", "--", "-.", ":")[i % 4]
            distances.plot(times, own, style, color=np.array(shell.colour) / 255, label=label)
    distances.set_ylabel("distance [m]")
    distances.set_xlabel("time [s]")
    distances.set_ylim(bottom=0)
    distances.legend(frameon=False)
    for axes in (errors, distances):
        axes.grid(alpha=0.3)
    return figure


def write_sweep(sweep: WeightSweep, folder: Path) -> list[str]:
    """Write a sweep's table and plot; return the names of the files."""
    names = ["weights.json", "weights.png"]
    tree = {
        "seeds": sweep.seeds.tolist(),
        "means": sweep.table(),
        "runs": {
            name: [[None if np.isnan(v) else v for v in row] for row in each.tolist()]
            for name, each in sweep.values.items()
        },
        "censored": sweep.censored.tolist(),
    }
    (folder / names[0]).write_text(json.dumps(tree, indent=2) + "\n", encoding="utf-8")
    draw_sweep(sweep).savefig(folder / names[1], dpi=120)
    return names


def draw_sweep(sweep: WeightSweep) -> Figure:
    """Draw tracking time, error and distance against the weight."""
    figure = Figure(figsize=(10, 3.4), layout="constrained")
    panels = figure.subplots(1, 3)
    for axes, name, label in zip(
        panels,
        ("tracking_time", "estimation_error_rms", "mean_distance"),
        ("tracking time [s]", "estimation error, rms [m]", "distance to own evader [m]"),
        strict=True,
    ):
        values = sweep.values[name]
        axes.plot(sweep.weights, values, ".", color="tab:gray", markersize=4)
        if name == "tracking_time" and sweep.censored.any():
            places = np.broadcast_to(sweep.weights[:, None], values.shape)
            axes.plot(
                places[sweep.censored],
                values[sweep.censored],
                "^",
                mfc="none",
                color="tab:red",
                label="at least: never lost",
            )
            axes.legend(loc="lower right", fontsize=8)
        means = [row[name] for row in sweep.table()]
        axes.plot(sweep.weights, np.array(means, dtype=float), "o-", color="tab:blue")
        axes.set_xlabel("weight w of the pursuit field (2.7)")
        axes.set_ylabel(label)
        axes.set_ylim(0, 1.08 * max(float(np.nanmax(values, initial=0.0)), 1e-3))
        axes.grid(alpha=0.3)
    return figure
