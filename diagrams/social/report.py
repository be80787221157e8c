"""What a search leaves in its folder: a few numbers, log, plots and replay.

Among the plots is who was the pursuer's friend when, Figure 2.34.
"""

import itertools
import math
from pathlib import Path

import cv2
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.geometry.edge_index import build_edge_index, clearances
from ...systems.numerics.social.landmarks.landmark_pictures import (
    landmark_picture,
    marker_picture,
)
from ...systems.numerics.social.landmarks.maze import Maze
from ...systems.numerics.social.localisation.location import Location, Reading
from ...systems.numerics.social.recognition.picture_files import decode_picture
from ...systems.numerics.social.recognition.recognition import LandmarkDetection, Stance
from ...systems.numerics.social.recognition.references import MARKER
from ...systems.numerics.vision.estimation.pictures import save_picture
from ..outputs import write_json
from ..visuals.replay import write_replay
from ..world_picture import draw_world
from .crowd_layer import agent_rgb
from .run import SocialRun

# Units of the arrays in the log; "1" for numbers without one.
UNITS = {
    "time": "s",
    "pose": "m, m, rad",
    "connected": "1",
    "waiting": "1",
    "requests_sent": "1",
    "pictures_scanned": "1",
    "locations": "1",
    "evader_position": "m",
    "evader_covariance": "m^2",
    "located_at": "s",
    "route": "m",
}


def summarise_search(run: SocialRun, scenario: str, network: str = "memory") -> dict[str, object]:
    """The search in numbers, ready for JSON.

    Args:
        run: A finished one.
        scenario: What to call it.
        network: Which network it used.

    Returns:
        scenario, network, seed, agents (their number), seconds (horizon) [s];
        time_to_first_location (until the pursuer knew where the evader was, None if it never did)
        [s]; locations (how often the evader was located anew); location_error (of each location,
        from where the evader was in that picture: median and 90 % quantile, None without any) [m];
        tracking_error (of the estimate held, from where the evader was at the same time: median and
        90 % quantile from the first location on) [m]; pursuer_distance (from the evader, median
        from the first location on) [m]; connected_fraction (of the time, for each agent),
        all_connected_fraction; requests_sent, pictures_scanned; collisions (of robots with walls or
        each other: occasions, not samples), min_wall_gap and min_robot_gap (from rim to wall, from
        rim to rim) [m]; wall_time [s], realtime_factor.
    """
    game, log, times = run.game, run.log, run.times
    located = run.located
    known = log["located_at"] >= 0
    evader, pursuer = log["pose"][known, 1, :2], log["pose"][known, 0, :2]
    wall_gaps, robot_gaps = gaps(run)
    return {
        "scenario": scenario,
        "network": network,
        "seed": game.scenario.seed,
        "agents": game.scenario.agents.size,
        "seconds": game.scenario.seconds,
        "time_to_first_location": float(times[located[0]]) if len(located) else None,
        "locations": int(log["locations"][-1]),
        "location_error": _quantiles(run.location_errors),
        "tracking_error": _quantiles(np.hypot(*(log["evader_position"][known] - evader).T)),
        "pursuer_distance": float(np.median(np.hypot(*(pursuer - evader).T)))
        if known.any()
        else None,
        "connected_fraction": log["connected"].mean(axis=0).tolist(),
        "all_connected_fraction": float(log["connected"].all(axis=1).mean()),
        "requests_sent": int(log["requests_sent"][-1]),
        "pictures_scanned": int(log["pictures_scanned"][-1]),
        "collisions": _occasions(wall_gaps < 0) + _occasions(robot_gaps < 0),
        "min_wall_gap": float(wall_gaps.min()),
        "min_robot_gap": float(robot_gaps.min()),
        "wall_time": run.wall_time,
        "realtime_factor": float(times[-1]) / run.wall_time,
    }


