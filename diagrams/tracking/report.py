"""What a tracking run leaves in its folder: numbers, log, plot and replay."""

import json
from dataclasses import asdict
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...systems.numerics.geometry.edge_index import build_edge_index, clearances
from ...systems.numerics.tracking.collision_stop import (
    count_contacts,
    gaps_between_samples,
    pair_gaps,
)
from ..outputs import write_json
from ..rosbag.bag import RosBag
from ..visuals.replay import write_replay
from ..world_picture import draw_world
from .promises import audit_promises
from .run import TrackingRun

# Units of the arrays in the log; "1" for numbers without one.
UNITS = {
    "time": "s",
    "pursuer_position": "m",
    "evader_position": "m",
    "visibility": "1",
    "assignment": "1",
    "pursuer_velocity": "m/s",
    "evader_velocity": "m/s",
    "body_gap": "m",
}
# Of what is logged where the solved visibility game is looked up.
CERTIFICATE_UNITS = {"certificate": "s", "guaranteed_time": "s", "withdrawn": "1"}


def summarise_tracking(run: TrackingRun, scenario: str) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Args:
        run: A finished run.
        scenario: What to call it.

    Returns:
        scenario, seed, pursuers, evaders (team sizes), seconds (horizon) [s], period [s],
        tracking_time (until some evader is seen by nobody; the end of the run if never) [s],
        censored (whether the run ended first), lost_evader (number or None), assignment_changes
        (a pursuer's change of evader from one sample to the next), min_clearance (least distance
        of a robot's centre from a true obstacle) [m], min_body_gap (least gap of two bodies, at
        samples and between them, negative where they overlap; None with a single robot) [m],
        contacts (how often two bodies came to overlap), bodies (whether robots keep off one
        another), robot_radius (of the pursuers), evader_radius [m], commands_reversed (a
        pursuer's desired velocity turned by more than a right angle from one sample to the next),
        wall_time [s], realtime_factor. Where the solved visibility game is looked up also
        certificate: for how long all evaders could be kept in sight at the start, None for ever
        [s]; certified, whether that was by the lower bound; and certificate_withdrawn: how often a
        pursuer's promise was withdrawn because it was deflected; broken_promise: the first promise
        that was not kept though it stood, in words, empty where all were. The latter two are None
        where it was by the middle bound.
    """
    game, log = run.game, run.log
    centres = np.concatenate([log["pursuer_position"], log["evader_position"]], axis=1)
    gaps = clearances(build_edge_index(game.world), centres.reshape(-1, 2))
    bodies = gaps_between_samples(centres, game.radii)
    wishes = log["pursuer_velocity"]
    reversals = (np.einsum("tik,tik->ti", wishes[1:], wishes[:-1]) < 0).sum()
    summary = {
        "scenario": scenario,
        "seed": game.scenario.seed,
        "pursuers": game.scenario.pursuers.size,
        "evaders": game.scenario.evaders.size,
        "seconds": game.scenario.seconds,
        "period": game.scenario.period,
        "tracking_time": run.tracking_time,
        "censored": run.lost_evader is None,
        "lost_evader": run.lost_evader,
        "assignment_changes": int((np.diff(log["assignment"], axis=0) != 0).sum()),
        "commands_reversed": int(reversals),
        "min_clearance": float(gaps.min()),
        "min_body_gap": float(bodies.min()) if bodies.size else None,
        "contacts": count_contacts(bodies),
        "bodies": game.scenario.has_bodies,
        "robot_radius": game.scenario.pursuers.radius,
        "evader_radius": game.scenario.evaders.radius,
        "wall_time": run.wall_time,
        "realtime_factor": float(run.times[-1]) / run.wall_time,
    }
    return summary | _certificate_of(run)


def _certificate_of(run: TrackingRun) -> dict[str, object]:
    """What the log says of the certificate; nothing where there is none."""
    if "certificate" not in run.log:
        return {}
    first = float(run.log["certificate"][0, 0])
    promises = audit_promises(run) if "withdrawn" in run.log else None
    return {
        "certificate": first if np.isfinite(first) else None,
        "certified": promises is not None,
        "certificate_withdrawn": None if promises is None else promises.withdrawn,
        "broken_promise": None if promises is None else promises.breach,
    }


def units_of(run: TrackingRun) -> dict[str, str]:
    """Units of the arrays in a run's log: UNITS, and of CERTIFICATE_UNITS what was logged."""
    return UNITS | {name: unit for name, unit in CERTIFICATE_UNITS.items() if name in run.log}


def log_arrays(run: TrackingRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in `units_of`, time first along every array's first axis."""
    centres = np.concatenate([run.log["pursuer_position"], run.log["evader_position"]], axis=1)
    gaps = pair_gaps(centres, run.game.radii).min(axis=1, initial=np.inf)
    return {"time": run.times, **run.log, "body_gap": gaps}


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
    write_json(folder / names[0], summary)
    np.savez_compressed(folder / names[1], **log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    write_json(folder / names[2], units_of(run))
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


TEAMS = ("pursuer", "evader")


def write_tracking_rosbag(run: TrackingRun, path: Path) -> None:
    """Write a run: `/world`, `/tf`, each robot's velocity, and every array of the log.

    Robots are points to the log: their frames `pursuer_0`, ... are never turned. The arrays of
    `log.npz` are in `/log/<name>`, the same to the last bit.

    Args:
        run: A finished run.
        path: Of the MCAP file; must not exist.

    Raises:
        InvalidInput: The file exists, cannot be written, or the extra is not installed.
    """
    about = {"scenario": asdict(run.game.scenario), "units": units_of(run)}
    arrays = {name: values for name, values in log_arrays(run).items() if name != "time"}
    with RosBag(path) as bag:
        bag.about(json.dumps(about))
        bag.world(run.game.world)
        for sample, time in enumerate(run.times.tolist()):
            bag.transforms(
                time,
                {
                    f"{team}_{number}": (x, y, 0.0)
                    for team in TEAMS
                    for number, (x, y) in enumerate(run.log[f"{team}_position"][sample])
                },
            )
            for team in TEAMS:
                for number, (vx, vy) in enumerate(run.log[f"{team}_velocity"][sample]):
                    bag.twist(f"/{team}_{number}/velocity", time, "world", vx, vy, 0.0)
            for name, values in arrays.items():
                bag.numbers(f"/log/{name}", time, values[sample])
