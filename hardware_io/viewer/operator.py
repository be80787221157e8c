"""What the operator wants: run, pause, or an emergency stop that stays."""

import contextlib
import threading
from collections.abc import Callable

from ...systems.station.command_gate import PAUSED, RUNNING, STOPPED

# What may be said, by word.
WORDS = ("start", "pause", "stop")


class Operator:
    """The operator's mode, set from any thread.

    A stop stays: nothing moves again in this run. What is to happen at once on a stop, without
    waiting for the next tick, is given to `on_stop`.

    Args:
        running: Whether the run may go on from the start, or waits for the word.
    """

    def __init__(self, *, running: bool = True) -> None:
        self._mode = RUNNING if running else PAUSED
        self._lock = threading.Lock()
        self._at_once: list[Callable[[], object]] = []

    @property
    def mode(self) -> float:
        """Number of the mode: RUNNING, PAUSED or STOPPED."""
        return self._mode

    def on_stop(self, act: Callable[[], object]) -> None:
        """Have something done at once when the operator stops the robots."""
        self._at_once.append(act)

    def say(self, word: str) -> None:
        """Obey one of WORDS; others are not heard."""
        with self._lock:
            if word == "stop":
                first, self._mode = self._mode != STOPPED, STOPPED
            elif word in ("start", "pause"):
                first = False
                if self._mode != STOPPED:
                    self._mode = RUNNING if word == "start" else PAUSED
            else:
                return
        if first:
            for act in self._at_once:
                # The others are to be done whatever becomes of one; the gate is closed already.
                with contextlib.suppress(Exception):
                    act()

    def toggle(self) -> None:
        """Pause, or go on."""
        self.say("pause" if self._mode == RUNNING else "start")
