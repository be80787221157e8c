"""`sightfield station`: run a game in the laboratory, look what is connected and who is
who, try a kind of robots, play a log again or write it as a ROS 2 bag, open the view.
"""

import json
import tempfile
from contextlib import ExitStack
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from ...systems.numerics.errors import InvalidInput, require, require_non_negative
from ..outputs import new_files, optional_folder, write_json
from ..station.check import Finding, Identity, all_found, check_laboratory, identify
from ..station.hardware import KINDS, Devices, Operator, find_kind, open_view
from ..station.kind_check import KindTrial, check_kind
from ..station.replay import convert_recording, load_recording, replay_station
from ..station.session import open_laboratory, show_on_view
from ..tracking.game import set_up_game
from .shared import JsonOption, RunByDefault
from .station_run import (
    DEFAULT_PORT,
    DEFAULT_SCENARIO,
    PortOption,
    ScenarioArgument,
    SettingOption,
    load,
    run,
)


def check(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    setting: SettingOption = None,
    as_json: JsonOption = False,
    port: PortOption = DEFAULT_PORT,
) -> None:
    """Say in plain words what of the laboratory is connected and what is missing; move nothing.

    Exit code 1 if something is missing that --hardware needs.
    """
    laboratory = load(scenario, setting)
    console = Console(highlight=False)
    findings: list[Finding] = []
    for finding in check_laboratory(laboratory, port):
        findings.append(finding)
        if not as_json:
            mark = "[green]yes[/]" if finding.found else "[red]no [/]"
            console.print(f"{mark}  [bold]{finding.thing}[/]: ", end="")
            # Names in brackets are no markup.
            console.print(finding.words, markup=False, soft_wrap=True)
    ready = all_found(findings)
    if as_json:
        print(json.dumps({"ready": ready, "findings": [vars(each) for each in findings]}, indent=2))
    elif ready:
        console.print("Everything is there: sightfield station --hardware")
    else:
        console.print("Not all is there for --hardware; --simulate needs none of it.")
    if not ready:
        raise typer.Exit(1)


def identify_robots(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    emulate: Annotated[
        bool, typer.Option("--emulate", help="Those of the emulated laboratory.")
    ] = False,
    hardware: Annotated[
        bool, typer.Option("--hardware", help="Those of the laboratory: they move.")
    ] = False,
    setting: SettingOption = None,
    as_json: JsonOption = False,
) -> None:
    """Let each robot turn in place and back, and say which body the motion capture saw turn.

    Exit code 1 if it was another than the scenario says.
    """
    if emulate == hardware:
        got = "both" if emulate else "neither"
        raise InvalidInput(f"`--emulate` or --hardware must say which robots; got {got}")
    laboratory = load(scenario, setting)
    game, operator = set_up_game(laboratory.tracking), Operator()
    console, found = Console(highlight=False), list[Identity]()
    mode = "emulate" if emulate else "hardware"
    with open_laboratory(laboratory, game, mode, operator) as devices:
        assert isinstance(devices, Devices)
        for each in identify(laboratory, devices):
            found.append(each)
            if not as_json:
                mark = "[green]yes[/]" if each.right else "[red]no [/]"
                console.print(f"{mark}  ", end="")
                console.print(each.words, markup=False, soft_wrap=True)
    right = all(each.right for each in found)
    if as_json:
        print(json.dumps({"right": right, "robots": [asdict(each) for each in found]}, indent=2))
    if not right:
        raise typer.Exit(1)


