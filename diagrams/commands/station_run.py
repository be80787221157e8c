"""`sightfield station run`: a tracking game in the laboratory, simulated, emulated or real.

Its options stand first; the other subcommands of `sightfield station` share most of them.
"""

import os
import signal
import socket
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated, Any, Self

import typer
from rich.console import Console, RenderableType

from ...systems.numerics.errors import (
    InvalidInput,
    SightfieldError,
    require,
    require_non_negative,
)
from ..outputs import optional_folder, refuse
from ..rosbag.bag import require_mcap
from ..scenario_files import builtin_scenarios, find_scenario
from ..station import scenarios
from ..station.check import require_identity
from ..station.hardware import Devices, Operator, ViewerLink, keys, read_run_log
from ..station.laboratory_files import load_station
from ..station.report import summarise_station, write_station_report
from ..station.run import HORIZON, StationRun, run_station
from ..station.scenario import StationScenario
from ..station.session import drive_to_start, open_laboratory, show_on_view
from ..tracking.game import set_up_game
from .shared import JsonOption, SecondsOption, plain_table, tell, with_options

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
ViewOption = Annotated[
    bool | None, typer.Option(help="Open the operator's view [default: in a terminal].")
]
PortOption = Annotated[
    int, typer.Option(help="Of the operator's view; one that is open there is used.")
]
DEFAULT_PORT = 7010


def load(name: str, settings: list[str] | None, seconds: float | None = None) -> StationScenario:
    """The laboratory with everything that the command line changes in it."""
    changes = with_options(settings, {"--seconds": ("seconds", seconds)})
    return load_station(find_scenario(name, scenarios), changes)


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


