"""`sightfield guarantee` says how long sight can be kept, draws it, and refuses nonsense."""

import json
import math

import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from sightfield.diagrams.commands.guarantee import ROWS, guarantee
from sightfield.systems.numerics.errors import InvalidInput

app = typer.Typer(rich_markup_mode=None)
app.command()(guarantee)

# An L-shaped room.
ROOM = "POLYGON ((0 0, 4 0, 4 4, 2.03 4, 2.03 2.03, 0 2.03, 0 0))"


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
def room(tmp_path):
    path = tmp_path / "room.wkt"
    path.write_text(ROOM)
    return path


@pytest.fixture
def report(run, room):
    """A function that runs the command in the room and returns what it says as JSON."""

    def report(*arguments):
        shown = run("--json", "--world", room, "--grid", 0.2, *arguments).stdout
        return json.loads(shown)

    return report


def test_an_evader_beside_the_corner_gets_away(report):
    # Half a metre from the edge behind which it vanishes, the pursuer two from seeing along it.
    found = report("--pursuer", 0.5, 1.9, "--evader", 2.2, 1.9)
    assert found.keys() == ROWS.keys()
    assert found["in_sight"]
    assert 0.3 < found["guaranteed_time"] < 4.0
    assert found["middle"] == found["guaranteed_time"]
    assert found["lower"] is None
    assert 0.9 < found["kept_for_ever"] < 1.0
    certified = report("--pursuer", 0.5, 1.9, "--evader", 2.2, 1.9, "--bound", "lower")
    assert certified["lower"] <= found["middle"] + found["step"]
    assert certified["kept_for_ever"] < found["kept_for_ever"]
    most = report("--pursuer", 0.5, 1.9, "--evader", 2.2, 1.9, "--bound", "upper")
    assert certified["lower"] < most["upper"]
    assert most["upper"] == most["guaranteed_time"] > found["middle"] - found["step"]
    assert most["kept_for_ever"] > found["kept_for_ever"]


def test_an_evader_far_from_the_corner_is_kept_for_ever(report):
    found = report("--pursuer", 2.5, 1.5, "--evader", 3.5, 0.5)
    assert found["in_sight"]
    assert found["guaranteed_time"] is None
    slower = report("--pursuer", 0.5, 1.9, "--evader", 2.2, 1.9, "--speed-ratio", 0.05)
    assert slower["guaranteed_time"] is None
    assert slower["kept_for_ever"] > found["kept_for_ever"]


def test_who_is_hidden_is_lost_already(report):
    found = report("--pursuer", 0.5, 1.0, "--evader", 2.2, 3.9)
    assert not found["in_sight"]
    assert found["guaranteed_time"] == 0.0


def test_without_places_it_takes_the_best_to_watch_from(report):
    found = report()
    assert found["evader"] is None
    assert found["in_sight"] is None
    assert found["guaranteed_time"] is None
    x, y = found["pursuer"]
    # From where it sees both arms of the room.
    assert x > 2.0 > y - 0.1


def test_the_best_place_is_found_where_nothing_is_kept_for_ever(run, tmp_path):
    # Round a post an evader nearly as fast gets away; the far side sees nearly all of the room.
    path = tmp_path / "post.wkt"
    path.write_text(
        "POLYGON ((0 0, 5 0, 5 4, 0 4, 0 0), (0.8 0.8, 1.4 0.8, 1.4 1.4, 0.8 1.4, 0.8 0.8))"
    )
    settings = "--world", path, "--grid", 0.4, "--bound", "lower", "--speed-ratio", 0.9, "--json"
    found = json.loads(run(*settings).stdout)
    assert found["kept_for_ever"] == 0.0
    x, y = found["pursuer"]
    assert min(x, y) > 1.4


def test_a_scenario_has_its_own_teams(run, tmp_path):
    out = tmp_path / "out"
    shown = run("corner_1v1", "--grid", 0.2, "--out", out).stdout
    assert "guaranteed_time" in shown
    summary = json.loads((out / "summary.json").read_text())
    assert 4.0 < summary["guaranteed_time"] < 8.0
    with Image.open(out / "guarantee.png") as picture:
        assert len(picture.getcolors(maxcolors=10**6) or []) > 50


