"""`sightfield standoff design`: gains that keep the margins asked for."""

import json
import math
from contextlib import nullcontext
from dataclasses import replace
from typing import Annotated

import typer
from rich.console import Console

from ....systems.numerics.standoff.sampled_loop import Specification, design_gains
from ...outputs import output_folder
from ...standoff.analysis import MARGINS, analyse_standoff
from ...standoff.make_standoff import StandoffScenario
from ...standoff.report import standoff_report, write_standoff_report
from .answer import summary_table
from .options import JsonOption, OutOption, takes_scenario

ASKED = Specification()
ROWS = {
    "controller": ("", "P, PI, PD or PID"),
    "kp": ("1/s", "proportional gain"),
    "ki": ("1/s^2", "integral gain"),
    "kd": ("", "derivative gain"),
    "gain_margin": ("", "factor on all gains that it bears"),
    "phase_margin": ("rad", "lag that it bears"),
    "crossover": ("rad/s", "where the phase margin is taken"),
    "delay_margin": ("s", "further delay that it bears"),
    "peak_sensitivity": ("", "Ms: how much disturbances are amplified at most"),
}


@takes_scenario
def design(
    scenario: StandoffScenario,
    phase_margin: Annotated[float, typer.Option(help="Least phase margin [degrees].")] = 60.0,
    gain_margin: Annotated[float, typer.Option(help="Least gain margin.")] = ASKED.gain_margin,
    peak_sensitivity: Annotated[
        float, typer.Option(help="Largest peak Ms of the sensitivity.")
    ] = ASKED.peak_sensitivity,
    delay_margin: Annotated[
        float, typer.Option(help="Least further delay that it bears [s].")
    ] = ASKED.delay_margin,
    damping: Annotated[
        float, typer.Option(help="Of the ideal PI loop's poles, 1: no overshoot.")
    ] = ASKED.damping,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Choose the fastest gains that keep these margins, with this clock, filter and delay."""
    asked = Specification(
        phase_margin=math.radians(phase_margin),
        gain_margin=gain_margin,
        peak_sensitivity=peak_sensitivity,
        delay_margin=delay_margin,
        damping=damping,
    )
    found = design_gains(scenario.loop, scenario.sampled, scenario.delay_samples, asked)
    loop = found.loop
    said: dict[str, object] = {"controller": loop.controller, "kp": loop.kp}
    if loop.integrates:
        said["ki"] = loop.ki
    if loop.derivative_gain:
        said["kd"] = loop.kd
    for name in MARGINS:
        value = getattr(found.margins, name)
        said[name] = value if math.isfinite(value) else None
    written: list[str] = []
    with output_folder(out) if out is not None else nullcontext() as folder:
        if folder is not None:
            tuned = replace(scenario, loop=loop)
            analysis = analyse_standoff(loop, scenario.sampled, scenario.delay_samples)
            written = write_standoff_report(folder, standoff_report(tuned), analysis)
            (folder / "design.json").write_text(json.dumps(said, indent=2) + "\n", "utf-8")
            written.append("design.json")
    if as_json:
        typer.echo(json.dumps(said, indent=2))
        return
    console = Console()
    console.print(summary_table(said, ROWS, "Stand-off: gains for the margins asked for"))
    if out is not None:
        console.print(f"Wrote {', '.join(written)} to [bold]{out}[/]")
