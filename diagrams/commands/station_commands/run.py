"""`sightfield station run`: a tracking game in the laboratory, simulated, emulated or real."""

import json
import os
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from ....systems.numerics.errors import InvalidInput, require_non_negative
from ...outputs import output_folder
from ...rosbag.bag import require_mcap
from ...station.hardware import Devices, Operator, ViewerLink, keys, read_run_log
from ...station.identity import require_identity
from ...station.report import summarise_station, write_station_report
from ...station.run import HORIZON, StationRun, run_station
from ...station.session import open_laboratory, show_on_view
from ...tracking.game import set_up_game
from .options import (
    DEFAULT_PORT,
    DEFAULT_SCENARIO,
    JsonOption,
    OutOption,
    PortOption,
    ScenarioArgument,
    SettingOption,
    ViewOption,
    load,
    new_log,
)

# How long devices may take to close after a second Ctrl-C [s], and the exit code then.
_LAST_PATIENCE, _INTERRUPTED = 1.5, 130
# Who says what is typed.
_TERMINAL = "the terminal"


def run(
    scenario: ScenarioArgument = DEFAULT_SCENARIO,
    simulate: Annotated[
        bool, typer.Option("--simulate", help="The simulated laboratory [default].")
    ] = False,
    emulate: Annotated[
        bool,
        typer.Option("--emulate", help="Every byte over emulated radios to the real firmware."),
    ] = False,
    hardware: Annotated[
        bool, typer.Option("--hardware", help="The devices that the scenario names.")
    ] = False,
    setting: SettingOption = None,
    seconds: Annotated[float | None, typer.Option(help="Horizon [s].")] = None,
    out: OutOption = None,
    as_json: JsonOption = False,
    view: ViewOption = None,
    port: PortOption = DEFAULT_PORT,
    go: Annotated[
        bool | None,
        typer.Option(help="Start at once, or wait for the operator [default: wait on hardware]."),
    ] = None,
    mcap: Annotated[
        bool,
        typer.Option("--mcap", help="Keep the log as run.mcap, which is a ROS 2 bag as well."),
    ] = False,
    identified: Annotated[
        bool,
        typer.Option(
            "--identify",
            help="Let each robot turn in place first, and run only if its own body turns.",
        ),
    ] = False,
    realtime: Annotated[
        float | None,
        typer.Option(
            help="Of --simulate: simulated seconds per second, 0: as fast as possible "
            "[default: 1 with a view, else 0]."
        ),
    ] = None,
) -> None:
    """Pursuers keep evaders in sight, in the laboratory, until one is lost or time is up.

    Exit code 1 if the supervisor held a robot, or lost one or the operator's view.

    Keys in the terminal: Space stops the robots for good, P pauses and goes on, S starts.
    """
    mode = _mode(simulate, emulate, hardware)
    if mcap:
        require_mcap()
    laboratory = load(scenario, setting, seconds)
    game = set_up_game(laboratory.tracking)
    require_non_negative("--realtime", realtime or 0.0)
    attended = sys.stdout.isatty() and sys.stdin.isatty() and not as_json
    shown = attended if view is None else view
    rate = realtime if realtime is not None else float(shown)
    if mode != "simulate":
        if realtime not in (None, 1.0):
            raise InvalidInput(f"`--realtime` must be left out with --{mode}; got {realtime}")
        rate = 1.0
    if identified and mode == "simulate":
        raise InvalidInput("`--identify` must come with --emulate or --hardware; got --simulate")
    if go is False and not (shown or attended):
        raise InvalidInput("`--no-go` must come with a view or a terminal; got neither")
    operator = Operator(running=mode != "hardware" if go is None else go)
    console, name = Console(stderr=as_json), Path(scenario).stem
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        log = new_log(out, scratch, mcap=mcap)
        devices = stack.enter_context(open_laboratory(laboratory, game, mode, operator))
        if identified and isinstance(devices, Devices):
            console.print("Each robot turns in place.")
            require_identity(laboratory, devices)
        link: ViewerLink | None = None
        if shown:
            link, url = stack.enter_context(
                show_on_view(laboratory, game, title=name, mode=mode, operator=operator, port=port)
            )
            console.print(f"Operator's view: [bold]{url}[/]", soft_wrap=True)
            console.print(f"A page with a stop alone: [bold]{link.stop_page}[/]")
        stack.enter_context(_ends_orderly(operator))
        actions = {" ": "stop", "\x1b": "stop", "s": "start", "S": "start"}
        bindings = {
            key: lambda word=word: operator.say(word, _TERMINAL) for key, word in actions.items()
        }
        bindings |= dict.fromkeys("pP", lambda: operator.toggle(_TERMINAL))
        if stack.enter_context(keys(bindings)) and not as_json:
            console.print("[bold]Space[/]: emergency stop. [bold]P[/]: pause. [bold]S[/]: start.")
        done = run_station(
            laboratory,
            game,
            devices,
            log=log,
            mode=mode,
            operator=operator,
            view=link,
            realtime_rate=rate,
        )
        if link is not None:
            link.end(done.how)
        record = read_run_log(log)
        summary = summarise_station(done, record, game, name, laboratory.seconds, mode)
        written = []
        if out is not None:
            with output_folder(out) as folder:
                written = [log.name, *write_station_report(done, record, game, summary, folder)]
    if as_json:
        print(json.dumps(summary, indent=2))
    else:
        _tell(console, summary, done, written, out)
    if summary["faults"]:
        raise typer.Exit(1)


