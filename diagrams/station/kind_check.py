"""What every kind of robots has to pass before it drives: its link against robots that stand in.

The air between them drops messages, holds them back, repeats and reorders them, and is cut; what
the robots do is read from their true wheels.
"""

import time
from collections import deque
from collections.abc import Callable, Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from ...systems.numerics.errors import SightfieldError
from .hardware import (
    LATE,
    OLDEST_POSES,
    REORDERED,
    REPEATED,
    AirSettings,
    Flight,
    Laboratory,
    RobotFleet,
    RobotKind,
    RobotLink,
    Surroundings,
)

# Robots of the trials, where they stand [m], [m], [rad], and how they drive [m/s], [rad/s].
_ROBOTS = (3, 8)
_STARTS = np.array([[0.0, 0.0, 0.0], [0.0, 2.0, 1.0]])
_DRIVE = np.array([[0.3, 0.0], [0.1, 1.5]])
_STAND = np.zeros((2, 2))
# Between two commands [s].
_PERIOD = 0.05
# How long whatever is to happen may take [s].
_PATIENCE = 4.0
# A wheel that is faster drives; one that is slower hardly moves [m/s].
_DRIVES, _HARDLY = 0.06, 0.02
# A robot's brakes, and a machine that is busy with something else [s].
_BRAKES = 0.3
# Part of the messages that is dropped, how often it is looked meanwhile, for how long commands must
# have gone out in time before [s], and part of the looks at which robots are to drive.
_DROPPED, _LOOKS, _REMEMBERED, _DRIVEN = 0.2, 240, 0.3, 0.8
_NOISE = 60


@dataclass(frozen=True)
class KindTrial:
    """What came of one trial.

    Attributes:
        name: What was tried.
        passed: Whether robots did what they have to.
        words: What they did.
    """

    name: str
    passed: bool
    words: str


class _Failed(Exception):
    """A trial failed; the message says how."""


def check_kind(kind: RobotKind, names: Collection[str] | None = None) -> Iterator[KindTrial]:
    """Try a kind of robots, one trial after the other, in the time of the wall.

    Args:
        kind: Which.
        names: Of the trials; None: all.

    Raises:
        SightfieldError: Its robots that stand in cannot be opened.
    """
    around = Surroundings(
        starts=_STARTS, air=AirSettings(delay=0.005), silence=kind.stops_after, seed=1
    )
    with kind.open_stand_in(RobotFleet(robots=_ROBOTS), around) as (laboratory, fleet):
        trials = _Trials(kind, laboratory, fleet)
        with trials:
            for name, trial in trials.all():
                if names is not None and name not in names:
                    continue
                laboratory.restore_radio()
                laboratory.air.settings = around.air
                try:
                    yield KindTrial(name, True, trial())
                except _Failed as failure:
                    yield KindTrial(name, False, str(failure))
                except SightfieldError as error:
                    yield KindTrial(name, False, f"an error: {error}")


