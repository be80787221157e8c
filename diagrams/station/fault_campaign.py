"""Faults in an emulated laboratory, one after another: how soon robots stand, and what is said."""

import contextlib
import math
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ...systems.numerics.errors import SightfieldError, require
from ...systems.numerics.station.supervision import Reason
from ..tracking.game import TrackingGame
from .hardware import (
    Devices,
    FaultyPoses,
    Operator,
    PoseFault,
    PoseReading,
    displaced,
    find_kind,
    frozen,
    read_run_log,
    stuck,
    swapped,
)
from .ports import REASON
from .run import run_station
from .scenario import StationScenario
from .session import open_laboratory

# A robot that is to be affected has a wheel that turns faster than this [m/s].
_MOVING = 0.05
# How long one may take to move [s], and to stand after the fault beside the silence after which it
# stops by itself.
_UNTIL_IT_MOVES, _UNTIL_IT_STANDS = 6.0, 2.0
# How long a fault is left once robots stand, so that it is told [s]: a robot reports five times a
# second, and a tenth of the reports is lost.
_LEFT = 1.0
# A fault that shows in the way of a wheel alone shows when that has turned so far since [m]: a
# robot that stands shows none, and less drowns in slip and in how exactly moments are known.
VISIBLE_WAY = 0.02
# How long robots stand while they are carried back, before and after [s], and where they are then
# [m].
_CARRIED, _AT_START = 0.25, 0.01


@dataclass(frozen=True)
class Fault:
    """Something that goes wrong.

    Attributes:
        robots: How many robots it is about; 0: all.
        do: Makes it happen, given the poses, the EmulatedLaboratory and the robots.
        undo: Mends it.
        wheels: Of the first robot, in whose way it shows, 0 for the left; none: it shows at once.
    """

    robots: int
    do: Callable[[FaultyPoses, Any, Sequence[int]], None]
    undo: Callable[[FaultyPoses, Any, Sequence[int]], None]
    wheels: tuple[int, ...] = ()


@dataclass(frozen=True)
class Moment:
    """A fault that happened.

    Attributes:
        fault: Its name.
        robots: Which are affected.
        time, until: Of the run, when it happened and when it was mended [s].
        rest: From then until all of them stood still [s]; infinite: they did not.
        visible: From then until it showed in the data [s]: when one of the wheels in whose way it
            shows had turned 2 cm. Infinite: robots stood before.
        reasons: What was said of each of them until the fault was mended.
        others: What was said of any other robot meanwhile.
    """

    fault: str
    robots: tuple[int, ...]
    time: float
    until: float
    rest: float
    visible: float = 0.0
    reasons: tuple[tuple[Reason, ...], ...] = ()
    others: tuple[Reason, ...] = ()

    @property
    def noticed(self) -> float:
        """From when it showed until all of them stood still [s]."""
        return max(self.rest - self.visible, 0.0)


def _of_poses(
    robots: int,
    make: Callable[[PoseReading, Sequence[int]], PoseFault],
    wheels: tuple[int, ...] = (),
) -> Fault:
    return Fault(
        robots,
        lambda poses, laboratory, who: poses.spoil(make(poses.read(), who)),
        lambda poses, laboratory, who: poses.mend(),
        wheels,
    )


def _of_an_encoder(sense: int) -> Fault:
    return Fault(
        1,
        lambda poses, laboratory, who: laboratory.set_encoder(who[0], 0, sense),
        lambda poses, laboratory, who: laboratory.set_encoder(who[0], 0, 1),
        (0,),
    )


