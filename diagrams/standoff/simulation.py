"""What `sightfield standoff simulate` says of a run and leaves in a folder."""

import json
import math
from pathlib import Path

import numpy as np

from ...systems.numerics.standoff.equilibria import wanted_equilibrium
from .pictures.replay import write_standoff_replay
from .pictures.run_picture import save_run_picture
from .run import StandoffRun
from .scenario import StandoffScenario

# Unit and meaning of each entry of a summary.
ROWS = {
    "controller": ("", "P, PI, PD or PID"),
    "seconds": ("s", "simulated"),
    "delay": ("s", "of the estimate, in whole samples"),
    "lost": ("", "whether the distance grew beyond all bounds"),
    "end": ("m", "true distance at the end"),
    "mean_distance": ("m", "over the second half"),
    "rms_miss": ("m", "of the distance from where the loop rests, over the second half"),
    "least_distance": ("m", "on the whole way"),
    "largest_distance": ("m", "on the whole way"),
    "rms_command": ("m/s", "over the second half"),
    "limited_share": ("", "of the samples at which the command is at its limit"),
}


def simulation_summary(scenario: StandoffScenario, run: StandoffRun) -> dict[str, object]:
    """Numbers of a run, ready for JSON; see `ROWS`.

    Args:
        scenario: What was simulated.
        run: Its samples.
    """
    distance, half = run.distance, len(run.times) // 2
    rest, limit = wanted_equilibrium(scenario.loop).y, scenario.sampled.limit
    late = distance[half:]
    share = 0.0 if math.isinf(limit) else float(np.mean(np.abs(run.command) > limit * (1 - 1e-9)))
    return {
        "controller": scenario.loop.controller,
        "seconds": float(run.times[-1]),
        "delay": scenario.delay_samples * scenario.sampled.period,
        "lost": run.lost,
        "end": None if run.lost else float(distance[-1]),
        "mean_distance": None if run.lost else float(late.mean()),
        "rms_miss": None if run.lost else float(np.sqrt(np.mean((late - rest) ** 2))),
        "least_distance": float(distance.min()),
        "largest_distance": float(distance.max()),
        "rms_command": float(np.sqrt(np.mean(run.command[half:] ** 2))),
        "limited_share": share,
    }


def write_simulation(
    folder: Path, scenario: StandoffScenario, run: StandoffRun, summary: dict[str, object]
) -> list[str]:
    """Write summary.json, run.csv, run.png and replay.html; returns their names.

    Args:
        folder: Exists.
        scenario: What was simulated.
        run: Its samples.
        summary: See `simulation_summary`.
    """
    text = json.dumps(summary, indent=2) + "\n"
    (folder / "summary.json").write_text(text, encoding="utf-8")
    columns = [run.times, run.evader, run.pursuer, run.estimate, run.command]
    np.savetxt(
        folder / "run.csv",
        np.column_stack(columns),
        fmt="%.9g",
        delimiter=",",
        header="time [s],evader [m],pursuer [m],estimate [m],command [m/s]",
        comments="",
    )
    save_run_picture(folder / "run.png", scenario, run)
    loop = scenario.loop
    title = f"{loop.controller}: keep {loop.reference:g} m"
    write_standoff_replay(folder / "replay.html", run, title)
    return ["summary.json", "run.csv", "run.png", "replay.html"]
