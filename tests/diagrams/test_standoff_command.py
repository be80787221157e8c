"""`sightfield standoff` analyses a loop, follows a start, and says in one line what is wrong."""

import json
import math

import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.standoff import standoff as app
from sightfield.diagrams.standoff.report import ROWS
from sightfield.systems.numerics.errors import InvalidInput

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
    return lambda *arguments: json.loads(run(*arguments, "--json").stdout)


def test_the_analysis_of_the_thesis_pd_loop(report):
    found = report("--controller", "PD", "--analyse")
    assert found == report("analyse", "--controller", "PD")
    assert found["equilibria"] == [
        {
            "y": pytest.approx(NEAR, abs=1e-9),
            "stable": True,
            "stable_in_equation": True,
            "poles": [[pytest.approx(-10 * ROOT / (1 + ROOT), abs=1e-9), 0.0]],
        },
        {
            "y": pytest.approx(FAR, abs=1e-9),
            # No real loop stays there, whatever the equation says.
            "stable": False,
            "stable_in_equation": True,
            "poles": [[pytest.approx(10 * ROOT / (1 - ROOT), abs=1e-9), 0.0]],
        },
    ]
    assert found["singularities"] == [pytest.approx(2.7598 / 2.124, abs=1e-9)]
    assert found["region_of_attraction"] == [None, pytest.approx(2.7598 / 2.124, abs=1e-9)]
    assert found["bias"] == pytest.approx(NEAR - 0.2)
    assert found["delay_margin"] == 0
    sampled = found["sampled"]
    assert sampled["stable"] is True
    assert sampled["peak_sensitivity"] > 1
    assert sampled["region_of_attraction"][0] < -1


def test_what_does_not_hold_with_this_clock_is_not_said_to(report):
    found = report("analyse", "--controller", "P", "--period", 0.2)
    assert found["equilibria"][0]["stable"] is True
    assert found["sampled"]["stable"] is False
    assert found["sampled"]["poles"] == [[pytest.approx(1 - 2 * ROOT), 0.0]]
    assert found["sampled"]["gain_margin"] is found["sampled"]["region_of_attraction"] is None


@pytest.mark.parametrize("controller", ["P", "PI", "PD", "PID"])
def test_a_straight_error_is_the_natural_baseline(report, run, tmp_path, controller):
    found = report("analyse", "--a", 0, "--controller", controller)
    (rest,) = found["equilibria"]
    assert rest["y"] == pytest.approx((0.137 + 0.2) / 1.7598)
    assert found["region_of_attraction"] == [None, None]
    assert found["sampled"]["region_of_attraction"] == [None, None]
    assert report("--a", 0, "--controller", controller)["end"] == pytest.approx(rest["y"])
    if controller == "PI":
        run("--a", 0, "--controller", controller, "--analyse", "--out", tmp_path)
        assert (tmp_path / "phase.png").exists()


def test_gains_by_design_have_the_margins_that_the_analysis_finds(report):
    clock = ("--controller", "PI", "--delay", 0.06, "--period", 0.03)
    found = report("design", *clock, "--phase-margin", 50)
    assert found["phase_margin"] >= math.radians(50)
    again = report("analyse", *clock, "--kp", found["kp"], "--ki", found["ki"])["sampled"]
    for name in ("gain_margin", "phase_margin", "delay_margin", "peak_sensitivity"):
        assert again[name] == pytest.approx(found[name], rel=1e-6)


