"""The quick report, made once for all tests that look at it."""

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

# What hangs on how long games last is judged by benchmarks/bench_reproduction.py.
SHORT_GAMES = ("--runs", "2", "--seconds", "2")


@dataclass(frozen=True)
class Report:
    """What the command left."""

    folder: Path
    exit_code: int
    page: str
    summary: dict


@pytest.fixture(scope="session")
def report(made_once):
    """`sightfield reproduce --quick` with few and short games.

    In a process of its own, which takes with it what Drake keeps of the diagrams of all the games,
    and once for all test processes.
    """

    def reproduce(folder: Path) -> None:
        words = ["reproduce", "--quick", *SHORT_GAMES, "--workers", "0", "--json"]
        program = Path(sys.executable).with_name("sightfield")
        command = [program, *words, "--out", folder / "out"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        answer = {"exit_code": done.returncode, "summary": json.loads(done.stdout)}
        (folder / "answer.json").write_text(json.dumps(answer), encoding="utf-8")

    folder = made_once("reproduction", reproduce)
    answer = json.loads((folder / "answer.json").read_text(encoding="utf-8"))
    page = (folder / "out" / "report.html").read_text(encoding="utf-8")
    return Report(folder / "out", answer["exit_code"], page, answer["summary"])
