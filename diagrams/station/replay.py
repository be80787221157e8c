"""Playing a recorded run again: the same diagrams must give the same commands, bit for bit.

An old log can also be written down anew, as MCAP, which other tools open, or back.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.systems.framework import System

from ...systems.numerics.errors import require
from ..scenario_files import build
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.make_tracking import OwnAssignment
from .hardware import RunLog, Shows, read_run_log
from .laboratories import ticks_of
from .ports import COMMANDS
from .recording import open_run_writer
from .run import logged_ports, run_station
from .scenario import StationScenario

# How many times as many ticks may be missing as are there.
_MOST_MISSING = 100
# What of a run may be of somebody's own.
_OWN = ("assignment", "evasion")


@dataclass(frozen=True, eq=False)
class Recording:
    """A log with what is needed to play it.

    Attributes:
        log: What was recorded.
        mode: In which the run was.
        scenario: Its laboratory.
        game: Its game, set up.
        own: What was not the scenario's: of "assignment" and "evasion".
    """

    log: RunLog
    mode: str
    scenario: StationScenario
    game: TrackingGame
    own: tuple[str, ...]


@dataclass(frozen=True)
class Comparison:
    """How a run played again compares with what was recorded.

    Attributes:
        ticks: How many of the log were compared.
        missing: How many before or between them are lost.
        identical: Whether every command is the same, bit for bit.
        differing: Names of all ports of which some sample differs.
        first_difference: Tick of the first command that differs, or None.
        greatest_difference: Between two commands [m/s] or [rad/s].
    """

    ticks: int
    missing: int
    identical: bool
    differing: tuple[str, ...]
    first_difference: int | None
    greatest_difference: float


def load_recording(path: Path) -> Recording:
    """Read a log of `run_station`, which holds its scenario.

    Raises:
        InvalidInput: It is no such log, or its scenario is none.
    """
    log = read_run_log(path)
    tree, mode, own = (log.about.get(key) for key in ("scenario", "mode", "own"))
    # Logs of the first version do not say whose the parts were.
    own = own or []
    good = isinstance(tree, dict) and isinstance(mode, str) and mode.isprintable()
    good = good and isinstance(own, list) and all(each in _OWN for each in own)
    require(good, "log", "be of a run of a station", path)
    assert isinstance(mode, str)
    scenario = build(StationScenario, tree)
    ports = logged_ports(scenario)
    sizes = {name: samples.shape[1] for name, samples in log.samples.items()}
    require(sizes == ports, "log", "have the ports of its scenario", path)
    require(len(log.times) > 0, "log", "hold samples", "none")
    require(log.times[0] >= 0, "log", "have samples from 0 s on", f"{log.times[0]:g} s")
    ends = scenario.seconds + scenario.period
    require(log.times[-1] <= ends, "log", f"end at {scenario.seconds:g} s", f"{log.times[-1]:g} s")
    ticks = log.times / scenario.period
    steps = np.diff(np.floor(ticks + 1e-9))
    # More that is missing would take longer to play than it is worth.
    good = bool((steps > 0).all() and ticks[-1] <= _MOST_MISSING * len(ticks))
    require(good, "log", f"have a sample every {scenario.period:g} s", path)
    return Recording(log, mode, scenario, set_up_game(scenario.tracking), tuple(own))


def replay_station(
    recording: Recording,
    log: Path,
    *,
    assignment: OwnAssignment | None = None,
    evasion: System | None = None,
    view: Shows | None = None,
    realtime_rate: float = 0.0,
) -> Comparison:
    """Play a recording through the diagrams that made it.

    Args:
        recording: What is played.
        log: File to which the replay is written; must not exist.
        assignment, evasion: Those of your own with which it was recorded, made anew.
        view: The operator's view.
        realtime_rate: Simulated seconds per second, 0 for as fast as possible.

    Raises:
        InvalidInput: It was recorded with an assignment or evasion of somebody's own, and none is
            given, or without, and one is.
    """
    for name, given in (("assignment", assignment), ("evasion", evasion)):
        needed = name in recording.own
        wish = "be the one that was recorded with" if needed else "be the scenario's"
        require((given is not None) == needed, name, wish, "none" if needed else "another")
    first = recording.log
    rows = ticks_of(first.times, recording.scenario.period)
    run_station(
        recording.scenario,
        recording.game,
        first,
        log=log,
        assignment=assignment,
        evasion=evasion,
        mode="replay",
        view=view,
        realtime_rate=realtime_rate,
        ticks=int(rows[-1]) + 1,
    )
    again = {name: samples[rows] for name, samples in read_run_log(log).samples.items()}
    # As bytes: a NaN equals itself then, and minus zero does not equal zero.
    differing = tuple(
        name
        for name, samples in first.samples.items()
        if samples.tobytes() != again[name].tobytes()
    )
    before, after = first.samples[COMMANDS], again[COMMANDS]
    other = np.flatnonzero([a.tobytes() != b.tobytes() for a, b in zip(before, after, strict=True)])
    with np.errstate(invalid="ignore", over="ignore"):
        differences = np.abs(before - after)
    return Comparison(
        ticks=len(before),
        missing=int(rows[-1]) + 1 - len(rows),
        identical=len(other) == 0,
        differing=differing,
        first_difference=int(rows[other[0]]) if len(other) else None,
        greatest_difference=float(np.nanmax(differences, initial=0.0)),
    )


def convert_recording(recording: Recording, path: Path) -> None:
    """Write a recorded run down anew, to the last bit: as MCAP if the name ends so, or as a log.

    What is lost of a damaged log stays lost, and one that was never closed is not closed.

    Args:
        recording: Of a station, as far as its log tells.
        path: Must not exist.

    Raises:
        InvalidInput: The file exists or cannot be written, or the extra is not installed.
    """
    log = recording.log
    kept = {name: len(values) for _, each in log.memory[:1] for name, values in each.items()}
    writer = open_run_writer(
        path,
        recording.scenario,
        recording.game,
        ports={name: samples.shape[1] for name, samples in log.samples.items()},
        pictures=tuple(log.pictures),
        memory=kept,
        about=log.about,
    )
    table = np.concatenate([*log.samples.values()], axis=1)
    # At one time a picture comes after the samples, and what is kept before the next ones.
    events = [(time, 0, row) for row, time in enumerate(log.times.tolist())]
    shown = [(time, name, png) for name, each in log.pictures.items() for time, png in each]
    events += [(time, 1, row) for row, (time, _, _) in enumerate(shown)]
    events += [(time, 2, row) for row, (time, _) in enumerate(log.memory)]
    # Not by `with`: leaving a log open is no failure here.
    try:
        for time, what, row in sorted(events):
            if what == 0:
                writer.samples(time, table[row])
            elif what == 1:
                writer.picture(*shown[row])
            else:
                writer.memory(time, np.concatenate([*log.memory[row][1].values()]))
    except BaseException:
        writer.leave()
        raise
    if log.complete:
        writer.close()
    else:
        writer.leave()