def test_a_simulation_has_what_a_robot_adds(report, run, tmp_path):
    options = ("simulate", "--controller", "P", "--no-feed-forward", "--evader-sway", 0)
    found = report(*options, "--limit", 0.3, "--start", 0.8, "--delay", 0.04)
    assert found["largest_distance"] == pytest.approx(0.8, abs=0.01)
    assert 0.2 < found["limited_share"] < 0.8
    # Without feed-forward P needs a miss of the estimate of v / K_P, here 15 mm.
    assert found["rms_miss"] == pytest.approx(0.015 / ROOT, rel=0.05)
    noisy = report(*options, "--noise", 0.01, "--seed", 3)
    assert noisy == report(*options, "--noise", 0.01, "--seed", 3)
    assert noisy["rms_miss"] != report(*options, "--noise", 0.01, "--seed", 4)["rms_miss"]
    run(*options, "--seconds", 2, "--out", tmp_path)
    names = sorted(file.name for file in tmp_path.glob("[!.]*"))
    assert names == ["replay.html", "run.csv", "run.png", "summary.json"]
    assert len((tmp_path / "run.csv").read_text().splitlines()) == 402


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
    files = {file.name: file for file in (tmp_path / "new").glob("[!.]*")}
    assert sorted(files) == [
        "bode.png",
        "nyquist.png",
        "phase.png",
        "replay.html",
        "responses.png",
        "root_locus.png",
        "run.json",
        *(["sampled_region.png"] if controller == "PI" else []),
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
    names = sorted(file.name for file in tmp_path.glob("[!.]*"))
    assert names == ["replay.html", "responses.png", "summary.json"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--kp", -1], "`kp` must be positive; got -1.0"),
        (["--kd", "nan"], "`kd` must be a finite number; got nan"),
        (
            ["--a", 0, "--b", 1.5],
            "`b` must be less than 1 for a = 0, or the estimate does not grow with the distance; "
            "got 1.5",
        ),
        (["--period", 0], "`period` must be positive; got 0.0"),
        (["--period", 1e-9], "`period` must be at least 2.5e-05 s; got 1e-09"),
        (["--period", 1e9], "`period` must be at most the duration, 10 s; got 1000000000.0"),
        (["--delay", -1], "`delay` must be zero or positive; got -1.0"),
        (["analyse", "--delay", 9], "`delay` must be at most 500 samples of 0.005 s; got 9.0"),
        (["--limit", 0], "`limit` must be positive; got 0.0"),
        (
            ["simulate", "--seconds", 1e9],
            "`seconds` must be at most 400000 samples, 2000 s; got 1000000000.0",
        ),
        *(
            (
                ["analyse", f"--{name}", size],
                f"`{name.replace('-', '_')}` must be of a size from 1e-18 to 1e+18; got {size}",
            )
            for name in ("kp", "ki", "kd", "a", "b", "c", "reference", "period", "filter-time")
            for size in (1e300, 1e-300)
        ),
        (
            ["analyse", "--kp", 1e-12],
            "`ki` must lie between 1.29e-38 and 5.63e-13 for these kp and kd; got 5.0",
        ),
        (
            ["analyse", "--controller", "PI", "--kp", 1e9],
            "`ki` must lie between 1.29e+04 and 1.29e+30 for these kp and kd; got 5.0",
        ),
        (["simulate", "--seed", 10**20], f"`seed` must be less than 2^32; got {10**20}"),
        (
            ["design", "--damping", 1e300],
            "`damping` must be of a size from 1e-18 to 1e+18; got 1e+300",
        ),
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


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--phase-margin", 120), "and 1.571 rad (90 degrees); got 2.094 rad (120 degrees)"),
        (
            ("--phase-margin", 89, "--gain-margin", 50),
            "got phase margin 1.553 rad (89 degrees)",
        ),
    ],
)
def test_a_refused_margin_is_told_in_degrees_as_it_was_given(options, says, sightfield_here):
    done = sightfield_here("standoff", "design", *options)
    assert done.returncode == 2
    assert says in done.stderr


@pytest.mark.parametrize("gain", [100, 1000])
def test_a_loop_that_has_not_settled_has_no_settling_time(report, gain):
    """So large a gain makes the closed form slow, and the sampled loop unstable."""
    found = report("--controller", "PD", "--kd", gain)
    assert found["outcome"] == "moving"
    assert found["settling_time"] is None
    assert found["sampled_end"] is None
    assert 0.0 < found["sampled_lost"] < 1.0
    steady = report("--controller", "PD")
    assert steady["sampled_lost"] is None
    assert steady["settling_time"] > 0.0