class _Trials:
    """The trials, with a link and a laboratory."""

    def __init__(self, kind: RobotKind, laboratory: Laboratory, fleet: RobotFleet) -> None:
        self._kind, self._laboratory, self._fleet = kind, laboratory, fleet
        self._link: RobotLink = kind.open_link(fleet)
        self._stack = ExitStack()
        self._rng = np.random.default_rng(2)
        # When the last commands went out [s].
        self._sent: deque[float] = deque(maxlen=32)

    def __enter__(self) -> None:
        self._link.connect()
        self._stack.callback(lambda: self._link.close())

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def all(self) -> list[tuple[str, Callable[[], str]]]:
        """Every trial with its name, in the order in which they build on one another."""
        return [
            ("not armed", self._not_armed),
            ("armed", self._armed),
            ("dropped messages", self._dropped),
            ("late messages", self._late),
            ("repeated messages", self._repeated),
            ("reordered messages", self._reordered),
            ("noise", self._noise),
            ("stop", self._stop),
            ("a command that the stop overtook", self._overtaken),
            ("silence", self._silence),
            ("reset", self._reset),
            ("close", self._close),
            ("connecting again", self._again),
        ]

    def _not_armed(self) -> str:
        self._expect_rest(lambda: self._link.send_commands(_DRIVE), 0.3)
        return "robots that were not armed follow no command"

    def _armed(self) -> str:
        self._arm()
        before = self._reported_counts()
        self._drive(lambda: bool((self._wheels() > 0.8 * self._wanted()).all()))
        self._drive(lambda: self._has_counted(before))
        return "robots answer, drive as told, and report their way"

    def _dropped(self) -> str:
        self._ready()
        self._drive(self._all_drive)
        self._laboratory.air.settings = AirSettings(frame_loss=_DROPPED, delay=0.005)
        driven: list[float] = []

        def enough() -> bool:
            # Whose commands a busy machine sends late stops without anything being dropped.
            if self._sends_in_time():
                driven.append(float(self._wheels().max(axis=1).min()))
            return len(driven) >= _LOOKS

        self._drive(enough, 10 * _PATIENCE)
        part = float(np.mean(np.array(driven) > _DRIVES))
        words = f"with a part of {_DROPPED:g} lost robots drive at {part:.0%} of the looks"
        return self._judge(part >= _DRIVEN, words)

    def _late(self) -> str:
        def happen() -> None:
            self._send_kept(_DRIVE)
            time.sleep(OLDEST_POSES + 0.1)
            self._laboratory.air.let_go()

        return self._of_messages(LATE, happen)

    def _repeated(self) -> str:
        def happen() -> None:
            first = self._send_kept(_DRIVE)
            self._send_kept(_STAND)
            self._laboratory.air.let_go(lambda kept: [*kept, *first])

        return self._of_messages(REPEATED, happen)

    def _reordered(self) -> str:
        def happen() -> None:
            first = self._send_kept(_DRIVE)
            self._send_kept(_STAND)
            self._laboratory.air.let_go(lambda kept: [*_without(kept, first), *first])

        return self._of_messages(REORDERED, happen)

    def _overtaken(self) -> str:
        def happen() -> None:
            first = self._send_kept(_DRIVE)
            self._link.stop(timeout=0.1)
            self._laboratory.air.let_go(lambda kept: [*_without(kept, first), *first])

        words = self._of_messages(REORDERED, happen)
        self._all_answer("stop", self._link.stop(timeout=_PATIENCE))
        return words

    def _noise(self) -> str:
        self._ready()
        air, before = self._laboratory.air, self._link.health().refused
        for k in range(_NOISE):
            robot, noise = 1 + k % 2, self._rng.bytes(int(self._rng.integers(1, 90)))
            for sender, receiver in ((0, robot), (robot, 0)):
                air.send(Flight(sender, receiver, noise, True), self._laboratory.time())
        self._expect_rest(lambda: self._link.send_commands(_STAND), 0.3)
        self._drive(self._all_drive)
        refused = self._link.health().refused - before
        return f"robots do not follow it, and the link goes on; it refused {refused}"

    def _stop(self) -> str:
        self._ready()
        self._drive(self._all_drive)
        at = self._laboratory.time()
        self._all_answer("stop", self._link.stop(timeout=_PATIENCE))
        rest = self._rest_after(at, self._link.heartbeat)
        words = f"robots stand {rest:.2f} s after a stop"
        self._judge(rest <= _BRAKES, words)
        self._expect_rest(lambda: self._link.send_commands(_DRIVE), 0.3)
        return f"{words}, and follow no command until they are armed"

    def _silence(self) -> str:
        self._ready()
        self._drive(self._all_drive)
        at = self._laboratory.cut_radio()
        rest = self._rest_after(at, lambda: self._link.send_commands(_DRIVE))
        return self._in_silence(rest, "the last message")

    def _reset(self) -> str:
        self._ready()
        self._drive(self._all_drive)
        self._laboratory.reset_robot(0)
        self._send_until(_STAND, lambda: bool((self._wheels() < 1e-3).all()), "come to rest")
        self._arm()
        self._drive(self._all_drive)
        before = self._reported_counts()
        self._drive(lambda: self._has_counted(before))
        return "a robot that was reset is armed again, drives, and is heard"

    def _close(self) -> str:
        self._ready()
        self._drive(self._all_drive)
        at = self._laboratory.time()
        self._link.close()
        return self._in_silence(self._rest_after(at, lambda: None), "the link was closed")

    def _again(self) -> str:
        self._link = self._kind.open_link(self._fleet)
        self._link.connect()
        self._arm()
        self._drive(self._all_drive)
        return "a link that is opened anew arms the robots, and they drive"

    def _of_messages(self, what: str, happen: Callable[[], None]) -> str:
        """Robots at rest, told to drive by messages that are not as they should be."""
        self._ready()
        self._laboratory.air.keep()
        happen()
        at = self._laboratory.time()
        if what in self._kind.recognises:
            # What begins to turn between two messages is stopped by the second.
            self._expect_rest(lambda: None, 0.25, after=0.15)
            return "robots do not follow them"
        rest = self._rest_after(at, lambda: None)
        return f"robots need not see that; {self._in_silence(rest, 'the last of them')}"

    def _in_silence(self, rest: float, what: str) -> str:
        limit = self._kind.stops_after
        words = f"robots stand {rest:.2f} s after {what}, {limit:g} s and braking being allowed"
        return self._judge(rest <= limit + _BRAKES, words)

    def _judge(self, good: bool, words: str) -> str:
        if not good:
            raise _Failed(words)
        return words

    def _arm(self) -> None:
        self._all_answer("arm", self._link.arm(timeout=_PATIENCE))

    def _all_answer(self, what: str, answered: tuple[int, ...]) -> None:
        silent = set(_ROBOTS) - set(answered)
        self._judge(not silent, f"robots {sorted(silent)} do not answer to {what}")

    def _ready(self) -> None:
        """Armed, and at rest."""
        self._arm()
        self._send_until(_STAND, lambda: bool((self._wheels() < 1e-3).all()), "come to rest")

    def _drive(self, until: Callable[[], bool], patience: float = _PATIENCE) -> None:
        self._send_until(_DRIVE, until, "drive as told, and say so", patience)

    def _send_until(
        self,
        commands: np.ndarray,
        until: Callable[[], bool],
        what: str,
        patience: float = _PATIENCE,
    ) -> None:
        end, due = time.monotonic() + patience, 0.0
        while not until():
            if time.monotonic() > end:
                raise _Failed(f"robots do not {what}; wheels turn at {self._told_wheels()} m/s")
            if time.monotonic() >= due:
                self._link.send_commands(commands)
                self._sent.append(time.monotonic())
                due = time.monotonic() + _PERIOD
            time.sleep(0.005)

    def _sends_in_time(self) -> bool:
        """Whether commands went out every period for as long as robots remember them."""
        now = time.monotonic()
        lately = [each for each in self._sent if each > now - _REMEMBERED]
        gaps = np.diff([now - _REMEMBERED, *lately, now])
        return bool((gaps < 1.5 * _PERIOD).all())

    def _send_kept(self, commands: np.ndarray) -> list[Flight]:
        """Send once while the air keeps everything; returns what went to the robots."""
        air = self._laboratory.air
        before, end = len(air.kept()), time.monotonic() + _PATIENCE
        self._link.send_commands(commands)
        while True:
            sent = [each for each in air.kept()[before:] if each.sender == 0]
            if {each.receiver for each in sent} >= {1, 2}:
                return sent
            if time.monotonic() > end:
                raise _Failed("a command does not reach the robots")
            time.sleep(0.005)

    def _expect_rest(
        self, meanwhile: Callable[[], object], duration: float, after: float = 0.0
    ) -> None:
        """Robots that stand, and go on standing for a time [s] that begins a while after now."""
        # By the clock of the robots, which are late where the machine is.
        began, due = self._laboratory.time(), 0.0
        while (snapshot := self._laboratory.snapshot()).time < began + after + duration:
            moves = np.abs(snapshot.wheel_speeds).max() > _HARDLY
            if snapshot.time > began + after and moves:
                raise _Failed(f"robots move; their wheels turn at {self._told_wheels()} m/s")
            if time.monotonic() >= due:
                meanwhile()
                due = time.monotonic() + _PERIOD
            time.sleep(0.005)

    def _rest_after(self, at: float, meanwhile: Callable[[], object]) -> float:
        """How long after a time of the laboratory [s] all robots stand for good."""
        patience = self._kind.stops_after + _PATIENCE
        end, due, still = time.monotonic() + patience, 0.0, 0.0
        while time.monotonic() < end:
            if time.monotonic() >= due:
                meanwhile()
                due = time.monotonic() + _PERIOD
            time.sleep(0.005)
            # Messages that are under way yet may set it going again.
            snapshot = self._laboratory.snapshot()
            still = float(snapshot.still_since.max())
            if snapshot.time > max(still, at) + 0.1:
                return max(still - at, 0.0)
        raise _Failed(f"robots do not come to rest within {patience:g} s")

    def _wheels(self) -> np.ndarray:
        return np.abs(self._laboratory.wheel_speeds())

    def _told_wheels(self) -> str:
        return ", ".join(f"{each:.2f}" for each in self._wheels().ravel())

    def _wanted(self) -> np.ndarray:
        across = 0.5 * self._fleet.chassis.track_width * _DRIVE[:, 1]
        return np.abs(np.stack([_DRIVE[:, 0] - across, _DRIVE[:, 0] + across], axis=1))

    def _all_drive(self) -> bool:
        return bool((self._wheels().max(axis=1) > _DRIVES).all())

    def _reported_counts(self) -> np.ndarray:
        reports = self._link.telemetry()
        return np.array([reports[each].counts if each in reports else (0, 0) for each in _ROBOTS])

    def _has_counted(self, before: np.ndarray) -> bool:
        """Whether reports tell some centimetres of way, of each wheel its way."""
        centimetres = 3 * self._fleet.chassis.counts_per_metre / 100
        ways = self._reported_counts() - before
        return bool((ways[0] > centimetres).all() and ways[1, 1] - ways[1, 0] > centimetres)


def _without(flights: list[Flight], some: list[Flight]) -> list[Flight]:
    return [each for each in flights if not any(each is other for other in some)]
