"""`sightfield social` as a user meets it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SIGHTFIELD = Path(sys.executable).with_name("sightfield")


def sightfield(*arguments):
    """Run the command without a terminal."""
    return subprocess.run(
        [SIGHTFIELD, *map(str, arguments)],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )


def test_a_search_leaves_its_folder_complete_and_json_alone_on_standard_output(tmp_path):
    out = tmp_path / "deep" / "out"
    done = sightfield(
        *("social", "--seconds", 1, "--seed", 4, "--set", "agents.friending=[1, 1, 1]"),
        *("--json", "--out", out),
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary == json.loads((out / "summary.json").read_text())
    assert summary["scenario"] == "thesis_maze"
    assert summary["network"] == "memory"
    assert summary["seed"] == 4
    promised = {"time_to_first_location", "location_error", "tracking_error", "connected_fraction"}
    promised |= {"all_connected_fraction", "requests_sent", "pictures_scanned", "collisions"}
    assert promised <= set(summary)
    assert len(summary["connected_fraction"]) == 3
    names = {"summary.json", "log.npz", "log_units.json", "connectivity.png", "search.png"}
    names |= {"matches.png", "replay.html"}
    assert {each.name for each in out.glob("[!.]*")} == names
    with np.load(out / "log.npz") as log:
        assert set(log.files) == set(json.loads((out / "log_units.json").read_text()))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "`scenario` must be a YAML file or one of choosy_crowd, thesis_maze"),
        (["--set", "search.requests=0"], "`search.requests` must be at least 1; got 0"),
        (["--network", "matrix"], "`--accounts` must name a file of accounts; got nothing"),
        (["--network", "smoke"], "`--network` must be one of memory, matrix; got smoke"),
        (["--network", "matrix", "--accounts", "nowhere.yaml"], "`accounts` must be a file"),
        (["--realtime", "-1"], "`--realtime` must be zero or positive; got -1"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(arguments, message, sightfield_here, tmp_path):
    done = sightfield_here("social", *arguments, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
