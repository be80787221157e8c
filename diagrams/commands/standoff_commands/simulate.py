"""`sightfield standoff simulate`: the block diagram, with all that a robot adds to the equation."""

import json
from contextlib import nullcontext
from typing import Annotated

import typer
from rich.console import Console

from ....systems.numerics.errors import require, require_positive
from ...outputs import output_folder
from ...standoff.make_standoff import StandoffScenario, run_standoff
from ...standoff.simulation import ROWS, simulation_summary, write_simulation
from .answer import summary_table
from .options import JsonOption, OutOption, takes_scenario

# So that nobody waits for a slip of the finger.
MOST_SAMPLES = 400_000


@takes_scenario
def simulate(
    scenario: StandoffScenario,
    seconds: Annotated[float, typer.Option(help="How long [s].")] = 10.0,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run the block diagram: evader, estimate with noise and delay, sampled law, limit."""
    require_positive("seconds", seconds)
    most = MOST_SAMPLES * scenario.sampled.period
    require(seconds <= most, "seconds", f"be at most {MOST_SAMPLES} samples, {most:g} s", seconds)
    written: list[str] = []
    with output_folder(out) if out is not None else nullcontext() as folder:
        run = run_standoff(scenario, seconds)
        summary = simulation_summary(scenario, run)
        if folder is not None:
            written = write_simulation(folder, scenario, run, summary)
    if as_json:
        typer.echo(json.dumps(summary, indent=2))
        return
    console = Console()
    console.print(summary_table(summary, ROWS, "Stand-off: simulation"))
    if out is not None:
        console.print(f"Wrote {', '.join(written)} to [bold]{out}[/]")
