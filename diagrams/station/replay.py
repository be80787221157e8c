"""Playing a recorded run again: the same diagrams must give the same commands, bit for bit."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.systems.framework import System

from ...systems.numerics.errors import InvalidInput, require
from ..scenario_files import build
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.make_tracking import OwnAssignment
from .hardware import RunLog, Shows, read_run_log
from .ports import COMMANDS
from .run import run_station
from .scenario import StationScenario


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
        ticks: How many were played.
        identical: Whether every command is the same, bit for bit.
        differing: Names of all ports of which some sample differs.
        first_difference: Tick of the first command that differs, or None.
        greatest_difference: Between two commands [m/s] or [rad/s].
    """

    ticks: int
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
    try:
        tree, mode = log.about["scenario"], str(log.about["mode"])
        own = tuple(map(str, log.about.get("own", ())))
    except (KeyError, TypeError):
        raise InvalidInput(f"`log` must be of a run of a station; got {path}") from None
    scenario = build(StationScenario, tree)
    return Recording(log, mode, scenario, set_up_game(scenario.tracking), own)


def replay(
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
        ticks=len(first.times),
    )
    second = read_run_log(log)
    # As bytes: a NaN equals itself then, and minus zero does not equal zero.
    differing = tuple(
        name
        for name, samples in first.samples.items()
        if samples.tobytes() != second.samples[name].tobytes()
    )
    before, after = first.samples[COMMANDS], second.samples[COMMANDS]
    rows = np.flatnonzero([a.tobytes() != b.tobytes() for a, b in zip(before, after, strict=True)])
    return Comparison(
        ticks=len(before),
        identical=len(rows) == 0,
        differing=differing,
        first_difference=int(rows[0]) if len(rows) else None,
        greatest_difference=float(np.nanmax(np.abs(before - after), initial=0.0)),
    )
