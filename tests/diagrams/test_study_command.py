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


FOLDER = ("--runs", 3, "--opponent-runs", "best_response=2", "--seconds", 1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A finished study: two runs against the one opponent, three against the other."""
    out = tmp_path_factory.mktemp("study") / "out"
    done = study("tracking", *FOLDER, "--workers", 0, "--out", out)
    assert done.exit_code == 0
    for opponent in ("adversarial", "best_response"):
        assert f"t1: uniform risk vector, against {opponent}: mean up to" in done.stdout
    assert "Strongest opponent, of 48 pairs of teams and pursuers: " in done.stdout
    return out


def test_a_study_leaves_its_folder_complete(folder):
    names = {"study.json", "table.parquet", "summary.json", "tables.md"}
    pictures = {"means.png", "matrix.png", "curves.png"}
    assert {file.name for file in folder.glob("[!.]*")} == names | pictures


def test_the_summary_tells_what_the_table_holds(folder):
    summary = json.loads((folder / "summary.json").read_text())
    table = pq.read_table(folder / "table.parquet").to_pylist()
    assert len(summary["cells"]) == 96
    assert summary["runs"] == {"adversarial": 3, "best_response": 2}
    for name, cell in summary["cells"].items():
        times = [row["time"] for row in table if row["cell"] == name]
        assert name.endswith(f"-{cell['opponent']}")
        assert len(times) == summary["runs"][cell["opponent"]]
        assert cell["mean"]["value"] == pytest.approx(np.mean(times))
        assert cell["mean"]["low"] <= cell["mean"]["value"] <= cell["mean"]["high"] <= 1.0
        assert f"{cell['pursuers']}v{cell['evaders']}" == name[:3]
        kept = [row["censored"] for row in table if row["cell"] == name]
        assert cell["kept"]["value"] == np.mean(kept)
    # t1, t2 and t3 of each of 16 teams, two by two, against each opponent.
    assert len(summary["comparisons"]) == 96
    for size, rows in summary["matrix"].items():
        for vector, row in rows.items():
            for opponent, mean in row.items():
                cell = summary["cells"][f"{size}-{vector}-{opponent}"]
                assert mean["mean"] == cell["mean"]["value"]
            means = [each["mean"] for each in row.values()]
            decided = means.count(min(means)) == 1
            assert summary["worst"][size][vector] in (row if decided else ("undecided",))
    assert len(summary["matrix"]) == 16
    assert all(each["holm_p"] >= each["p_value"] for each in summary["comparisons"])


def test_resuming_a_finished_study_says_the_same_again(folder):
    before = (folder / "summary.json").read_bytes()
    done = study("tracking", "--resume", folder, "--json")
    assert json.loads(done.stdout) == json.loads(before)
    assert (folder / "summary.json").read_bytes() == before


def test_any_run_can_be_replayed_alone(folder, tmp_path):
    only = ("--only", "2v2-majority-best_response:1")
    done = study("tracking", "--resume", folder, *only, "--out", tmp_path / "run", "--json")
    summary = json.loads(done.stdout)
    rows = pq.read_table(folder / "table.parquet").to_pylist()
    (row,) = [row for row in rows if (row["cell"], row["run"]) == (only[1][:-2], 1)]
    assert summary["tracking_time"] == row["time"]
    assert summary["seed"] == row["seed"]
    ended = "the horizon" if summary["censored"] else "the loss of evader"
    assert f"run 1: {row['time']:.6f} s, to {ended}" in done.stdout + done.stderr
    left = {file.name for file in (tmp_path / "run").glob("[!.]*")}
    assert {"replay.html", "log.npz", "scenario.yaml"} <= left


def test_settings_reach_games_and_arenas():
    words = ("--only", "3v2-borda_min-random_walk:0", "--seconds", 1, "--json")
    settings = ("--opponent", "random_walk", "--set", "arena.obstacles=0")
    done = study("assignment", *words, *settings)
    # Nothing hides anybody in an empty arena.
    assert json.loads(done.stdout)["censored"]
    assert "run 0: 1.000000 s, to the horizon" in done.stderr


def test_every_pursuers_meet_every_evaders_in_the_study_of_policies(tmp_path):
    words = ("--runs", 2, "--size", "1v1", "--size", "1v2", "--seconds", 0.5, "--workers", 0)
    opponents = ("--opponent", "best_response", "--opponent", "random_walk")
    coarse = ("--starts", 2, "--set", "pursuers.grid=0.3")
    done = study("policies", *words, *opponents, *coarse, "--out", tmp_path / "out")
    assert "1v2: mean [s], 95% interval, * the worst" in done.stdout
    # So soon nobody is lost, and none of six pursuers and two pairs of teams has a worst.
    assert "of 12 pairs of teams and pursuers: undecided 12." in done.stdout
    assert ") *" not in done.stdout
    left = {file.name for file in (tmp_path / "out").glob("[!.]*")}
    names = {"study.json", "table.parquet", "summary.json", "tables.md"}
    assert left == names | {"matrix.png", "curves.png"}
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert list(summary["matrix"]) == ["1v1", "1v2"]
    for rows in summary["matrix"].values():
        assert list(rows)[:2] + list(rows)[-1:] == ["thesis", "table_held", "guarantee"]
        assert len(rows) == 6
        assert all(list(row) == ["best_response", "random_walk"] for row in rows.values())
    # Five pursuers less the thesis's, for two pairs of teams and two opponents.
    assert len(summary["comparisons"]) == 20
    assert all("-thesis-" in each["second"] for each in summary["comparisons"])


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
        (("tracking", "--only", "9v9-uniform:0"), "`cell` must be one of 1v1-uniform-adv"),
        (
            ("tracking", "--only", "1v1-uniform-adversarial:1000"),
            "`run` must lie between 0 and 999; got 1000",
        ),
        (
            ("tracking", "--only", "1v1-uniform-best_response:100"),
            "`run` must lie between 0 and 99; got 100",
        ),
        (("tracking", "--opponent", "nobody"), "`opponent` must be one of adversarial, best_resp"),
        (("policies", "--opponent", "you"), "`opponent` must be one of adversarial, best_respons"),
        (("tracking", "--opponent-runs", "best_response"), "`opponent-runs` must have the form b"),
        (("tracking", "--opponent-runs", "nobody=3"), "`opponent-runs` must be one of adversari"),
        (("policies", "--size", "3"), "`size` must have the form 3v4, pursuers first; got 3"),
        (
            ("tracking", "--set", "evaders.policies=[random_walk]"),
            "`--set` must leave to the study what it varies: evaders.policies; got",
        ),
        (("tracking", "--workers", -1), "`workers` must be zero or positive; got -1"),
        (("tracking", "--resume", "nowhere"), "`study` must be a folder with a study.json"),
        (("tracking", "--world", "a.wkt", "--set", "arena.gap=1"), "`--set` must not set the aren"),
        (("tracking", "--resume", "a", "--runs", 3), "`--resume` must come without options"),
        (("policies", "--resume", "a", "--size", "1v1"), "`--resume` must come without options"),
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
        study("tracking", *FOLDER, "--seed", 1, "--out", folder)
    assert sorted(folder.iterdir()) == before
