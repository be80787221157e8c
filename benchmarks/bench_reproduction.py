"""What the quick report of the reproduction finds where games are as long as the thesis's."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from sightfield.diagrams.reproduction.exhibits.evidence import DIFFERS

pytestmark = pytest.mark.benchmarks

# One run more of the evaders that come out strongest: two cannot decide what is clear to the eye.
FEW_RUNS = ("--runs", "2", "--opponent-runs", "best_response=3")

# Clear with so few: exhibit, claim, and what becomes of it against the strongest evaders.
KNOWN = (
    ("figure-2.16", "t1 above 50", DIFFERS),
    ("figure-2.16", "74.62 there", DIFFERS),
    ("figure-2.19", "one evader is never lost", DIFFERS),
)

# Horizons [s] at which the claims about times are judged.
HORIZONS = ("120 s", "60 s", "30 s")


def test_claims_about_times_are_judged_as_known(tmp_path):
    program = Path(sys.executable).with_name("sightfield")
    wanted = ("--only", "figure-2.16", "--only", "figure-2.19", *FEW_RUNS, "--workers", "0")
    command = [program, "reproduce", "--quick", *wanted, "--json", "--out", tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    summary = json.loads(done.stdout)
    found = {
        (each["id"], finding["subject"]): finding
        for each in summary["exhibits"]
        for finding in each["findings"]
    }
    print(f"\nquick report, Figures 2.16 to 2.19: {summary['seconds']:.0f} s")
    for exhibit, subject, verdict in KNOWN:
        finding = found[exhibit, subject]
        print(f"  {exhibit}, {subject}: {finding['verdict']}. {finding['ours']}")
        assert finding["verdict"] == verdict
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert all(f"<th>{each}, adversarial</th>" in page for each in HORIZONS)