# How long devices may take to close after a second Ctrl-C [s], and the exit code then.
_LAST_PATIENCE, _INTERRUPTED = 1.2, 130
# Signals that end a program, and who it is that asks.
_ENDS = {
    int(signal.SIGINT): "Ctrl-C",
    int(signal.SIGTERM): "a request to end",
    int(signal.SIGHUP): "a terminal that closed",
}
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
    seconds: SecondsOption = None,
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
    to_start: Annotated[
        bool,
        typer.Option(
            "--drive-to-start",
            help="Let robots drive to their starts first, one after the other, round the rest.",
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

    Exit code 1 if the supervisor held a robot, or lost one or the operator's view; 2 if a device
    failed; 128 and the signal's number if one stopped the run: 130 after Ctrl-C.

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
    if to_start and mode == "simulate":
        raise InvalidInput(
            "`--drive-to-start` must come with --emulate or --hardware; got --simulate"
        )
    if go is False and not (shown or attended):
        raise InvalidInput("`--no-go` must come with a view or a terminal; got neither")
    operator = Operator(running=mode != "hardware" if go is None else go)
    console, name = Console(stderr=as_json), Path(scenario).stem
    with ExitStack() as stack:
        scratch = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        log = new_log(out, scratch, mcap=mcap)
        ending = stack.enter_context(_Ending(operator).caught())
        devices = stack.enter_context(open_laboratory(laboratory, game, mode, operator))
        if identified and isinstance(devices, Devices):
            console.print("Each robot turns in place.")
            require_identity(laboratory, devices)
        if to_start and isinstance(devices, Devices):
            for driven in drive_to_start(laboratory, game, devices):
                what = "goes aside" if driven.aside else "is at its start"
                console.print(f"{driven.name} {what}, after {driven.way:.2f} m.")
        link: ViewerLink | None = None
        if shown:
            link, url = stack.enter_context(
                show_on_view(laboratory, game, title=name, mode=mode, operator=operator, port=port)
            )
            console.print(f"Operator's view: [bold]{url}[/]", soft_wrap=True)
            console.print(f"A page with a stop alone: [bold]{link.stop_page}[/]")
        actions = {" ": "stop", "\x1b": "stop", "s": "start", "S": "start"}
        bindings = {
            key: lambda word=word: operator.say(word, _TERMINAL) for key, word in actions.items()
        }
        bindings |= dict.fromkeys("pP", lambda: operator.toggle(_TERMINAL))
        if stack.enter_context(keys(bindings)) and not as_json:
            console.print("[bold]Space[/]: emergency stop. [bold]P[/]: pause. [bold]S[/]: start.")
        ending.under_way = True
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
        written: list[str] = []
        with optional_folder(out) as folder:
            if folder is not None:
                written = [log.name, *write_station_report(done, record, game, summary, folder)]
    tell(summary, *_shown(summary, done), as_json=as_json, written=written, out=out)
    if done.failure:
        raise SightfieldError(done.failure)
    if ending.first is not None:
        # As a shell says it of a program that a signal has ended.
        raise typer.Exit(128 + ending.first)
    if summary["faults"]:
        raise typer.Exit(1)


def _shown(summary: dict[str, object], done: StationRun) -> Iterator[RenderableType]:
    """The summary, the events and how it ended."""
    events: Any = summary["events"]
    yield plain_table({key: value for key, value in summary.items() if key != "events"})
    for event in events:
        mark = "[red]fault[/] " if event["fault"] else ""
        robot = f"{event['robot']} " if event["robot"] else ""
        yield f"{event['time']:8.2f} s  {mark}{robot}{event['text']}"
    ending = "Every evader was in sight" if done.lost_evader is None else "Sight was kept"
    more = "" if done.how == HORIZON else f"; {done.how}"
    yield f"{ending} for {done.tracking_time:.2f} s{more}."


def _mode(simulate: bool, emulate: bool, hardware: bool) -> str:
    chosen = {"simulate": simulate, "emulate": emulate, "hardware": hardware}
    names = [name for name, wanted in chosen.items() if wanted]
    if len(names) > 1:
        given = ", ".join(f"--{name}" for name in names)
        raise InvalidInput(f"`--simulate`, --emulate and --hardware must come alone; got {given}")
    return names[0] if names else "simulate"


class _Ending:
    """What a signal does to the program.

    While a run is under way the first is an emergency stop of its robots, after which the run ends
    in order; before and after that it ends the program at once, and so does the second in any case.
    Should devices hang while they are closed, the program ends all the same: robots stop by
    themselves.

    Args:
        operator: Whose emergency stop it is.

    Attributes:
        under_way: Whether a run is.
        first: Number of the signal that stopped the run; None: none has.
    """

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self._before: dict[int, Any] = {}
        self.under_way = False
        self.first: int | None = None

    @contextmanager
    def caught(self) -> Iterator[Self]:
        """Catch signals, until devices are closed."""
        before = self._before = {number: signal.getsignal(number) for number in _ENDS}
        bell, clapper = socket.socketpair()
        clapper.setblocking(False)
        # A thread of its own hears the second as well while the main one waits for a device.
        listener = threading.Thread(target=self._listen, args=(bell,), daemon=True)
        listener.start()
        old = signal.set_wakeup_fd(clapper.fileno(), warn_on_full_buffer=False)
        for number in _ENDS:
            signal.signal(number, self._handle)
        try:
            yield self
        finally:
            # A timer goes on, though nothing is caught any more.
            for number, handler in before.items():
                signal.signal(number, handler)
            signal.set_wakeup_fd(old)
            clapper.close()
            listener.join()
            bell.close()

    def _handle(self, number: int, frame: object) -> None:
        if self.under_way and self.first is None:
            self.first = number
            return
        # A third does not break off the closing: the timer ends it, too.
        for each in _ENDS:
            signal.signal(each, signal.SIG_IGN)
        whoever = self._before[number]
        if callable(whoever):
            # The program wants to know which it was.
            whoever(number, None)
        raise KeyboardInterrupt

    def _listen(self, bell: socket.socket) -> None:
        heard = 0
        while word := bell.recv(1):
            if word[0] not in _ENDS:
                continue
            heard += 1
            if heard == 1 and self.under_way:
                # Not in the handler: the thread that it interrupts may hold the radio's lock.
                told = ("stop", _ENDS[word[0]])
                threading.Thread(target=self._operator.say, args=told, daemon=True).start()
            else:
                threading.Thread(target=_end_soon, daemon=True).start()


def _end_soon() -> None:
    """End the program, whatever its other threads do."""
    # The kernel does, should Python itself stand still.
    signal.setitimer(signal.ITIMER_REAL, 1.2 * _LAST_PATIENCE)
    time.sleep(_LAST_PATIENCE)
    os._exit(_INTERRUPTED)
