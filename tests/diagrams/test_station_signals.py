"""What ends a run from outside is an emergency stop first."""

import os
import signal
import threading
import time

import pytest

from sightfield.diagrams.commands.station_commands import run
from sightfield.diagrams.station.hardware import Operator


def wait_until(condition):
    deadline = time.monotonic() + 10
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.005)


@pytest.mark.parametrize(
    ("number", "who"),
    [
        (signal.SIGHUP, "a terminal that closed"),
        (signal.SIGTERM, "a request to end"),
        (signal.SIGINT, "Ctrl-C"),
    ],
)
def test_the_first_signal_stops_the_robots(number, who):
    operator, before = Operator(), signal.getsignal(number)
    with run._ends_orderly(operator):
        os.kill(os.getpid(), number)
        wait_until(lambda: operator.stopped is not None)
    assert operator.stopped is not None
    assert operator.stopped.who == who
    assert signal.getsignal(number) == before


def test_the_second_ends_the_program_though_its_devices_never_close(monkeypatch):
    ended = threading.Event()
    codes = []

    def leave(code):
        codes.append(code)
        ended.set()

    monkeypatch.setattr(run, "_LAST_PATIENCE", 0.05)
    monkeypatch.setattr(run.os, "_exit", leave)

    def press_twice():
        with run._ends_orderly(Operator()):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.01)
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(10)

    with pytest.raises(KeyboardInterrupt):
        press_twice()
    # A device that hangs while it is closed.
    assert ended.wait(10)
    assert codes == [130]
