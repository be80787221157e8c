"""`sightfield plan` compares planners, and says in one line what is wrong.

The bar that is shown while a value function is solved.
"""

import io
import itertools
import json
import subprocess
import sys
from pathlib import Path

import pytest
from rich.console import Console
from typer.testing import CliRunner

from sightfield.diagrams.commands.app import make_app
from sightfield.diagrams.commands.plan import _grid_step, solving_shown
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.value_function.grid import THESIS_STEP

# Stands for a world with walls far off, for what is said of walls alone.
ROOM = ("--world", "room.wkt")


@pytest.fixture
def run():
    """A function that runs `sightfield plan`; errors come through as exceptions."""

    def invoke(*arguments):
        result = CliRunner().invoke(make_app(), ["plan", *map(str, arguments)])
        if isinstance(result.exception, Exception):
            raise result.exception
        return result

    return invoke


@pytest.mark.parametrize(
    ("options", "time"),
    [
        (("--goal-tolerance", 0, 0, 0, "inf"), 4.46243),
        (("--goal-tolerance", 0, 0, 0, 0.251), 5.100),
        ((), 4.3476),
        (("--point",), 5.9914),
    ],
    ids=["beta free", "beta within a cell", "box of a cell", "point"],
)
def test_the_thesis_case_in_json(run, options, time):
    case = ("--start", 1, 1, 0, 0, "--goal", 4, 4, 0, 0, "--method", "casadi", "--json")
    said = json.loads(run(*case, *options).stdout)
    assert said["start"] == [1, 1, 0, 0]
    assert said["goal"] == [4, 4, 0, 0]
    assert said["methods"]["casadi"]["time"] == pytest.approx(time, abs=1e-3)
    assert said["methods"]["casadi"]["time"] >= said["lower_bound"] - 1e-6


def test_the_table_names_the_goal_and_every_method(run):
    text = run("--goal-tolerance", 0, 0, 0, 0.251).stdout
    assert "5.09948" in text
    assert "time [s]" in text
    assert "casadi: optimal" in text
    assert "primitive: found" in text
    assert "Contradiction" not in text


def test_a_folder_gets_numbers_paths_and_pictures(run, tmp_path):
    run("--method", "casadi", "--out", tmp_path / "plans")
    names = {path.name for path in (tmp_path / "plans").glob("[!.]*")}
    assert {"verdict.json", "paths.npz", "paths.png", "states.png", "replay.html"} <= names
    # Nothing was asked for that has a value function to draw.
    assert "value.png" not in names


@pytest.mark.filterwarnings("error")
def test_without_a_path_there_is_nothing_over_time(run, tmp_path):
    case = ("--method", "primitive", "--jackknife", 0.1, "--out", tmp_path)
    done = run(*case)
    assert "unreachable" in done.stdout
    assert done.exit_code == 1
    assert done.stderr.startswith("no plan: primitive: unreachable")
    assert done.stderr.count("\n") == 1
    assert (tmp_path / "paths.png").stat().st_size > 5000
    assert not (tmp_path / "states.png").exists()


def test_options_before_sweep_are_refused(run):
    with pytest.raises(InvalidInput, match="`plan sweep` must stand without --point before it"):
        run("--point", "sweep", "--count", 2)


def test_the_sweep_leaves_its_figure(run, tmp_path):
    run("sweep", "--method", "primitive", "--count", 3, "--out", tmp_path)
    said = json.loads((tmp_path / "sweep.json").read_text(encoding="utf-8"))
    assert said["ratios"] == [0.5, 1.75, 3.0]
    assert len(said["methods"]["primitive"]) == 3
    assert (tmp_path / "sweep.png").stat().st_size > 5000


def test_the_world_is_kept_clear_of(run, tmp_path):
    file = tmp_path / "room.wkt"
    file.write_text("POLYGON ((-2 -2, 9 -2, 9 9, -2 9, -2 -2))", encoding="utf-8")
    case = ("--world", file, "--method", "casadi", "--json")
    said = json.loads(run(*case).stdout)["methods"]["casadi"]
    assert (said["status"], said["converged"]) == ("locally optimal", True)
    with pytest.raises(InvalidInput, match="`start` must keep the vehicle clear of walls"):
        run(*case, "--start", -2, 1, 0, 0)


@pytest.mark.parametrize(
    ("name", "text"),
    [("room.wkt", "POLYGON ((0 0, 1"), ("room.geojson", '{"type": 1}'), ("room.txt", "room")],
)
def test_a_file_that_is_no_world_is_refused(run, tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput, match=r"`world file` must .*room"):
        run("--world", tmp_path / name)


def test_a_wide_cart_keeps_its_width(run, tmp_path):
    file = tmp_path / "lane.wkt"
    file.write_text("POLYGON ((-3 -0.5, 9 -0.5, 9 0.5, -3 0.5, -3 -0.5))", encoding="utf-8")
    case = ("--world", file, "--method", "casadi", "--start", 0, 0, 0, 0, "--goal", 5, 0, 0, 0)
    said = json.loads(run(*case, "--width", 0.9, "--json").stdout)["methods"]["casadi"]
    assert said["time"] == pytest.approx(4.8, abs=1e-3)
    with pytest.raises(InvalidInput, match="`start` must keep the vehicle clear of walls"):
        run(*case, "--width", 1.1)


