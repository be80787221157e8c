"""The quick report, made once for all tests that look at it."""

import fcntl
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

# One run more of the evaders that come out strongest: two cannot decide what is clear to the eye.
FEW_RUNS = ("--runs", "2", "--opponent-runs", "best_response=3")


@dataclass(frozen=True)
class Report:
    """What the command left."""

    folder: Path
    exit_code: int
    page: str
    summary: dict


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    """`sightfield reproduce --quick` with as few runs as decide the claims.

    In a process of its own, which takes with it what Drake keeps of the diagrams of all the games,
    and once for all test processes: whoever comes second waits for it.
    """
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, said = shared / "reproduction", shared / "reproduction.json"
    with (shared / "reproduction.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not said.exists():
            words = ["reproduce", "--quick", *FEW_RUNS, "--workers", "0", "--json", "--out", folder]
            program = Path(sys.executable).with_name("sightfield")
            done = subprocess.run([program, *words], capture_output=True, text=True, check=False)
            answer = {"exit_code": done.returncode, "summary": json.loads(done.stdout)}
            said.write_text(json.dumps(answer), encoding="utf-8")
    answer = json.loads(said.read_text(encoding="utf-8"))
    page = (folder / "report.html").read_text(encoding="utf-8")
    return Report(folder, answer["exit_code"], page, answer["summary"])