def test_a_sight_range_hides_what_is_far(report):
    places = "--pursuer", 0.5, 0.5, "--evader", 3.5, 0.5
    assert report(*places)["guaranteed_time"] is None
    short = report(*places, "--sight-range", 2.5)
    assert (short["in_sight"], short["guaranteed_time"], short["sight_range"]) == (False, 0.0, 2.5)


def test_a_game_is_solved_once(report, tmp_path, monkeypatch):
    monkeypatch.setenv("SIGHTFIELD_GAMES", str(tmp_path / "games"))
    first = report("--no-cache")
    assert not first["recalled"]
    assert not (tmp_path / "games").exists()
    assert not report()["recalled"]
    again = report()
    assert again["recalled"]
    for key in first.keys() - {"recalled", "cpu_seconds"}:
        assert again[key] == first[key]


def test_a_saved_game_is_loaded(run, report, room, tmp_path):
    path, place = tmp_path / "game.npz", ("--pursuer", 0.5, 1.9, "--evader", 2.2, 1.9)
    saved = report(*place, "--bound", "lower", "--sight-range", 3.0, "--save", path)
    loaded = json.loads(run("--json", "--world", room, *place, "--load", path).stdout)
    assert loaded["recalled"]
    for key in saved.keys() - {"recalled", "cpu_seconds"}:
        assert loaded[key] == saved[key]
    with pytest.raises(
        InvalidInput, match=r"`speed_ratio` must be that of the table, which is 0\.3"
    ):
        run("--world", room, "--load", path, "--speed-ratio", 0.2)
    other = tmp_path / "other.wkt"
    other.write_text("POLYGON ((0 0, 4 0, 4 4, 0 4, 0 0))")
    with pytest.raises(InvalidInput, match="`load` must be of this world and of robots of this"):
        run("--world", other, "--load", path)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(InvalidInput, match="`file` must be a whole sightfield visibility game"):
        run("--world", room, "--load", path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--speed-ratio", 1.0], r"`speed_ratio` must lie in \(0, 1\)"),
        (["--speed-ratio", -1], "`speed_ratio` must be positive"),
        (["--grid", 0], "`grid` must be positive"),
        (["--grid", math.nan], "`grid` must be a finite number"),
        (
            ["--grid", 1e-4],
            "`grid` must be coarser for so large a world, 0.0[0-9]+ m say; got 0.0001",
        ),
        (["--grid", 1e-308], "`grid` must be coarser for so large a world"),
        (["--grid", 5e-324], "`grid` must be coarser for so large a world"),
        (["--grid", 1e-200, "--bound", "lower"], "`grid` must be coarser for so large a world"),
        (["--grid", 1e-4, "--sight-range", 1e200], "`grid` must be coarser"),
        (["--grid", 0.02, "--memory", 0.01], "so that the table takes at most 0.01 GB"),
        (["--bound", "best"], "`bound` must be one of lower, middle, upper"),
        (["--pursuer", 9, 9], "`pursuer` must be where the robot has room"),
        (["--pursuer", 1, 1, "--evader", 1, 3], "`evader` must be where the robot has room"),
        (["--sight-range", 0], "`sight_range` must be positive"),
        (["--save", "no/such/folder/game.npz"], "`save` must be in a folder that exists"),
        (["--load", "no/such/file.npz"], "`file` must be readable"),
        (["--horizon", 0], "`horizon` must be positive"),
        (["--memory", -2], "`memory` must be positive; got -2"),
        # Nothing is dropped in silence.
        (["--load", "x.npz", "--grid", 0.3], "`grid` must be left out with load; got 0.3"),
        (["--load", "x.npz", "--bound", "middle"], "`bound` must be left out with load"),
        (["--load", "x.npz", "--no-cache"], "`cache` must be left out with load"),
        (["--games", 3], "`games` must come with certify; got 3"),
        (["--set", "pursuers.radius=0.1"], "`set` must be left out with world"),
        (["thesis_3v3"], "`scenario` must be left out with world; got thesis_3v3"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_nonsense_is_refused_in_one_line(run, room, arguments, message):
    with pytest.raises(InvalidInput, match=message) as error:
        run("--world", room, *arguments)
    assert "\n" not in str(error.value)