def test_discs_are_what_the_cart_covers(run, tmp_path):
    file = tmp_path / "lane.wkt"
    file.write_text("POLYGON ((-3 -0.5, 9 -0.5, 9 0.5, -3 0.5, -3 -0.5))", encoding="utf-8")
    case = ("--world", file, "--method", "casadi", "--start", 0, 0, 0, 0, "--goal", 5, 0, 0, 0)
    discs = "tractor 0.1 0.45, trailer 0 0.3"
    said = json.loads(run(*case, "--discs", discs, "--json").stdout)["methods"]["casadi"]
    assert said["time"] == pytest.approx(4.8, abs=1e-3)
    with pytest.raises(InvalidInput, match="`start` must keep the vehicle clear of walls"):
        run(*case, "--discs", "tractor 0.1 0.3, trailer 0 0.55")
    # In front of the tractor it reaches beyond the end of the lane.
    with pytest.raises(InvalidInput, match="`goal` must keep the vehicle clear of walls"):
        run(*case, "--discs", "tractor 3.8 0.4")


def test_neither_end_may_be_in_an_obstacle(run, tmp_path):
    file = tmp_path / "room.wkt"
    room = "(-2 -2, 9 -2, 9 9, -2 9, -2 -2)"
    file.write_text(f"POLYGON ({room}, (2 2, 3 2, 3 3, 2 3, 2 2))", encoding="utf-8")
    for end, method in itertools.product(("start", "goal"), ("all", "primitive")):
        with pytest.raises(InvalidInput, match=f"`{end}` must keep the vehicle clear of walls"):
            run("--world", file, "--method", method, f"--{end}", 2.5, 2.5, 0, 0)


def test_a_goal_that_the_grid_cannot_resolve_is_said_to_be_wider(run):
    done = run("--point", "--method", "value-function", "--grid", 0.5)
    text = " ".join(done.stdout.split())
    assert "tolerance below one cell of the grid" in text
    assert "arrived in a wider box" in text
    # Which is not the goal asked for.
    assert done.exit_code == 1


def test_a_start_too_far_for_any_grid_leaves_the_others_to_answer(run):
    case = ("--start", -1000, 0, 0, 0, "--goal-tolerance", 0, 0, 0, "inf", "--json")
    asked = (*case, "--method", "value-function", "--memory", 0.5)
    said = json.loads(run(*asked).stdout)["methods"]
    assert said["value-function"]["time"] is None
    assert "its grid would have" in said["value-function"]["status"]
    assert "GB are needed and 0.5 GB allowed" in said["value-function"]["status"]


def test_one_planner_that_arrives_is_enough(run):
    # The closed forms are of a cart whose radius is its length; a table is of any.
    cart = ("--length", 0.6, "--goal-tolerance", 0, 0, 0, "inf", "--json")
    alone = run(*cart, "--method", "extremal")
    assert alone.exit_code == 1
    assert json.loads(alone.stdout)["best_time"] is None
    assert "not applicable" in alone.stderr
    assert run(*cart, "--method", "casadi").exit_code == 0


