"""Benchmarks are run on demand, so that nothing else would notice one that cannot even begin."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def bench(*words: str, **environment: str) -> str:
    """What `make bench` prints; -P, as `pytest` has no folder to import from but its own."""
    options = ["-q", "-m", "benchmarks", "-p", "no:cacheprovider", "-n", "0"]
    done = subprocess.run(
        [sys.executable, "-P", "-m", "pytest", *options, *words],
        cwd=ROOT,
        env=os.environ | environment,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout[-2000:]
    return done.stdout


def test_every_benchmark_can_be_collected():
    files = {file.name for file in (ROOT / "benchmarks").glob("bench_*.py")}
    collected = bench("benchmarks", "--collect-only")
    assert {file for file in files if file in collected} == files


def test_games_are_played_in_processes_of_their_own():
    tiny = {"GAMES": "1", "GRID": "0.3", "GAME_SECONDS": "0.2"}
    played = bench("benchmarks/bench_certified_games.py", "-k", "points", **tiny)
    assert "1 passed" in played
