"""What `sightfield standoff` says and leaves in a folder."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...systems.numerics.errors import require
from ...systems.numerics.standoff.attraction import region_of_attraction
from ...systems.numerics.standoff.loop import wanted_equilibrium
from ...systems.numerics.standoff.response import DIVERGED, SETTLED, StandoffResponse, respond
from ..outputs import write_json
from .analysis import StandoffAnalysis
from .make_standoff import StandoffRun, StandoffScenario, run_standoff
from .pictures import (
    save_linear_pictures,
    save_phase_picture,
    save_response_picture,
    save_sampled_pictures,
)
from .simulation import write_standoff_replay

# Of the block diagram's run [s], and the evader's motion in it, in half the top speed of the
# thesis's pursuer, 0.3 m/s.
DURATION = 10.0
EVADER_SPEED, EVADER_SWAY = 0.15, 0.1
# So that nobody waits for a slip of the finger.
_MOST_SAMPLES = 400_000


@dataclass(frozen=True, eq=False)
class StandoffReport:
    """A start, and what becomes of it.

    Attributes:
        scenario: With its start.
        summary: For JSON; see `ROWS`.
        run: Of the block diagram.
    """

    scenario: StandoffScenario
    summary: dict[str, object]
    run: StandoffRun


# Unit and meaning of each entry of a summary.
ROWS = {
    "controller": ("", "P, PI, PD or PID"),
    "start": ("m", "true distance at the start"),
    "reference": ("m", "distance to keep, r"),
    "attracted": ("", "whether the start lies in the region of attraction"),
    "outcome": ("", "of the closed form: settled, singular, diverged or moving"),
    "end": ("m", "where the closed form ends"),
    "bias": ("m", "of the wanted equilibrium: true distance less r"),
    "settling_time": ("s", "until the closed form stays within 2 % of its way"),
    "sampled_lost": ("s", "when the block diagram's distance grew beyond all bounds"),
    "sampled_end": ("m", "where the block diagram is after 10 s, evader moving"),
    "sampled_estimate": ("m", "what it takes that distance for"),
}


def standoff_report(scenario: StandoffScenario) -> StandoffReport:
    """Follow one start in closed form, and as a block diagram behind a moving evader.

    Args:
        scenario: What the block diagram does; loop and start are the closed form's too.

    Raises:
        InvalidInput: There is no equilibrium, or the start lies on a singularity, or the samples
            are too many.
    """
    loop, start = scenario.loop, scenario.start
    least = DURATION / _MOST_SAMPLES
    require(
        scenario.sampled.period >= least,
        "period",
        f"be at least {least:g} s",
        scenario.sampled.period,
    )
    motion = respond(loop, start)
    wanted = wanted_equilibrium(loop).y
    run = run_standoff(scenario, DURATION)
    summary: dict[str, object] = {
        "controller": loop.controller,
        "start": start,
        "reference": loop.reference,
        "attracted": region_of_attraction(loop).holds(start),
        "outcome": motion.outcome,
        "end": None if motion.outcome == DIVERGED else motion.end,
        "bias": wanted - loop.reference,
        "settling_time": _settling_time(motion),
        "sampled_lost": float(run.times[-1]) if run.lost else None,
        "sampled_end": None if run.lost else float(run.distance[-1]),
        "sampled_estimate": None if run.lost else float(run.estimate[-1]),
    }
    return StandoffReport(scenario, summary, run)


def write_standoff_report(
    folder: Path, report: StandoffReport, found: StandoffAnalysis | None
) -> list[str]:
    """Write the JSON, pictures and the replay; return their names.

    summary.json is what the command prints as JSON; beside an analysis the start's summary is
    run.json.

    Args:
        folder: Exists.
        report: Of a start.
        found: Its analysis, if that was asked for.
    """
    loop, start = report.scenario.loop, report.scenario.start
    names = ["summary.json", "responses.png"]
    write_json(folder / "summary.json", report.summary if found is None else found.as_object())
    save_response_picture(folder / "responses.png", loop, start)
    if found is not None:
        write_json(folder / "run.json", report.summary)
        names += ["run.json", *save_linear_pictures(folder, found)]
        names += [*save_sampled_pictures(folder, found), "phase.png"]
        save_phase_picture(folder / "phase.png", found)
    title = f"{loop.controller}: keep {loop.reference:g} m"
    write_standoff_replay(folder / "replay.html", report.run, title)
    return [*names, "replay.html"]


def _settling_time(motion: StandoffResponse) -> float | None:
    """When the distance enters the last 2 % of its way for good; None if it settles nowhere."""
    if motion.outcome != SETTLED:
        return None
    times, y, end = motion.times, motion.y, motion.end
    outside = np.flatnonzero(np.abs(y - end) > 0.02 * abs(y[0] - end))
    return float(times[min(outside[-1] + 1, len(times) - 1)]) if len(outside) else 0.0