def test_the_defaults_are_the_case_of_figure_3_9(run):
    said = json.loads(run("--method", "primitive", "--json").stdout)
    assert (said["start"], said["goal"]) == ([1, 1, 0, 0], [4, 4, 0, 0])
    assert said["goal_tolerance"] == [0.2, 0.2, 0.251, 0.251]
    assert said["goal_tolerance_along"] == ["goal's heading", "across it", "theta", "beta"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--start", "nan", 0, 0, 0), "`start` must be a finite number"),
        (("--length", 0), "`length` must be positive"),
        (("--start", 1e300, 0, 0, 0), "`start` must be within 1e+07 turning radii of the origin"),
        (("--start", 2e4, 0, 0, 0), "`start` must be within 10000 turning radii of the goal"),
        (("--goal", 0, -1e300, 0, 0), "`goal` must be within 1e+07 turning radii"),
        (("--start", 0, 0, 1e300, 0), "`start` must have angles of at most 1e+06 rad"),
        (("--length", 1e-9), "`length` must be 0.001 to 1000 turning radii"),
        (("--length", 1e8), "`length` must be 0.001 to 1000 turning radii"),
        (("--speed", 1e-300), "`length` must be 0.001 to 1000 turning radii"),
        (("--turn-rate", 1e8), "`length` must be 0.001 to 1000 turning radii"),
        (("--speed", 1e9, "--turn-rate", 1e-300), "must be a turning radius"),
        (("--hitch-offset", 1e8), "`hitch_offset` must be at most 100 lengths"),
        (("--width", 1), "`--width` must come with --world"),
        (("--discs", "tractor 0 1"), "`--discs` must come with --world"),
        ((*ROOM, "--width", 0), "`width` must be positive"),
        ((*ROOM, "--width", 1e-9), "`width` must be at least a fiftieth"),
        (
            (*ROOM, "--discs", "tractor 0"),
            "`discs` must be discs such as tractor 0.5 0.4, trailer 0 0.4",
        ),
        ((*ROOM, "--discs", "plough 0 1"), "trailer 0 0.4; got plough 0 1"),
        ((*ROOM, "--discs", "tractor 0 1,"), "trailer 0 0.4; got nothing"),
        ((*ROOM, "--discs", "tractor nan 1"), "`discs` must be a finite number"),
        ((*ROOM, "--discs", "trailer 0 -1"), "`discs` must be positive"),
        ((*ROOM, "--discs", "trailer 0 1e9"), "`discs` must be within 100 m of their axles"),
        (
            (*ROOM, "--discs", "trailer 0 1," * 64 + "trailer 0 1"),
            "`discs` must be at most 64; got 65",
        ),
        ((*ROOM, "--discs", "trailer 0 1", "--width", 1), "`width` must stand without discs"),
        (("--memory", -2), "`memory` must be positive; got -2"),
        (("--memory", "nan"), "`memory` must be a finite number"),
        (("--turn-rate", -1), "`turn_rate` must be positive"),
        (("--goal-tolerance", 0, 0, -1, 0), "`tolerance` must be zero or positive"),
        (("--method", "magic"), "`method` must be one of"),
        (("--point", "--goal-tolerance", 0, 0, 0, 0), "`--point` must stand without"),
        (("--world", "nowhere.wkt"), "nowhere.wkt"),
        (("--goal", 0, "inf", 0, 0), "`goal` must be a finite number"),
        (("--goal-tolerance", 0, "nan", 0, 0), "`tolerance` must be zero or positive"),
        (("--speed", "nan"), "`speed` must be a finite number"),
        (("--hitch-offset", "inf"), "`hitch_offset` must be a finite number"),
        (("--jackknife", 0), "`jackknife` must lie in (0, pi]"),
        (("--start", 1, 1, 0, 2, "--jackknife", 1), "`start` must have |beta| within jackknife"),
        (("--goal", 1, 1, 0, -2, "--jackknife", 1), "`goal` must have |beta| within jackknife"),
        (("--grid", "coarse"), "`--grid` must be thesis, fine or a number"),
        (("--grid", "-1"), "`grid` must be positive"),
        (("--grid", 5, "--method", "casadi"), "`grid` must have a step of at most 1"),
        (("sweep", "--count", 1), "`count` must be at least 2"),
        (("sweep", "--grid", "nan"), "`grid` must be a finite number"),
        (("sweep", "--goal-tolerance", 0, 0, 0, -1), "`tolerance` must be zero or positive"),
    ],
)
def test_bad_input_is_one_clear_line(run, tmp_path, monkeypatch, options, words):
    monkeypatch.chdir(tmp_path)
    Path("room.wkt").write_text("POLYGON ((-9 -9, 9 -9, 9 9, -9 9, -9 -9))", encoding="utf-8")
    with pytest.raises(InvalidInput) as error:
        run(*options)
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def sightfield(*arguments):
    """Run the command as a process of its own, without a terminal."""
    words = [Path(sys.executable).with_name("sightfield"), *map(str, arguments)]
    return subprocess.run(
        words, capture_output=True, text=True, stdin=subprocess.DEVNULL, check=False
    )


@pytest.mark.parametrize("command", [("plan", "--length", 0), ("plan", "sweep", "--grid", 0)])
def test_bad_input_leaves_one_line_and_nothing_else(sightfield_here, command, tmp_path):
    done = sightfield_here(*command, "--json", "--out", tmp_path / "out")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: ")
    assert done.stderr.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_json_is_all_that_is_written():
    box = ("--goal-tolerance", 0.5, 0.5, 0.7, 0.7)
    done = sightfield("plan", "--method", "value-function", "--grid", 0.5, *box, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert "value-function" in json.loads(done.stdout)["methods"]


def console(*, terminal: bool) -> Console:
    """One that keeps what it writes."""
    return Console(file=io.StringIO(), force_terminal=terminal, width=100, color_system=None)


def written(screen: Console) -> str:
    file = screen.file
    assert isinstance(file, io.StringIO)
    return file.getvalue()


def test_a_terminal_sees_passes_and_changes():
    screen = console(terminal=True)
    with solving_shown(True, screen) as report:
        assert report is not None
        report(1, 1e12)
        report(7, 0.25)
    assert "pass 7" in written(screen)
    assert "change 0.2 s" in written(screen)


def test_where_nothing_is_solved_there_is_no_bar():
    screen = console(terminal=True)
    with solving_shown(True, screen) as report:
        assert report is not None
    assert "Value function" not in written(screen)


@pytest.mark.parametrize(("wanted", "terminal"), [(False, True), (True, False)])
def test_unwanted_or_unwatched_nothing_is_written(wanted, terminal):
    screen = console(terminal=terminal)
    with solving_shown(wanted, screen) as report:
        assert report is None
    assert written(screen) == ""


def test_the_fine_grid_has_half_the_step_of_the_thesis():
    assert _grid_step("fine") == _grid_step("thesis") / 2 == THESIS_STEP / 2
    assert _grid_step("0.07") == 0.07
