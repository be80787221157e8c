"""Signals to all processes of a command reach the first alone; each other one keeps to a core."""

import os
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool

import pytest

from sightfield.diagrams.studies.worker_processes import worker_pool

# A program that gets every signal of its group from the moment on at which a worker begins.
PROGRAM = """
import os, signal, threading, time
from sightfield.diagrams.studies.worker_processes import worker_pool

heard = []

def ring():
    while not done.is_set():
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            os.killpg(0, number)
        time.sleep(0.002)

def slow_abs(number):
    time.sleep(0.2)
    return abs(number)

def open_to_signals():
    return signal.pthread_sigmask(signal.SIG_BLOCK, ()), signal.getsignal(signal.SIGTERM).name

if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, frame: heard.append(number))
    done = threading.Event()
    ringing = threading.Thread(target=ring)
    ringing.start()
    try:
        pool = worker_pool(2)
        print(sorted(pool.map(slow_abs, (-2, 1))), flush=True)
    finally:
        done.set()
        ringing.join()
    print(len(set(heard)), "heard", flush=True)
    # What is sent to one of them alone still ends it.
    print(*pool.submit(open_to_signals).result())
    pool.shutdown()
"""


def test_workers_leave_signals_to_their_parent_from_their_first_moment_on(tmp_path):
    (tmp_path / "program.py").write_text(PROGRAM)
    done = subprocess.run(
        [sys.executable, tmp_path / "program.py"],
        capture_output=True,
        text=True,
        check=False,
        timeout=50,
        process_group=0,
    )
    assert done.stdout.splitlines() == ["[1, 2]", "3 heard", "set() SIG_DFL"], done.stderr
    assert done.stderr == ""


def test_linear_algebra_has_one_thread_in_each_worker(tmp_path):
    """Two in whoever starts them; on fewer cores than threads these spin as they wait."""
    (tmp_path / "program.py").write_text(
        "import numpy\n"
        "from threadpoolctl import threadpool_info\n"
        "from sightfield.diagrams.studies.worker_processes import worker_pool\n"
        "if __name__ == '__main__':\n"
        "    pool = worker_pool(1, preload=['numpy'])\n"
        "    for found in (threadpool_info(), pool.submit(threadpool_info).result()):\n"
        "        print([each['num_threads'] for each in found if each['user_api'] == 'blas'])\n"
        "    pool.shutdown()\n"
    )
    done = subprocess.run(
        [sys.executable, tmp_path / "program.py"],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "2"},
    )
    assert done.stdout.splitlines() == ["[2]", "[1]"]


@pytest.mark.timeout(60)
def test_processes_end_when_they_are_dropped_whatever_they_have_in_hand():
    pool = worker_pool(2)
    assert pool.submit(abs, -3).result() == 3
    held = [pool.submit(time.sleep, 3600) for _ in range(2)]
    while not all(each.running() for each in held):
        time.sleep(0.02)
    pool.drop()
    assert [type(each.exception()) for each in held] == [BrokenProcessPool] * 2
