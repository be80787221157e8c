"""Runs commands in turns, a slice of time each, so that a machine's drift hits them alike."""

import os
import signal
import subprocess
import time
from collections.abc import Sequence


class Racer:
    """A command that runs while it has its turn, with all processes that it starts.

    Attributes:
        took: Time that its turns took so far [s].
        share: Of a round, the time of its turn [s].
    """

    def __init__(self, words: Sequence[str], share: float):
        """Start it; it says a line when it is ready, and stands until its first turn."""
        self.took, self.share = 0.0, share
        self._process = subprocess.Popen(
            words, stdout=subprocess.PIPE, text=True, start_new_session=True
        )
        assert self._process.stdout is not None
        assert self._process.stdout.readline(), f"{words} ended before it was ready"
        os.killpg(self._process.pid, signal.SIGSTOP)

    @property
    def is_done(self) -> bool:
        """Whether it has come to its end; it must have gone well."""
        code = self._process.poll()
        assert code in (None, 0)
        return code == 0

    def take_turn(self) -> None:
        """Run for its share, or to its end."""
        began = time.perf_counter()
        os.killpg(self._process.pid, signal.SIGCONT)
        try:
            self._process.wait(self.share)
        except subprocess.TimeoutExpired:
            os.killpg(self._process.pid, signal.SIGSTOP)
        self.took += time.perf_counter() - began

    def end(self) -> None:
        """End it, if it has not come to its end: what interrupts us does not reach it."""
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)


def race(*racers: Racer) -> list[float]:
    """Let all come to their ends, in turns; the time that each took [s]."""
    try:
        while not all(racer.is_done for racer in racers):
            for racer in racers:
                if not racer.is_done:
                    racer.take_turn()
    finally:
        for racer in racers:
            racer.end()
    return [racer.took for racer in racers]
