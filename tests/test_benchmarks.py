"""Benchmarks are run on demand, so that nothing else would notice one that cannot even begin."""

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
