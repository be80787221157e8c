"""What the operator wants: run, pause, or an emergency stop that stays."""

import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from ...systems.station.command_gate import PAUSED, RUNNING, STOPPED

MODE_NAMES = {RUNNING: "running", PAUSED: "paused", STOPPED: "stopped"}


@dataclass(frozen=True)
class Stop:
    """An emergency stop.

    Attributes:
        who: Asked for it.
        when: By the clock on the wall, hours, minutes and seconds.
        acknowledgement: Who acknowledged it, in words.
    """

    who: str
    when: str
    acknowledgement: str


class Operator:
    """The operator's mode, set from any thread.

    A stop stays: nothing moves again in this run. What is to happen at once on a stop, without
    waiting for the next tick, is given to `on_stop`.

    Attributes:
        stopped: The emergency stop, once there is one.
        starts_said: How often the operator has said start.

    Args:
        running: Whether the run may go on from the start, or waits for the word.
    """

    def __init__(self, *, running: bool = True) -> None:
        self._mode = RUNNING if running else PAUSED
        self._lock = threading.Lock()
        self._at_once: list[Callable[[], object]] = []
        self._listeners: list[Callable[[str, str], object]] = []
        self._view_age: Callable[[], float] = lambda: 0.0
        self.stopped: Stop | None = None
        self.starts_said = 0

    @property
    def view_age(self) -> float:
        """Since the operator's view was last heard [s]; 0 without one."""
        return self._view_age()

    def watch_view(self, age: Callable[[], float]) -> None:
        """Have it known how long the operator's view has been silent.

        Args:
            age: Tells it [s].
        """
        self._view_age = age

    @property
    def mode(self) -> float:
        """Number of the mode: RUNNING, PAUSED or STOPPED."""
        return self._mode

    def on_stop(self, act: Callable[[], object]) -> None:
        """Have something done at once when the operator stops the robots.

        Args:
            act: Does it; may return the robots that acknowledged it.
        """
        self._at_once.append(act)

    def on_word(self, hear: Callable[[str, str], object]) -> None:
        """Have somebody told each word that is obeyed, and who said it, after a stop is done."""
        self._listeners.append(hear)

    def say(self, word: str, who: str = "the program") -> None:
        """Obey start, pause or stop; other words are not heard.

        Args:
            word: What is said.
            who: Says it.
        """
        with self._lock:
            if word == "stop":
                first, self._mode = self._mode != STOPPED, STOPPED
            elif word in ("start", "pause"):
                first = False
                if self._mode != STOPPED:
                    self._mode = RUNNING if word == "start" else PAUSED
                    self.starts_said += word == "start"
            else:
                return
        if first:
            self._stop(who)
        elif word == "stop" or self._mode == STOPPED:
            return
        for hear in self._listeners:
            hear(word, who)

    def _stop(self, who: str) -> None:
        when = time.strftime("%H:%M:%S")
        # Known at once, and completed when robots have answered.
        self.stopped = Stop(who, when, "The controller sends nothing but zeros.")
        for act in self._at_once:
            # The others are to be done whatever becomes of one; the gate is closed already.
            try:
                robots = act()
            except Exception as error:
                words = f"The robots could not be told: {error}."
            else:
                words = _acknowledged(robots)
            if words:
                self.stopped = Stop(who, when, f"{self.stopped.acknowledgement} {words}")

    def toggle(self, who: str = "the program") -> None:
        """Pause, or go on.

        Args:
            who: Says so.
        """
        self.say("pause" if self._mode == RUNNING else "start", who)


def _acknowledged(robots: object) -> str:
    if not isinstance(robots, Iterable):
        return ""
    names = ", ".join(map(str, robots))
    return f"Robots that acknowledged it: {names or 'none'}."
