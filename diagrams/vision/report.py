"""What runs of tracking on pictures leave: numbers, log, plots and replay.

A sweep of the weight w of (2.7) says how long sight is kept, and how good estimates are, at each.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..outputs import write_json
from ..tracking.report import UNITS, draw_tracks, log_arrays, summarise_tracking
from ..visuals.replay import write_replay
from .run import PictureRun, run_picture_tracking
from .scenario import PictureGame, PictureTrackingScenario, set_up_picture_game

# Units of the arrays in the log; "1" for numbers without one.
PICTURE_UNITS = {
    **UNITS,
    "evader_estimate": "m",
    "evader_known": "1",
    "valid": "1",
    "arrived": "1",
    "estimation_error": "m",
}


def summarise_picture_tracking(run: PictureRun, scenario: str) -> dict[str, object]:
    """The run in numbers, ready for JSON.

    Args:
        run: What happened.
        scenario: Its name.

    Returns:
        What `sightfield track` says of the game, and: senses ("pictures" or "truth"), weight (w of
        (2.7)), model (of ranges), estimation_error_rms, _median and _worst (distance of the
        pursuers' joint estimate from the truth while they have one, None if they never do) [m],
        estimated_share (of the samples, that of evaders of whom the latest picture of some pursuer
        gives an estimate), mean_distance (of a pursuer to its own evader, None if it never has
        one) [m], pictures_lost_share.
    """
    vision, log = run.game.scenario.vision, run.tracking.log
    errors = run.errors[np.isfinite(run.errors)]
    pursuer, target = log["pursuer_position"], log["assignment"]
    own = np.take_along_axis(log["evader_position"], np.maximum(target, 0)[:, :, None], axis=1)
    distances = np.linalg.norm(own - pursuer, axis=2)[target >= 0]
    return {
        **summarise_tracking(run.tracking, scenario),
        "senses": vision.senses,
        "weight": vision.weight,
        "model": vision.model,
        "estimation_error_rms": float(np.sqrt(np.mean(errors**2))) if errors.size else None,
        "estimation_error_median": float(np.median(errors)) if errors.size else None,
        "estimation_error_worst": float(errors.max()) if errors.size else None,
        "estimated_share": float(run.valid.any(axis=1).mean()),
        "mean_distance": float(distances.mean()) if distances.size else None,
        "pictures_lost_share": float(1 - run.arrived.mean()),
    }


def picture_log_arrays(run: PictureRun) -> dict[str, np.ndarray]:
    """The run's samples by the names in PICTURE_UNITS, time along every array's first axis."""
    return {
        **log_arrays(run.tracking),
        "evader_estimate": run.estimate,
        "evader_known": run.known,
        "valid": run.valid,
        "arrived": run.arrived,
        "estimation_error": run.errors,
    }


# What is averaged over the seeds.
AVERAGED = ("tracking_time", "estimation_error_rms", "estimated_share", "mean_distance")


@dataclass(frozen=True, eq=False)
class WeightSweep:
    """Runs at several weights.

    Attributes:
        weights: Shape (k,).
        seeds: Shape (n,).
        values: Of each name in AVERAGED, shape (k, n) [s], [m], [1], [m]; NaN where there is none.
        censored: Whether sight was kept to the end of the run, so that its tracking time is only a
            lower bound, shape (k, n).
    """

    weights: np.ndarray
    seeds: np.ndarray
    values: dict[str, np.ndarray]
    censored: np.ndarray

    def table(self) -> list[dict[str, float | None]]:
        """A row of means over the seeds for each weight, ready for JSON.

        With censored runs, which it counts, a mean tracking time is a lower bound too.
        """
        rows = []
        for k, weight in enumerate(self.weights.tolist()):
            row: dict[str, float | None] = {"weight": weight}
            for name in AVERAGED:
                known = self.values[name][k][np.isfinite(self.values[name][k])]
                row[name] = float(known.mean()) if known.size else None
            row["censored_runs"] = int(self.censored[k].sum())
            rows.append(row)
        return rows


def sweep_weights(
    scenario: PictureTrackingScenario,
    weights: Sequence[float],
    seeds: Sequence[int],
    progress: Callable[[int], None] = lambda done: None,
) -> WeightSweep:
    """Play a scenario at every weight with every seed; the cameras are calibrated once.

    Args:
        scenario: What is played.
        weights: Of (2.7), each in [0, 1].
        seeds: Of the noise and of starts drawn at random.
        progress: Told the number of finished runs.

    Raises:
        InvalidInput: A weight is out of its range; see also `set_up_picture_game`.
    """
    variants = [
        [
            replace(scenario, seed=seed, vision=replace(scenario.vision, weight=weight))
            for seed in seeds
        ]
        for weight in weights
    ]
    values = {name: np.full((len(weights), len(seeds)), np.nan) for name in AVERAGED}
    censored = np.zeros((len(weights), len(seeds)), dtype=bool)
    game: PictureGame | None = None
    for k, row in enumerate(variants):
        for n, variant in enumerate(row):
            game = set_up_picture_game(variant, None if game is None else game.calibration)
            numbers = summarise_picture_tracking(run_picture_tracking(game), "")
            censored[k, n] = bool(numbers["censored"])
            for name in AVERAGED:
                value = numbers[name]
                if isinstance(value, float):
                    values[name][k, n] = value
            progress(k * len(seeds) + n + 1)
    return WeightSweep(np.array(weights, dtype=float), np.array(seeds, dtype=int), values, censored)


def write_picture_report(run: PictureRun, summary: dict[str, object], folder: Path) -> list[str]:
    """Write everything that is known of a run; return the names of the files.

    Args:
        run: A finished run; with a recording scene, a replay is written too.
        summary: From `summarise_picture_tracking`.
        folder: Exists.
    """
    names = ["summary.json", "log.npz", "log_units.json", "tracks.png", "estimates.png"]
    write_json(folder / names[0], summary)
    np.savez_compressed(folder / names[1], **picture_log_arrays(run))  # type: ignore[arg-type]  # none is called allow_pickle
    write_json(folder / names[2], PICTURE_UNITS)
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
    write_json(folder / names[0], tree)
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