# What can go wrong, by name.
FAULTS = {
    "two bodies swapped": _of_poses(2, lambda _, who: swapped(*who)),
    "heading turned by pi": _of_poses(1, lambda _, who: displaced(who[0], (0.0, 0.0, math.pi))),
    "pose jumps by 1 m": _of_poses(1, lambda _, who: displaced(who[0], (0.6, 0.8, 0.0))),
    "pose outside the world": _of_poses(1, lambda _, who: displaced(who[0], (50.0, 0.0, 0.0))),
    "pose stuck": _of_poses(
        1, lambda last, who: stuck(who[0], last.poses[who[0]].copy()), wheels=(0, 1)
    ),
    "motion capture frozen": _of_poses(0, lambda last, _: frozen(last)),
    "robot reset": Fault(
        1,
        lambda poses, laboratory, who: laboratory.reset_robot(who[0]),
        lambda poses, laboratory, who: None,
    ),
    "encoder dead": _of_an_encoder(0),
    "encoder reversed": _of_an_encoder(-1),
    "radio cut": Fault(
        0,
        lambda poses, laboratory, who: laboratory.cut_radio(),
        lambda poses, laboratory, who: laboratory.restore_radio(),
    ),
}


class _Over(Exception):
    """The campaign is done."""


def run_faults(
    scenario: StationScenario,
    game: TrackingGame,
    names: Sequence[str],
    *,
    log: Path,
    seed: int = 0,
) -> list[Moment]:
    """Let faults happen to moving robots at random moments of a run in emulation.

    Before each of them robots are carried to their starts and told to drive.

    Args:
        scenario: The laboratory.
        game: Its game, set up.
        names: Of the faults, in the order in which they happen.
        log: File for the run's log, which must not exist.
        seed: Of moments and robots.

    Raises:
        InvalidInput: A name is unknown.
        SightfieldError: The emulation cannot be built, or fails.
    """
    for name in names:
        require(name in FAULTS, "names", f"be of {', '.join(FAULTS)}", name)
    patience = find_kind(scenario.radio.kind).stops_after + _UNTIL_IT_STANDS
    each = 2 * _CARRIED + _UNTIL_IT_MOVES + patience + 2 * _LEFT + 2.0
    scenario = replace(scenario, seconds=each * (len(names) + 1))
    operator = Operator(running=False)
    with open_laboratory(scenario, game, "emulate", operator) as devices:
        assert isinstance(devices, Devices)
        poses = FaultyPoses(devices.poses)
        campaign = _Campaign(game, poses, devices.laboratory, operator, names, seed, patience)
        with contextlib.suppress(_Over):
            done = run_station(
                scenario,
                game,
                replace(devices, poses=poses),
                log=log,
                mode="emulate",
                operator=operator,
                ticks=math.ceil(scenario.seconds / scenario.period),
                at_tick=campaign.at_tick,
            )
            if done.failure:
                raise SightfieldError(done.failure)
    return _told(campaign.moments, log, scenario)


