"""`sightfield corner` says who wins, draws it, and says in one line what is wrong."""

import json

import pytest
import typer
from typer.testing import CliRunner

from sightfield.diagrams.commands.corner import ROWS, corner
from sightfield.systems.numerics.errors import InvalidInput

app = typer.Typer(rich_markup_mode=None)
app.command()(corner)


@pytest.fixture
def run():
    """A function that runs the command; errors come through as exceptions."""

    def invoke(*arguments):
        result = CliRunner().invoke(app, [str(each) for each in arguments])
        if isinstance(result.exception, Exception):
            raise result.exception
        return result

    return invoke


@pytest.fixture
def report(run):
    """A function that runs the command and returns what it says as JSON."""
    return lambda *arguments: json.loads(run("--json", *arguments).stdout)


def test_the_evader_that_is_nearer_wins(report):
    # D_p = 1.5 m, D_e = 0.6 m, half the speed; w = (0.3, -0.15) m, |p x e| = 0.3 m^2.
    found = report("--pursuer", 1, -1.5, "--evader", -0.2, 0.6, "--speed", 2)
    assert found.keys() == ROWS.keys()
    assert (found["region"], found["winner"]) == ("1", "evader")
    assert found["star_distance"] == pytest.approx(1.5)
    assert found["edge_distance"] == pytest.approx(0.6)
    assert found["margin"] == pytest.approx(-0.15)
    assert found["escape_time"] == pytest.approx(0.3 / (2 * 0.1125**0.5))
    assert found["direction"] == pytest.approx([0.2**0.5, 0.8**0.5])


def test_a_slower_evader_is_kept_in_sight(report):
    found = report("--ratio", 0.3, "--pursuer", 1, -1.5, "--evader", -0.2, 0.6)
    assert (found["region"], found["winner"], found["escape_time"]) == ("3", "pursuer", None)


def test_who_is_hidden_has_won(report):
    found = report("--pursuer", 1, -1.5, "--evader", -1, 0.6)
    assert (found["region"], found["winner"], found["escape_time"]) == ("hidden", "evader", 0)


def test_a_pursuer_beyond_the_other_edge_meets_the_mirror_image(report):
    found = report("--pursuer", -1.5, 1, "--evader", 0.6, -0.2)
    assert found["winner"] == "evader"
    assert found["direction"] == pytest.approx([0.8**0.5, 0.2**0.5])


def test_a_folder_gets_the_picture_and_the_summary(run, report, tmp_path):
    result = run("--field", "table", "--out", tmp_path / "new" / "corner")
    folder = tmp_path / "new" / "corner"
    assert {file.name for file in folder.glob("[!.]*")} == {"corner.png", "summary.json"}
    assert json.loads((folder / "summary.json").read_text()) == report("--field", "table")
    assert "evader" in result.stdout


def test_as_far_as_is_allowed_the_evader_wins_by_less_than_a_metre(report):
    # The pursuer is 1 m short of the star region, the evader 0.9 m less a little short of edge A.
    for short, winner in ((0.89, "evader"), (0.91, "pursuer")):
        found = report("--ratio", 0.9, "--pursuer", 1e6, -1, "--evader", -0.2, short)
        assert found["winner"] == winner


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--alpha", 4), "`alpha` must lie between 0 and pi"),
        (("--ratio", 1.5), "`ratio` must lie strictly between 0 and 1; got 1.5"),
        (("--speed", 0), "`speed` must be positive; got 0"),
        (("--field", "best"), "`field` must be one of table, margin, table_up; got best"),
        (("--evader", -1, -1), "`evader` must not be inside the obstacle"),
        (("--pursuer", -1, -1), "`pursuer` must not be inside the obstacle"),
        # A metre from the star region is less than its rim there.
        (
            ("--pursuer", 1e9, -1),
            "`pursuer` must be within 1e\\+06 m of the corner; got 1000000000",
        ),
        (("--evader", -1, 1e300), "`evader` must be within 1e\\+06 m of the corner; got 1e\\+300"),
    ],
)
def test_bad_input_is_named(run, tmp_path, arguments, message):
    with pytest.raises(InvalidInput, match=message):
        run(*arguments, "--out", tmp_path / "never")
    assert not (tmp_path / "never").exists()