def kind_check(
    kind: Annotated[
        str,
        typer.Argument(
            help=f"One of {', '.join(KINDS)}, or module:NAME of one's own in this folder."
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """Drop, delay, repeat and reorder messages between a kind's link and robots that stand in, stop
    them, and leave them in silence; exit code 1 if a trial fails. No real robot moves."""
    tried = find_kind(kind)
    console, found = Console(highlight=False), list[KindTrial]()
    for trial in check_kind(tried):
        found.append(trial)
        if not as_json:
            mark = "[green]yes[/]" if trial.passed else "[red]no [/]"
            console.print(f"{mark}  [bold]{trial.name}[/]: ", end="")
            console.print(trial.words, markup=False, soft_wrap=True)
    passed = all(trial.passed for trial in found)
    if as_json:
        about = {"kind": tried.name, "silence": tried.stops_after, "passed": passed}
        about |= {"recognises": sorted(tried.recognises)}
        print(json.dumps(about | {"trials": [asdict(trial) for trial in found]}, indent=2))
    if not passed:
        raise typer.Exit(1)


def replay(
    log: Annotated[Path, typer.Argument(help="run.log or run.mcap of a run of a station.")],
    out: Annotated[Path | None, typer.Option(help="Folder for summary.json.")] = None,
    as_json: JsonOption = False,
    view: Annotated[bool, typer.Option(help="Show it in the operator's view.")] = False,
    port: PortOption = DEFAULT_PORT,
    realtime: Annotated[
        float | None,
        typer.Option(
            help="Seconds per second, 0: as fast as possible [default: 1 with a view, else 0]."
        ),
    ] = None,
) -> None:
    """Play a recorded run through the diagrams that made it; exit code 1 if commands differ,
    or records are lost."""
    recording = load_recording(log)
    require_non_negative("--realtime", realtime or 0.0)
    rate = realtime if realtime is not None else float(view)
    console = Console(stderr=as_json)
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        link = None
        if view:
            link, url = stack.enter_context(
                show_on_view(
                    recording.scenario,
                    recording.game,
                    title=log.stem,
                    mode=f"replay of {recording.mode}",
                    operator=Operator(),
                    port=port,
                )
            )
            console.print(f"Operator's view: [bold]{url}[/]", soft_wrap=True)
        result = replay_station(recording, scratch / "replay.log", view=link, realtime_rate=rate)
        if link is not None:
            link.end("the end of the log")
    summary = {
        "log": str(log),
        "mode": recording.mode,
        "ticks": result.ticks,
        "complete": recording.log.complete,
        "unread_bytes": recording.log.unread,
        "lost_records": recording.log.lost,
        "missing_ticks": result.missing,
        "identical": result.identical,
        "first_difference": result.first_difference,
        "greatest_difference": result.greatest_difference,
        "differing": list(result.differing),
    }
    with optional_folder(out) as folder:
        if folder is not None:
            write_json(folder / "summary.json", summary)
    if as_json:
        print(json.dumps(summary, indent=2))
    elif result.identical:
        console.print(f"{result.ticks} ticks, and every command is the same, bit for bit.")
    else:
        console.print(
            f"{result.ticks} ticks; commands differ from tick {result.first_difference} on, by "
            f"{result.greatest_difference:.3g} at most; differing: {', '.join(result.differing)}."
        )
    if not recording.log.complete and not as_json:
        console.print(
            f"The run was broken off: its log was not closed, {recording.log.unread} bytes at its "
            "end are no whole record."
        )
    if recording.log.lost and not as_json:
        console.print(
            f"The log is damaged: {recording.log.lost} of its records lost, {result.missing} of "
            "them ticks; what is left was played."
        )
    if not result.identical or recording.log.lost:
        raise typer.Exit(1)


def convert(
    log: Annotated[Path, typer.Argument(help="run.log or run.mcap of a run of a station.")],
    out: Annotated[Path, typer.Argument(help="New file: NAME.mcap, or NAME.log.")],
) -> None:
    """Write a recorded run down anew, the same to the last bit; exit code 1 if records are lost."""
    require(out.suffix in (".mcap", ".log"), "out", "end in .mcap or .log", out)
    require(not out.exists(), "out", "be a new file", out)
    recording = load_recording(log)
    with new_files(out.parent) as folder:
        convert_recording(recording, folder / out.name)
    console = Console()
    console.print(f"Wrote [bold]{out}[/]", soft_wrap=True)
    if recording.log.lost:
        console.print(f"The log is damaged: {recording.log.lost} of its records are not in it.")
        raise typer.Exit(1)


def view(port: PortOption = DEFAULT_PORT) -> None:
    """Open the operator's view if it is not; runs that are under way find it by themselves."""
    console = Console(highlight=False)
    opened = open_view(port)
    console.print(f"Operator's view: [bold]{opened.url}[/]")
    console.print("It stops every run; the address that a run printed starts and pauses it.")


station: Any = typer.Typer(
    cls=RunByDefault,
    help=(
        "Run a tracking game in the laboratory: simulated, emulated, or real. Without a command: "
        "run, whose options `sightfield station run --help` lists."
    ),
    rich_markup_mode=None,
)
station.command()(run)
station.command()(check)
station.command()(convert)
station.command("identify")(identify_robots)
station.command("kind-check")(kind_check)
station.command()(replay)
station.command()(view)