def _tell(
    console: Console,
    summary: dict[str, object],
    done: StationRun,
    written: list[str],
    out: Path | None,
) -> None:
    """Print the summary, the events and how it ended."""
    events: Any = summary["events"]
    _show(console, {key: value for key, value in summary.items() if key != "events"})
    for event in events:
        mark = "[red]fault[/] " if event["fault"] else ""
        robot = f"{event['robot']} " if event["robot"] else ""
        console.print(f"{event['time']:8.2f} s  {mark}{robot}{event['text']}", soft_wrap=True)
    ending = "Every evader was in sight" if done.lost_evader is None else "Sight was kept"
    more = "" if done.how == HORIZON else f"; {done.how}"
    console.print(f"{ending} for {done.tracking_time:.2f} s{more}.")
    if written:
        console.print(f"Wrote {', '.join(written)} to [bold]{out}[/]")


def _mode(simulate: bool, emulate: bool, hardware: bool) -> str:
    chosen = {"simulate": simulate, "emulate": emulate, "hardware": hardware}
    names = [name for name, wanted in chosen.items() if wanted]
    if len(names) > 1:
        given = ", ".join(f"--{name}" for name in names)
        raise InvalidInput(f"`--simulate`, --emulate and --hardware must come alone; got {given}")
    return names[0] if names else "simulate"


@contextmanager
def _ends_orderly(operator: Operator) -> Iterator[None]:
    """The first Ctrl-C, or a request to end, is an emergency stop; the second ends at once.

    If closing the devices then hangs, a timer ends the program all the same: robots stop by
    themselves.
    """
    names = {
        int(signal.SIGINT): "Ctrl-C",
        int(signal.SIGTERM): "a request to end",
        int(signal.SIGHUP): "a terminal that closed",
    }
    before = {number: signal.getsignal(number) for number in names}
    heard: list[int] = []
    timers: list[threading.Timer] = []

    def stop(number: int, frame: object) -> None:
        heard.append(number)
        if len(heard) > 1:
            timers.append(threading.Timer(_LAST_PATIENCE, os._exit, (_INTERRUPTED,)))
            timers[-1].daemon = True
            timers[-1].start()
            # A third is ended by the timer, too: it does not break off the closing.
            for each in names:
                signal.signal(each, signal.SIG_IGN)
            raise KeyboardInterrupt
        name = names[number]
        # Not here: the thread that was interrupted may hold the radio's lock.
        threading.Thread(target=operator.say, args=("stop", name), daemon=True).start()

    for number in names:
        signal.signal(number, stop)
    try:
        yield
    finally:
        # A timer goes on: devices are closed after this.
        for number in names:
            signal.signal(number, before[number])


def _show(console: Console, summary: dict[str, object]) -> None:
    """Print the summary as a table."""
    table = Table(show_header=False, box=None, padding=(0, 2))
    for key, value in summary.items():
        values = value if isinstance(value, list) else [value]
        texts = [f"{each:.4g}" if isinstance(each, float) else str(each) for each in values]
        table.add_row(key.replace("_", " "), ", ".join(texts))
    console.print(table)
