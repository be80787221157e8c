"""`sightfield study` as a user meets it."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.systems.numerics.errors import InvalidInput


def study(*words):
    """Run the command in this process."""
    return CliRunner().invoke(make_app(), ["study", *map(str, words)], catch_exceptions=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A finished study of two runs a cell."""
    out = tmp_path_factory.mktemp("study") / "out"
    done = study("tracking", "--runs", 2, "--seconds", 2, "--workers", 0, "--out", out)
    assert done.exit_code == 0
    assert "t1: uniform risk vector: mean up to the horizon [s], 95% interval" in done.stdout
    return out


def test_a_study_leaves_its_folder_complete(folder):
    names = {"study.json", "table.parquet", "summary.json", "means.png", "curves.png"}
    assert {file.name for file in folder.iterdir()} == names


def test_the_summary_tells_what_the_table_holds(folder):
    summary = json.loads((folder / "summary.json").read_text())
    table = pq.read_table(folder / "table.parquet").to_pylist()
    assert len(summary["cells"]) == 48
    for name, cell in summary["cells"].items():
        times = [row["time"] for row in table if row["cell"] == name]
        assert cell["mean"]["value"] == pytest.approx(np.mean(times))
        assert cell["mean"]["low"] <= cell["mean"]["value"] <= cell["mean"]["high"] <= 2.0
        assert f"{cell['pursuers']}v{cell['evaders']}" == name[:3]
        kept = [row["censored"] for row in table if row["cell"] == name]
        assert cell["kept"]["value"] == np.mean(kept)
    # t1, t2 and t3 of each of 16 teams, two by two.
    assert len(summary["comparisons"]) == 48
    assert all(each["holm_p"] >= each["p_value"] for each in summary["comparisons"])


def test_resuming_a_finished_study_says_the_same_again(folder):
    before = (folder / "summary.json").read_bytes()
    done = study("tracking", "--resume", folder, "--json")
    assert json.loads(done.stdout) == json.loads(before)
    assert (folder / "summary.json").read_bytes() == before


def test_any_run_can_be_replayed_alone(folder, tmp_path):
    only = ("--only", "2v2-majority:1")
    done = study("tracking", "--resume", folder, *only, "--out", tmp_path / "run", "--json")
    summary = json.loads(done.stdout)
    rows = pq.read_table(folder / "table.parquet").to_pylist()
    (row,) = [row for row in rows if (row["cell"], row["run"]) == ("2v2-majority", 1)]
    assert summary["tracking_time"] == row["time"]
    assert summary["seed"] == row["seed"]
    left = {file.name for file in (tmp_path / "run").iterdir()}
    assert {"replay.html", "log.npz", "scenario.yaml"} <= left


def test_settings_reach_games_and_arenas():
    words = ("--only", "3v2-borda_min:0", "--seconds", 1, "--json")
    settings = ("--set", "evaders.policies=[random_walk]", "--set", "arena.obstacles=0")
    done = study("assignment", *words, *settings)
    # Nothing hides anybody in an empty arena.
    assert json.loads(done.stdout)["censored"]


def test_the_world_may_be_ones_own(tmp_path):
    (tmp_path / "room.wkt").write_text("POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0))")
    words = ("--world", tmp_path / "room.wkt", "--runs", 1, "--seconds", 1, "--workers", 0)
    done = study("assignment", *words, "--json")
    summary = json.loads(done.stdout)
    assert all(cell["kept"]["value"] == 1.0 for cell in summary["cells"].values())
    # One run leaves nothing to compare.
    assert summary["comparisons"] == []


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("tracking", "--runs", 0), "`runs` must be positive; got 0"),
        (("tracking", "--set", "pace=3"), "`pace` must be a key of the scenario; got 3"),
        (("tracking", "--set", "arena.rooms=3"), "`--set arena` must be one of side, "),
        (("tracking", "--only", "1v1-uniform"), "`--only` must have the form CELL:RUN"),
        (("tracking", "--only", "9v9-uniform:0"), "`cell` must be one of 1v1-uniform, "),
        (("tracking", "--only", "1v1-uniform:1000"), "`run` must lie between 0 and 999; got 1000"),
        (("tracking", "--workers", -1), "`workers` must be zero or positive; got -1"),
        (("tracking", "--resume", "nowhere"), "`study` must be a folder with a study.json"),
        (("tracking", "--world", "a.wkt", "--set", "arena.gap=1"), "`--set` must not set the aren"),
        (("tracking", "--resume", "a", "--runs", 3), "`--resume` must come without --runs"),
    ],
)
def test_nonsense_is_refused_in_one_line(words, complaint):
    with pytest.raises(InvalidInput) as caught:
        study(*words)
    assert str(caught.value).startswith(complaint)
    assert "\n" not in str(caught.value)


def test_a_folder_with_another_study_is_left_alone(folder):
    before = sorted(folder.iterdir())
    with pytest.raises(InvalidInput, match="`--resume` must hold the study assignment"):
        study("assignment", "--resume", folder)
    with pytest.raises(InvalidInput, match="another seed was chosen"):
        study("tracking", "--runs", 2, "--seconds", 2, "--seed", 1, "--out", folder)
    assert sorted(folder.iterdir()) == before
