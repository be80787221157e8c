"""What ends a run from outside is an emergency stop first."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from sightfield.diagrams.commands import station_run
from sightfield.diagrams.station.hardware import Operator


def wait_until(condition, patience=10):
    deadline = time.monotonic() + patience
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
    with station_run._Ending(operator).caught() as ending:
        ending.under_way = True
        os.kill(os.getpid(), number)
        wait_until(lambda: operator.stopped is not None)
    assert operator.stopped is not None
    assert operator.stopped.who == who
    assert ending.first == number
    assert signal.getsignal(number) == before


@pytest.fixture
def codes(monkeypatch):
    """What the program ended with, at once instead of after its patience."""
    found: list[int] = []
    monkeypatch.setattr(station_run, "_end_soon", lambda: found.append(station_run._INTERRUPTED))
    return found


def press(times):
    for _ in range(times):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.05)


@pytest.mark.parametrize(("under_way", "times"), [(True, 2), (False, 1)])
def test_a_signal_breaks_off_what_is_no_run_or_was_stopped_before(codes, under_way, times):
    operator = Operator()

    def play():
        with station_run._Ending(operator).caught() as ending:
            ending.under_way = under_way
            press(times)
            time.sleep(10)

    with pytest.raises(KeyboardInterrupt):
        play()
    wait_until(lambda: codes)
    assert codes == [130]
    assert (operator.stopped is not None) == under_way


# A program whose devices hang as they are closed: the main thread waits in C, and Python's own
# handler is not called.
HANGS = """
import threading, time
from sightfield.diagrams.commands import station_run
from sightfield.diagrams.station.hardware import Operator

with station_run._Ending(Operator()).caught() as ending:
    ending.under_way = True
    print("up", flush=True)
    held = threading.Lock()
    held.acquire()
    while True:
        try:
            held.acquire()
        except KeyboardInterrupt:
            pass
"""
BUSY = "while True: pass"


def test_the_second_ends_the_program_though_its_devices_never_close():
    # On a machine that is busy besides.
    busy = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in range(4)]
    program = subprocess.Popen([sys.executable, "-c", HANGS], stdout=subprocess.PIPE)
    try:
        assert program.stdout is not None
        assert program.stdout.readline() == b"up\n"
        program.send_signal(signal.SIGINT)
        time.sleep(0.2)
        program.send_signal(signal.SIGINT)
        assert program.wait(30) == 130
    finally:
        for each in (*busy, program):
            each.kill()
            each.wait()
        program.communicate()


def test_threads_of_a_program_that_caught_signals_have_ended():
    before = threading.active_count()
    with station_run._Ending(Operator()).caught():
        assert threading.active_count() == before + 1
    assert threading.active_count() == before


SIGHTFIELD = Path(sys.executable).with_name("sightfield")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_what_the_terminal_sends_to_all_stops_an_emulated_run_that_is_kept(
    number, code, require_tool, tmp_path
):
    require_tool("avr-gcc", "gcc-avr avr-libc libsimavr-dev")
    words = ["station", "--emulate", "--seconds", "60", "--no-view", "--json"]
    program = subprocess.Popen(
        [SIGHTFIELD, *words, "--out", tmp_path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        process_group=0,
    )
    log = tmp_path / "run.log"
    wait_until(lambda: log.exists() and log.stat().st_size > 50_000, 60)
    os.killpg(program.pid, number)
    said, complaints = program.communicate(timeout=60)
    assert (program.returncode, complaints) == (code, "")
    summary = json.loads(said)
    assert summary == json.loads((tmp_path / "summary.json").read_text())
    assert "held: the operator stopped the run" in [each["text"] for each in summary["events"]]