class _Campaign:
    """What happens beside the run, in a thread of its own."""

    def __init__(
        self,
        game: TrackingGame,
        poses: FaultyPoses,
        laboratory: Any,
        operator: Operator,
        names: Sequence[str],
        seed: int,
        patience: float,
    ) -> None:
        self._starts = np.concatenate([game.pursuer_starts, game.evader_starts])
        self._poses, self._laboratory = poses, laboratory
        self._operator, self._names = operator, names
        self._rng, self._patience = np.random.default_rng(seed), patience
        self._now = 0.0
        self._failure: Exception | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)
        self.moments: list[Moment] = []

    def at_tick(self, now: float) -> None:
        self._now = now
        if self._thread.ident is None:
            self._thread.start()
        elif not self._thread.is_alive():
            if self._failure is not None:
                raise self._failure
            raise _Over

    def _run(self) -> None:
        try:
            for name in self._names:
                self._carry_back()
                self._let_happen(name, FAULTS[name])
        except Exception as error:
            self._failure = error

    def _carry_back(self) -> None:
        self._operator.say("pause")
        time.sleep(_CARRIED)
        for robot, start in enumerate(self._starts):
            self._laboratory.place(robot, start)
        # However late a busy machine does it: who is carried after the start has jumped.
        _wait(self._are_seen_at_their_starts, _UNTIL_IT_MOVES)
        seen = self._now
        time.sleep(_CARRIED)
        _wait(lambda: self._now >= seen + _CARRIED, _UNTIL_IT_MOVES)
        self._operator.say("start")

    def _are_seen_at_their_starts(self) -> bool:
        off = self._poses.read().poses[:, :2] - self._starts[:, :2]
        return bool((np.abs(off) < _AT_START).all())

    def _let_happen(self, name: str, fault: Fault) -> None:
        laboratory, count = self._laboratory, len(self._starts)
        chosen = self._rng.permutation(count)[: fault.robots or count]
        time.sleep(self._rng.uniform(0.3, 2.0))
        if not _wait(lambda: self._fastest(chosen) > _MOVING, _UNTIL_IT_MOVES):
            # One that does not drive cannot be stopped; another may.
            chosen = np.argsort(-np.abs(laboratory.wheel_speeds()).max(axis=1))[: len(chosen)]
        began, now = laboratory.time(), self._now
        robots = tuple(int(robot) for robot in chosen)
        way = _Way(laboratory, robots[0], fault.wheels)
        fault.do(self._poses, laboratory, robots)

        def stand() -> bool:
            # What stands already stood before.
            way.look()
            return self._still_since(chosen) < math.inf

        stands = _wait(stand, self._patience)
        rest = max(self._still_since(chosen) - began, 0.0) if stands else math.inf
        time.sleep(_LEFT)
        self.moments.append(Moment(name, robots, now, self._now, rest, way.visible))
        fault.undo(self._poses, laboratory, robots)

    def _fastest(self, robots: np.ndarray) -> float:
        return float(np.abs(self._laboratory.wheel_speeds()[robots]).max())

    def _still_since(self, robots: np.ndarray) -> float:
        return float(self._laboratory.snapshot().still_since[robots].max())


class _Way:
    """What some wheels of a robot have turned from now on, and when that is seen.

    Attributes:
        visible: From now until one of them had turned far enough [s]; 0 without wheels.

    Args:
        laboratory: Where the robot is.
        robot: Its number, from 0.
        wheels: 0 for the left, 1 for the right.
    """

    def __init__(self, laboratory: Any, robot: int, wheels: tuple[int, ...]) -> None:
        self._laboratory, self._robot, self._wheels = laboratory, robot, list(wheels)
        self._began, self._speeds = self._now()
        self._time, self._ways = self._began, np.zeros(len(wheels))
        self.visible = math.inf if wheels else 0.0

    def look(self) -> None:
        """Count what has been turned since it was last looked."""
        time, speeds = self._now()
        self._ways += 0.5 * (time - self._time) * (speeds + self._speeds)
        self._time, self._speeds = time, speeds
        if math.isinf(self.visible) and self._ways.max() >= VISIBLE_WAY:
            self.visible = time - self._began

    def _now(self) -> tuple[float, np.ndarray]:
        snapshot = self._laboratory.snapshot()
        return snapshot.time, np.abs(snapshot.wheel_speeds[self._robot][self._wheels])


def _wait(until: Callable[[], bool], patience: float) -> bool:
    """Whether something came about within a time [s]."""
    end = time.monotonic() + patience
    while not until():
        if time.monotonic() > end:
            return False
        time.sleep(0.002)
    return True


def _told(moments: Sequence[Moment], log: Path, scenario: StationScenario) -> list[Moment]:
    """The moments with what the log says of them."""
    run = read_run_log(log)
    reasons = np.rint(run.samples[REASON]).astype(int)
    found = []
    for moment in moments:
        # By the run's own time, which a busy machine holds up: afterwards robots are carried.
        since, until = moment.time + 0.5 * scenario.period, moment.until + 0.5 * scenario.period
        rows = (run.times > since) & (run.times < until)
        said = [_said(reasons[rows][:, [robot]]) for robot in moment.robots]
        rest = [robot for robot in range(scenario.size) if robot not in moment.robots]
        others = _said(reasons[rows][:, rest])
        found.append(replace(moment, reasons=tuple(said), others=others))
    return found


def _said(reasons: np.ndarray) -> tuple[Reason, ...]:
    """Which reasons there are, without NONE."""
    return tuple(Reason(number) for number in np.unique(reasons) if number != Reason.NONE)
