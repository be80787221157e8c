"""`sightfield camera track` as a user meets it."""

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


def test_a_run_leaves_its_folder_complete_and_json_alone_on_standard_output(tmp_path):
    out = tmp_path / "out"
    done = sightfield("camera", "track", "--seconds", 1, "--weight", 0.7, "--json", "--out", out)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary == json.loads((out / "summary.json").read_text())
    assert summary["scenario"] == "omni_1v1"
    assert summary["senses"] == "pictures"
    assert summary["weight"] == 0.7
    assert summary["tracking_time"] == pytest.approx(1.0)
    assert 0 < summary["estimation_error_rms"] < 0.05
    names = {"summary.json", "log.npz", "log_units.json", "tracks.png", "estimates.png"}
    assert {each.name for each in out.glob("[!.]*")} == {*names, "replay.html"}
    with np.load(out / "log.npz") as log:
        assert set(log.files) == set(json.loads((out / "log_units.json").read_text()))


def test_weights_are_swept(sightfield_here, tmp_path):
    done = sightfield_here(
        *("camera", "track", "--truth", "--seconds", 1, "--sweep", "0,0.5,1", "--seeds", 2),
        *("--json", "--out", tmp_path),
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["seeds"] == [0, 1]
    assert [row["weight"] for row in found["means"]] == [0, 0.5, 1]
    assert {each.name for each in tmp_path.glob("[!.]*")} == {"weights.json", "weights.png"}
    # Nobody is lost within a second: these times are lower bounds, and marked as such.
    assert [row["censored_runs"] for row in found["means"]] == [2, 2, 2]
    table = sightfield_here("camera", "track", "--truth", "--seconds", 0.5, "--sweep", "1")
    assert ">=0.5" in table.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["omni_9v9"], "`scenario` must be a YAML file or one of omni_1v1, omni_2v2; got omni_9v9"),
        (["--weight", "2"], "`vision.weight` must lie in [0, 1]; got 2.0"),
        (["--set", "vision.colours=[puce]"], "`vision.colours.0` must be one of"),
        (["--set", "vision.calibration=nowhere.json"], "`calibration` must be readable; got"),
        (["--sweep", "0,half"], "`--sweep` must be numbers, as 0,0.5,1; got 0,half"),
        (["--sweep", "0,7", "--truth"], "`weight` must lie in [0, 1]; got 7.0"),
        (["--sweep", "0", "--seeds", "0"], "`--seeds` must be positive; got 0"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(arguments, message, sightfield_here, tmp_path):
    done = sightfield_here("camera", "track", *arguments, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert message in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()
