"""What the subcommands of `sightfield station` share."""

from pathlib import Path
from typing import Annotated

import typer

from ....systems.numerics.errors import require
from ...outputs import refuse
from ...scenario_files import builtin_scenarios, find_scenario
from ...station import scenarios
from ...station.scenario import StationScenario
from ...station.station_files import load_station

DEFAULT_SCENARIO = "thesis_3v3"
ScenarioArgument = Annotated[
    str,
    typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios(scenarios))}."),
]
SettingOption = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Set a key, as radio.port=/dev/ttyUSB1."),
]
OutOption = Annotated[Path | None, typer.Option(help="Folder for log, summary and plot.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
ViewOption = Annotated[
    bool | None, typer.Option(help="Open the operator's view [default: in a terminal].")
]
PortOption = Annotated[
    int, typer.Option(help="Of the operator's view; one that is open there is used.")
]
DEFAULT_PORT = 7010


def load(name: str, settings: list[str] | None, seconds: float | None = None) -> StationScenario:
    """The laboratory with everything that the command line changes in it."""
    changes = [] if seconds is None else [f"seconds={seconds}"]
    return load_station(find_scenario(name, scenarios), [*(settings or []), *changes])


def new_log(out: Path | None, scratch: Path, *, mcap: bool) -> Path:
    """Where a run is written while it goes on: in its folder at once, as it must outlast a crash.

    Raises:
        InvalidInput: The folder has a log already, or cannot be made.
    """
    name = "run.mcap" if mcap else "run.log"
    if out is None:
        return scratch / name
    log = out / name
    require(not log.exists(), "--out", f"have no {name}, which is never written over", out)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        refuse(out, error)
    return log
