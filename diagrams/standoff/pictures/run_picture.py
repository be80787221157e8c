"""A run of the stand-off block diagram over time."""

import math
from pathlib import Path

from matplotlib.figure import Figure

from ....systems.numerics.standoff.equilibria import wanted_equilibrium
from ..run import StandoffRun
from ..scenario import StandoffScenario
from .colours import PURSUER, REFERENCE, SINGULAR

_ESTIMATE = "#e08a00"


def draw_run(scenario: StandoffScenario, run: StandoffRun) -> Figure:
    """Distance and estimate above, command below.

    Args:
        scenario: What was simulated.
        run: Its samples.
    """
    figure = Figure(figsize=(10, 6), layout="constrained")
    distance, command = figure.subplots(2, 1, sharex=True, height_ratios=[1.6, 1])
    rest, loop = wanted_equilibrium(scenario.loop).y, scenario.loop
    distance.plot(
        run.times, run.estimate, color=_ESTIMATE, lw=0.8, label="as the controller sees it"
    )
    distance.plot(run.times, run.distance, color=PURSUER, label="true distance y")
    distance.axhline(rest, color="black", lw=0.8, label=f"estimate = r: y = {rest:.4f} m")
    distance.axhline(
        loop.reference, color=REFERENCE, ls="--", lw=1, label=f"r = {loop.reference:g} m"
    )
    distance.set_ylabel("distance [m]")
    distance.legend(loc="best", framealpha=0.85)
    command.step(run.times, run.command, where="post", color=PURSUER, lw=0.9)
    if not math.isinf(scenario.sampled.limit):
        for sign in (-1, 1):
            command.axhline(sign * scenario.sampled.limit, color=SINGULAR, ls=":", lw=1)
    command.set_ylabel("command [m/s]")
    command.set_xlabel("time [s]")
    for axes in (distance, command):
        axes.grid(alpha=0.3)
    clock = scenario.sampled
    words = f"sampled by {1000 * clock.period:g} ms"
    if scenario.delay_samples:
        words += f", {1000 * clock.period * scenario.delay_samples:g} ms late"
    if scenario.noise:
        words += f", noise {1000 * scenario.noise:g} mm"
    figure.suptitle(f"{loop.controller}, {words}")
    return figure


def save_run_picture(path: Path, scenario: StandoffScenario, run: StandoffRun) -> None:
    """Write what `draw_run` draws as a PNG picture."""
    draw_run(scenario, run).savefig(path, dpi=110)