def gaps(run: SocialRun) -> tuple[np.ndarray, np.ndarray]:
    """How near robots were: from each robot's rim to the walls, shape (T, N), and from rim to rim
    of each pair, shape (T, N (N - 1) / 2) [m]."""
    positions, radius = run.log["pose"][:, :, :2], run.game.maze.robot_radius
    index = build_edge_index(run.game.maze.world)
    walls = clearances(index, positions.reshape(-1, 2)).reshape(positions.shape[:2]) - radius
    pairs = itertools.combinations(range(positions.shape[1]), 2)
    between = [np.hypot(*(positions[:, i] - positions[:, j]).T) - 2 * radius for i, j in pairs]
    return walls, np.stack(between, axis=1)


def log_arrays(run: SocialRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in UNITS, time along every array's first axis."""
    return {"time": run.times, **run.log}


def _quantiles(errors: np.ndarray) -> dict[str, float] | None:
    if errors.size == 0:
        return None
    return {"median": float(np.median(errors)), "p90": float(np.quantile(errors, 0.9))}


def _occasions(touching: np.ndarray) -> int:
    """How often a touch begins, over all columns of samples, shape (T, n) bool."""
    return int((touching & ~np.vstack([np.zeros_like(touching[:1]), touching[:-1]])).sum())


_WAITING = "#b9bdc2"


def draw_connectivity(
    axes: Axes, times: np.ndarray, connected: np.ndarray, waiting: np.ndarray | None = None
) -> None:
    """Draw one band for each agent, filled while it is a friend, gray while it is asked.

    Args:
        axes: Where to; limits and labels are set.
        times: Samples, shape (T,) [s].
        connected: Shape (T, agents), bool.
        waiting: Same shape, bool; None draws friendships only.

    Source: Zhang 2014, Figure 2.34.
    """
    agents = connected.shape[1]
    for k in range(agents):
        bottom = agents - 1 - k
        for state, colour, height in (
            (None if waiting is None else waiting[:, k] & ~connected[:, k], _WAITING, 0.22),
            (connected[:, k], agent_rgb(k), 0.7),
        ):
            if state is None:
                continue
            spans = runs(times, state)
            axes.broken_barh(spans, (bottom + 0.5 - 0.5 * height, height), facecolors=colour)
        share = float(connected[:, k].mean())
        axes.text(1.01, bottom + 0.5, f"{100 * share:.0f} %", va="center",
                  transform=axes.get_yaxis_transform())  # fmt: skip
    axes.set_yticks(np.arange(agents) + 0.5, [f"agent {agents - k}" for k in range(agents)])
    axes.set_ylim(0, agents)
    axes.set_xlim(float(times[0]), float(times[-1]) if times[-1] > times[0] else times[0] + 1.0)
    axes.set_xlabel("time [s]")
    everyone = float(connected.all(axis=1).mean())
    axes.set_title(f"connectivity (Figure 2.34); all at once {100 * everyone:.0f} % of the time")
    axes.grid(axis="x", alpha=0.3)


def runs(times: np.ndarray, state: np.ndarray) -> list[tuple[float, float]]:
    """Start and duration of every stretch in which a state holds, sample by sample [s].

    Args:
        times: Of the samples, shape (n,) [s].
        state: Whether it holds, shape (n,).
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[0], state.astype(int), [0]])))
    ends = np.append(times, times[-1])
    return [(float(times[a]), float(ends[b] - times[a])) for a, b in edges.reshape(-1, 2).tolist()]


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
    write_json(folder / names[0], summary)
    np.savez_compressed(folder / names[1], **log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    write_json(folder / names[2], UNITS)
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


# Red, green, blue of landmarks, of those that are not trusted, and of the evader.
_LANDMARK, _DOUBTED, _MARKED = (0, 150, 60), (220, 130, 0), (225, 30, 40)
_PAPER, _INK = (250, 250, 250), (40, 40, 40)
# Drawn so many times larger than the picture, for thin lines.
_SCALE = 2
_THUMB, _GAP, _FOOT = 200, 16, 60
# At most so many of a subject's matches are drawn.
_LINES = 18
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def draw_detections(picture: np.ndarray, detections: tuple[LandmarkDetection, ...]) -> np.ndarray:
    """A picture with the outlines of what was recognised, each with its name.

    Args:
        picture: Red, green, blue, shape (height, width, 3), uint8; stays as it is.
        detections: Of `recognise`.
    """
    drawn = np.ascontiguousarray(picture).copy()
    _outline(drawn, detections, 1)
    return drawn


def draw_reading(reading: Reading, maze: Maze) -> np.ndarray:
    """A picture, its references below it with lines between matched points, and what it tells.

    Args:
        reading: Of `read_picture`.
        maze: Whose camera took it.

    Returns:
        Red, green, blue, shape (h, w, 3), uint8; grey with words if it is no picture.
    """
    camera = maze.camera
    width, height = _SCALE * camera.width, _SCALE * camera.height
    sheet = np.full((height + _THUMB + 2 * _GAP + _FOOT, width, 3), _PAPER, np.uint8)
    try:
        picture = decode_picture(reading.picture.data, camera.width, camera.height)
        sheet[:height] = cv2.resize(picture, (width, height), interpolation=cv2.INTER_LINEAR)
    except InvalidInput:
        sheet[:height] = 200
    detections = reading.recognition.detections
    room = max(1, (width - _GAP) // (_THUMB + _GAP))
    # From left to right as in the picture, so that few lines cross.
    in_order = sorted(detections, key=lambda each: float(each.corners[:, 0].mean()))
    for k, each in enumerate(in_order[:room]):
        left, top = _GAP + k * (_THUMB + _GAP), height + _GAP
        known = marker_picture() if each.subject == MARKER else landmark_picture(each.subject)
        sheet[top : top + _THUMB, left : left + _THUMB] = cv2.resize(
            known, (_THUMB, _THUMB), interpolation=cv2.INTER_AREA
        )
        shown = np.linspace(0, len(each.places) - 1, min(_LINES, len(each.places))).astype(int)
        ends = np.rint(each.places[shown] * _THUMB + [left, top]).astype(int)
        starts = np.rint(_on_sheet(each.pixels[shown])).astype(int)
        for start, end in zip(starts.tolist(), ends.tolist(), strict=True):
            cv2.line(sheet, start, end, _colour(each), 1, cv2.LINE_AA)
            cv2.circle(sheet, start, 3, _colour(each), 1, cv2.LINE_AA)
    _outline(sheet, detections, _SCALE)
    place = (_GAP, sheet.shape[0] - 20)
    cv2.putText(sheet, _words(reading), place, _FONT, 0.75, _INK, 1, cv2.LINE_AA)
    return sheet


def _on_sheet(pixels: np.ndarray) -> np.ndarray:
    """Where pixels are on the enlarged picture, whose pixels' centres count from 0 as well."""
    return _SCALE * (pixels + 0.5) - 0.5


def _outline(sheet: np.ndarray, detections: tuple[LandmarkDetection, ...], scale: int) -> None:
    fine = 16
    for each in detections:
        corners = scale * (each.corners + 0.5) - 0.5
        points = np.clip(np.rint(corners * fine), -(2**20), 2**20).astype(np.int32)
        cv2.polylines(sheet, [points], True, _colour(each), scale, cv2.LINE_AA, 4)
        name = "evader" if each.subject == MARKER else str(each.subject)
        # Above its top edge, and inside the picture.
        x, y = corners.min(axis=0)
        place = (max(int(x), 2), max(int(y) - 5, 9 * scale + 4))
        for colour, width in ((_PAPER, 3 * scale), (_colour(each), scale)):
            cv2.putText(sheet, name, place, _FONT, 0.4 * scale, colour, width, cv2.LINE_AA)


def _colour(detection: LandmarkDetection) -> tuple[int, int, int]:
    if detection.subject == MARKER:
        return _MARKED
    return _LANDMARK if detection.stance is Stance.UPRIGHT else _DOUBTED


def _words(reading: Reading) -> str:
    location: Location = reading.location
    who = f"agent {reading.picture.agent + 1}"
    start = f"{who}, {reading.picture.time:.1f} s: {location.outcome.words}"
    if location.outcome.has_location:
        x, y = location.position
        doubt = math.sqrt(float(np.linalg.eigvalsh(location.covariance)[-1]))
        start += f" at ({x:.3f}, {y:.3f}) m, +- {1000 * doubt:.0f} mm"
    if location.camera is not None:
        x, y, heading = location.camera.pose
        start += f"; camera at ({x:.3f}, {y:.3f}) m, {math.degrees(heading):.1f} deg"
    return start
