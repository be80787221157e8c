"""What a search leaves in its folder: numbers, log, plots and replay."""

import json
from pathlib import Path

import cv2
import numpy as np
from matplotlib.figure import Figure

from ...systems.numerics.vision.estimation.pictures import save_picture
from ..visuals.replay import write_replay
from ..world_picture import draw_world
from .connectivity_picture import draw_connectivity
from .pictures.matches import draw_reading
from .run import SocialRun
from .scene.palette import agent_rgb
from .summary import UNITS, log_arrays

_PURSUER, _EVADER = "#215fcc", "#d92e33"
# Pictures shown with their matches.
_SHEETS = 6


def write_search_report(run: SocialRun, summary: dict[str, object], folder: Path) -> list[str]:
    """Write everything that is known of a search; return the names of the files.

    Args:
        run: A finished one; with a recording scene, a replay is written too.
        summary: From `summarise_search`.
        folder: Exists.
    """
    names = ["summary.json", "log.npz", "log_units.json", "connectivity.png", "search.png"]
    (folder / names[0]).write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
    np.savez_compressed(folder / names[1], **log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    (folder / names[2]).write_text(json.dumps(UNITS, indent=2) + "\n", encoding="utf-8")
    connectivity = Figure(figsize=(9, 1.4 + 0.6 * run.game.scenario.agents.size))
    connectivity.set_layout_engine("constrained")
    log = run.log
    draw_connectivity(connectivity.subplots(), run.times, log["connected"], log["waiting"])
    connectivity.savefig(folder / names[3], dpi=120)
    draw_search(run).savefig(folder / names[4], dpi=120)
    if run.readings:
        names.append("matches.png")
        save_picture(folder / names[-1], draw_matches(run))
    if run.scene is not None and run.scene.recording:
        write_replay(run.scene, folder / "replay.html", title="Sightfield: social search")
        names.append("replay.html")
    return names


def draw_matches(run: SocialRun) -> np.ndarray:
    """The pictures that told most, with their matches and references, two in a row.

    Those that located the evader come first, then those that showed most; earlier ones first.

    Returns:
        Red, green, blue, shape (h, w, 3), uint8.
    """
    ranked = sorted(
        run.readings,
        key=lambda each: (
            not each.location.outcome.has_location,
            -len(each.recognition.detections),
        ),
    )
    chosen = sorted(ranked[:_SHEETS], key=lambda each: each.picture.time)
    sheets = [draw_reading(each, run.game.maze) for each in chosen]
    if len(sheets) % 2:
        sheets.append(np.full_like(sheets[0], 255))
    rows = [np.hstack(sheets[k : k + 2]) for k in range(0, len(sheets), 2)]
    whole = np.vstack(rows)
    return cv2.resize(whole, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


def draw_search(run: SocialRun) -> Figure:
    """Draw where everyone went, where the evader was located, and how well it was known."""
    figure = Figure(figsize=(12, 6), layout="constrained")
    axes = figure.subplot_mosaic([["plan", "errors"], ["plan", "pictures"]], width_ratios=(1, 1))
    _draw_plan(axes["plan"], run)
    times, log = run.times, run.log
    known = log["located_at"] >= 0
    evader = log["pose"][:, 1, :2]
    held = np.hypot(*(log["evader_position"] - evader).T)
    distance = np.hypot(*(log["pose"][:, 0, :2] - evader).T)
    deviation = np.sqrt(np.where(known, np.trace(log["evader_covariance"], axis1=1, axis2=2), 0))
    errors = axes["errors"]
    errors.plot(times, distance, color=_PURSUER, label="pursuer to evader")
    errors.plot(times, np.where(known, held, np.nan), color=_EVADER, label="estimate to evader")
    shown = np.where(known, np.minimum(deviation, distance.max()), np.nan)
    errors.plot(times, shown, "--", color=_EVADER, linewidth=0.8, label="its deviation")
    k = run.located
    errors.plot(times[k], run.location_errors, "o", color="black", markersize=4,
                label="error of a location")  # fmt: skip
    errors.set_ylabel("distance [m]")
    errors.legend(frameon=False)
    pictures = axes["pictures"]
    pictures.step(times, log["pictures_scanned"], where="post", label="pictures read")
    pictures.step(times, log["requests_sent"], where="post", label="requests sent")
    pictures.step(times, log["locations"], where="post", label="times located")
    pictures.set_xlabel("time [s]")
    pictures.legend(frameon=False)
    for each in (errors, pictures):
        each.set_xlim(times[0], times[-1])
        each.grid(alpha=0.3)
    return figure


def _draw_plan(plan, run: SocialRun) -> None:
    """The maze from above, with all tracks."""
    maze = run.game.maze
    draw_world(plan, maze.world, corners=False)
    for each in maze.landmarks:
        ends = each.corners[:2, :2]
        plan.plot(*ends.T, color="#22262e", linewidth=4, solid_capstyle="butt")
    poses = run.log["pose"][:, :, :2]
    tracks = [(0, _PURSUER, "pursuer", 1.6), (1, _EVADER, "evader", 1.6)]
    tracks += [(k + 2, agent_rgb(k), f"agent {k + 1}", 0.7) for k in range(poses.shape[1] - 2)]
    for robot, colour, name, width in tracks:
        plan.plot(*poses[:, robot].T, color=colour, linewidth=width, label=name)
        plan.plot(*poses[-1, robot], "o", color=colour, markersize=6)
    k = run.located
    plan.plot(*run.log["evader_position"][k].T, "x", color="black", markersize=7,
              label="evader located")  # fmt: skip
    plan.legend(loc="upper left", bbox_to_anchor=(0, -0.08), ncols=3, frameon=False)
