"""What is sent to all processes of a command reaches the first of them alone."""

import subprocess
import sys

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

if __name__ == "__main__":
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, frame: heard.append(number))
    done = threading.Event()
    ringing = threading.Thread(target=ring)
    ringing.start()
    try:
        pool = worker_pool(2)
        print(sorted(pool.map(abs, (-2, 1))), flush=True)
    finally:
        done.set()
        ringing.join()
    print(len(set(heard)), "heard", flush=True)
    # What is sent to one of them alone still reaches it.
    os.kill(pool.submit(os.getpid).result(), signal.SIGTERM)
    try:
        pool.submit(time.sleep, 60).result(30)
    except Exception as error:
        print(type(error).__name__)
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
    assert done.stdout.splitlines() == ["[1, 2]", "3 heard", "BrokenProcessPool"], done.stderr
    assert done.stderr == ""
