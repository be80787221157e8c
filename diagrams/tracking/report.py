"""What a tracking run leaves in its folder: numbers, log, plot and replay."""

import json
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..visuals.replay import write_replay
from ..world_picture import draw_world
from .run import TrackingRun
from .summary import log_arrays, units_of

# Colours of the members of a team, in order; Figure 2.6 has green, black and blue pursuers.
_PURSUERS = ("tab:green", "black", "tab:blue", "tab:purple", "tab:cyan", "tab:brown")


def write_tracking_report(run: TrackingRun, summary: dict[str, object], folder: Path) -> list[str]:
    """Write everything that is known of a run; return the names of the files.

    Args:
        run: A finished run; with a recording scene, a replay is written too.
        summary: From `summarise_tracking`.
        folder: Exists.
    """
    names = ["summary.json", "log.npz", "log_units.json", "tracks.png"]
    (folder / names[0]).write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    np.savez_compressed(folder / names[1], **log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    (folder / names[2]).write_text(json.dumps(units_of(run), indent=2) + "\n", encoding="utf-8")
    draw_tracks(run).savefig(folder / names[3], dpi=120)
    if run.scene is not None and run.scene.recording:
        write_replay(run.scene, folder / "replay.html", title="Sightfield: tracking")
        names.append("replay.html")
    return names


def draw_tracks(run: TrackingRun) -> Figure:
    """Draw where everyone went, and who was seen by how many, as a figure."""
    figure = Figure(figsize=(10, 5.4), layout="constrained")
    plan, sight = figure.subplots(1, 2, width_ratios=(3, 2))
    draw_world(plan, run.game.world)
    labels = run.game.scenario.pursuers.risk_vectors
    pursuers, evaders = (
        _on_the_picture(run.log[f"{team}_position"], run.game.world.boundary)
        for team in ("pursuer", "evader")
    )
    for i in range(pursuers.shape[1]):
        label = f"pursuer {i}" + (f", {labels[i]}" if len(labels) > 1 else "")
        colour = _PURSUERS[i % len(_PURSUERS)]
        plan.plot(*pursuers[:, i].T, color=colour, linewidth=1.2, label=label)
        plan.plot(*pursuers[-1, i], marker="o", color=colour, markersize=5)
    for j in range(evaders.shape[1]):
        label = "evaders" if j == 0 else None
        plan.plot(*evaders[:, j].T, color="tab:red", linewidth=1.2, label=label)
        plan.plot(*evaders[-1, j], marker="s", color="tab:red", markersize=5)
        viewers = run.log["visibility"][:, :, j].sum(axis=1)
        sight.step(run.times, viewers + 0.06 * j, where="post", label=f"evader {j}")
    plan.legend(loc="upper left", bbox_to_anchor=(0, -0.08), ncols=3, frameon=False)
    sight.set_xlabel("time [s]")
    sight.set_ylabel("pursuers that see the evader")
    sight.set_yticks(range(pursuers.shape[1] + 1))
    sight.legend(frameon=False)
    sight.grid(alpha=0.3)
    ended = "the horizon" if run.lost_evader is None else f"the loss of evader {run.lost_evader}"
    if "certificate" in run.log:
        _draw_certificate(sight, run)
    sight.set_title(f"{run.tracking_time:.2f} s, to {ended}")
    return figure


def _on_the_picture(positions: np.ndarray, boundary: np.ndarray) -> np.ndarray:
    """Positions, without those that are farther from the world than it is large."""
    low, high = boundary.min(axis=0), boundary.max(axis=0)
    size = np.max(high - low)
    near = ((positions >= low - size) & (positions <= high + size)).all(axis=-1, keepdims=True)
    return np.where(near, positions, np.nan)


def _draw_certificate(sight: Axes, run: TrackingRun) -> None:
    """Draw for how long all evaders can be kept, on an axis of its own."""
    kept = run.log["certificate"][:, 0]
    ever = np.isinf(kept)
    top = max(float(kept[~ever].max(initial=0.0)), 1.0)
    axis = sight.twinx()
    axis.plot(run.times, np.where(ever, np.nan, kept), color="tab:gray", linestyle="--")
    axis.plot(run.times, np.where(ever, 1.15 * top, np.nan), color="tab:gray", linewidth=3)
    axis.set_ylim(0.0, 1.25 * top)
    axis.set_ylabel("all can be kept for [s] (bar: for ever)", color="tab:gray")
