"""`sightfield track` as a user meets it."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

SIGHTFIELD = Path(sys.executable).with_name("sightfield")


def sightfield(*arguments, cwd=None):
    """Run the command without a terminal."""
    return subprocess.run(
        [SIGHTFIELD, *map(str, arguments)],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        cwd=cwd,
        check=False,
    )


def test_json_is_alone_on_standard_output():
    done = sightfield("track", "corner_1v1", "--json", "--seed", 3)
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["scenario"] == "corner_1v1"
    assert summary["seed"] == 3
    promised = {"pursuers", "evaders", "tracking_time", "censored", "lost_evader", "wall_time"}
    promised |= {"assignment_changes", "min_clearance", "robot_radius", "realtime_factor"}
    assert promised <= set(summary)


def test_a_run_leaves_its_folder_complete(tmp_path):
    out = tmp_path / "deep" / "out"
    done = sightfield("track", "corner_1v1", "--out", out, "--meshcat", "--realtime", 0)
    assert done.returncode == 0, done.stderr
    assert "http://localhost:" in done.stdout
    names = {"summary.json", "log.npz", "log_units.json", "tracks.png", "replay.html"}
    assert {each.name for each in out.glob("[!.]*")} == names
    summary = json.loads((out / "summary.json").read_text())
    with np.load(out / "log.npz") as log:
        units = json.loads((out / "log_units.json").read_text())
        assert set(units) == set(log.files)
        assert log["time"][-3] <= summary["tracking_time"] <= log["time"][-2]
    # A replay of that run would be taken for one of the next.
    done = sightfield("track", "corner_1v1", "--seconds", 0.2, "--out", out, "--no-replay")
    assert done.returncode == 0, done.stderr
    assert {each.name for each in out.glob("[!.]*")} == names - {"replay.html"}


def test_a_run_that_is_watched_without_a_terminal_goes_by_the_clock():
    done = sightfield("track", "corner_1v1", "--seconds", 2, "--meshcat", "--json")
    assert done.returncode == 0, done.stderr
    # The clock starts before the run is prepared; as fast as possible is far more than this.
    assert json.loads(done.stdout)["realtime_factor"] < 2


def test_a_scenario_of_ones_own_and_its_world_beside_it(sightfield_here, tmp_path):
    (tmp_path / "room.wkt").write_text("POLYGON ((0 0, 4 0, 4 2, 2 2, 2 4, 0 4, 0 0))")
    (tmp_path / "mine.yaml").write_text(
        "world: {file: room.wkt}\n"
        "pursuers: {top_speed: 1.0, positions: [[3, 1]]}\n"
        "evaders: {top_speed: 0.5, positions: [[1, 1]]}\n"
        "seconds: 5\n"
    )
    done = sightfield_here(
        "track", tmp_path / "mine.yaml", "--json", "--set", "pursuers.radius=0.1"
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["robot_radius"] == 0.1


def test_the_teams_of_a_scenario_play_in_another_world(sightfield_here, tmp_path):
    (tmp_path / "room.wkt").write_text(
        "POLYGON ((0 0, 9 0, 9 7, 0 7, 0 0), (3 3, 5 3, 5 5, 3 5, 3 3))"
    )
    runs = [
        sightfield_here(
            "track", "thesis_3v4", "--world", tmp_path / "room.wkt", "--json", "--seed", s
        )
        for s in (1, 1, 2)
    ]
    first, again, other = (json.loads(run.stdout) for run in runs)
    assert first["tracking_time"] == again["tracking_time"]
    assert first["min_clearance"] == again["min_clearance"] >= 0.16
    # The clearance may be the same: that of a robot that runs along a wall.
    figures = ("tracking_time", "min_clearance", "min_body_gap")
    assert [other[name] for name in figures] != [first[name] for name in figures]


def test_teams_of_another_size_play_in_another_world(sightfield_here, tmp_path):
    (tmp_path / "room.wkt").write_text("POLYGON ((0 0, 9 0, 9 7, 0 7, 0 0))")
    sizes = ("--set", "pursuers.count=5", "--set", "evaders.count=2")
    words = ("track", "thesis_3v4", "--world", tmp_path / "room.wkt", "--json", "--seconds", 0.5)
    found = json.loads(sightfield_here(*words, *sizes).stdout)
    assert (found["pursuers"], found["evaders"]) == (5, 2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "`scenario` must be a YAML file or one of"),
        (["--set", "pursuers.top_speed=-1"], "`pursuers.top_speed` must be positive; got -1"),
        (["--set", "pursuers.speed=1"], "`pursuers.speed` must be a key of the scenario"),
        (["--seconds", "nan"], "`seconds` must be a finite number; got nan"),
        (["--realtime", "-1"], "`--realtime` must be zero or positive; got -1"),
        (["--world", "nowhere.yaml"], "nowhere.yaml"),
        (["risk_vectors", "--world", "nowhere.yaml"], "not be waypoints in another world"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(arguments, message, sightfield_here, tmp_path):
    out = tmp_path / "out"
    done = sightfield_here("track", *arguments, "--out", out)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert not out.exists()
    assert not list(tmp_path.iterdir())


def test_a_folder_that_is_a_file_is_found_out_before_the_run(sightfield_here, tmp_path):
    (tmp_path / "out").write_text("precious")
    done = sightfield_here("track", "thesis_4v3", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert "`out` must be a writable folder" in done.stderr
    assert (tmp_path / "out").read_text() == "precious"


def test_nobody_can_drive_without_a_page_but_anybody_can_with_one(sightfield_here):
    done = sightfield_here(
        "track", "corner_1v1", "--set", "evaders.policies=[you]", "--seconds", 1, "--json"
    )
    assert done.returncode == 0, done.stderr
    # Nobody touched the keys.
    assert json.loads(done.stdout)["censored"]


def test_help_has_units(sightfield_here):
    done = sightfield_here("track", "--help")
    assert done.returncode == 0
    assert "[s]" in done.stdout
