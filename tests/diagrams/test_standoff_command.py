"""`sightfield standoff` analyses a loop, follows a start, and says in one line what is wrong."""

import json
import math

import pytest
import typer
from typer.testing import CliRunner

from sightfield.diagrams.commands.standoff import standoff
from sightfield.diagrams.standoff.report import ROWS
from sightfield.systems.numerics.errors import InvalidInput

app = typer.Typer(rich_markup_mode=None)
app.command()(standoff)

ROOT = math.sqrt(1.7598**2 - 4 * 1.062 * 0.337)
NEAR, FAR = (1.7598 - ROOT) / 2.124, (1.7598 + ROOT) / 2.124


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


def test_the_analysis_of_the_thesis_pd_loop(report):
    found = report("--controller", "PD", "--analyse")
    assert found == {
        "controller": "PD",
        "equilibria": [
            {
                "y": pytest.approx(NEAR, abs=1e-9),
                "stable": True,
                "poles": [[pytest.approx(-10 * ROOT / (1 + ROOT), abs=1e-9), 0.0]],
            },
            {
                "y": pytest.approx(FAR, abs=1e-9),
                "stable": True,
                "poles": [[pytest.approx(10 * ROOT / (1 - ROOT), abs=1e-9), 0.0]],
            },
        ],
        "singularities": [pytest.approx(2.7598 / 2.124, abs=1e-9)],
        "region_of_attraction": [None, pytest.approx(2.7598 / 2.124, abs=1e-9)],
    }


def test_pairs_of_poles_come_with_their_imaginary_parts(report):
    found = report("--controller", "PI", "--kp", 1, "--ki", 50, "--analyse")
    (low, high) = found["equilibria"][0]["poles"]
    assert low == [pytest.approx(high[0]), pytest.approx(-high[1])]
    square = high[0] ** 2 + high[1] ** 2
    assert square == pytest.approx(50 * ROOT)


def test_a_start_settles_beside_the_reference(report):
    found = report("--controller", "P", "--start", 0.5)
    assert found.keys() == ROWS.keys()
    assert (found["attracted"], found["outcome"]) == (True, "settled")
    assert found["end"] == pytest.approx(NEAR)
    assert found["bias"] == pytest.approx(NEAR - 0.2)
    assert found["sampled_estimate"] == pytest.approx(0.2, abs=1e-3)


def test_a_start_too_far_away_does_not(report):
    found = report("--controller", "P", "--start", 1.5)
    assert (found["attracted"], found["outcome"], found["end"]) == (False, "diverged", None)


@pytest.mark.parametrize("controller", ["PD", "PI"])
def test_a_run_leaves_numbers_plots_and_a_replay(run, tmp_path, controller):
    shown = run("--controller", controller, "--analyse", "--out", tmp_path / "new")
    files = {file.name: file for file in (tmp_path / "new").iterdir()}
    assert sorted(files) == [
        "bode.png",
        "phase.png",
        "replay.html",
        "responses.png",
        "root_locus.png",
        "run.json",
        "summary.json",
    ]
    assert all(name in shown.stdout.replace("\n", " ") for name in files)
    assert json.loads(files["summary.json"].read_text())["controller"] == controller
    assert json.loads(files["run.json"].read_text()).keys() == ROWS.keys()
    for name, file in files.items():
        if name.endswith(".png"):
            assert file.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_without_an_analysis_only_the_start_is_written(run, tmp_path):
    run("--controller", "P", "--ki", 0, "--out", tmp_path)
    names = sorted(file.name for file in tmp_path.iterdir())
    assert names == ["replay.html", "responses.png", "summary.json"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--kp", -1], "`kp` must be positive; got -1.0"),
        (["--kd", "nan"], "`kd` must be a finite number; got nan"),
        (["--a", 0], "`a` must not be zero; got 0.0"),
        (["--controller", "PDI"], "`controller` must be one of P, PI, PD, PID; got PDI"),
        (["--start", "inf"], "`start` must be a finite number; got inf"),
        (
            ["--start", 1.29934086629],
            "`start` must not lie on the singularity at 1.29934087 m; got 1.29934086629",
        ),
        (
            ["--reference", 0.7, "--analyse"],
            "`reference` must be less than 0.592024, or no distance is in equilibrium "
            "(discriminant (b - 1)^2 - 4 a (c + r) = -0.4587); got 0.7",
        ),
    ],
)
def test_bad_input_is_one_clear_line_and_leaves_nothing(run, tmp_path, arguments, message):
    with pytest.raises(InvalidInput) as caught:
        run(*arguments, "--out", tmp_path / "new")
    assert str(caught.value) == message
    assert not (tmp_path / "new").exists()
