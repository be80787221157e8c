"""Benchmarks are run on demand, so that nothing else would notice one that cannot even begin."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_every_benchmark_can_be_collected():
    files = {file.name for file in (ROOT / "benchmarks").glob("bench_*.py")}
    options = ["--collect-only", "-q", "-m", "benchmarks", "-p", "no:cacheprovider", "-n", "0"]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *options, "benchmarks"],
        cwd=ROOT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert {file for file in files if file in done.stdout} == files


def test_games_are_played_in_processes_of_their_own():
    tiny = {"GAMES": "1", "GRID": "0.3", "GAME_SECONDS": "0.2"}
    options = ["-q", "-m", "benchmarks", "-p", "no:cacheprovider", "-n", "0"]
    asked = ["benchmarks/bench_certified_games.py", "-k", "points"]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "pytest", *options, *asked],
        cwd=ROOT,
        env=os.environ | tiny,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    assert "1 passed" in done.stdout
