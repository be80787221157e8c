"""`sightfield guarantee --certify` plays against every evader, and says what broke."""

import json

import numpy as np
import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from sightfield.diagrams.commands.guarantee import guarantee
from sightfield.diagrams.tracking.certified_games import OPPONENTS
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.tracking import certified_pursuit

app = typer.Typer(rich_markup_mode=None)
app.command()(guarantee)

ROOM = "POLYGON ((0 0, 4 0, 4 4, 2.03 4, 2.03 2.03, 0 2.03, 0 0))"


@pytest.fixture
def play(tmp_path):
    """A function that plays in an L-shaped room."""
    room = tmp_path / "room.yaml"
    room.write_text(
        "world: {file: room.wkt}\n"
        "pursuers: {top_speed: 0.3, count: 1, grid: 0.3}\n"
        "evaders: {top_speed: 0.09, count: 1}\n"
        "seconds: 8\n"
    )
    (tmp_path / "room.wkt").write_text(ROOM)

    def play(*arguments):
        words = [str(each) for each in (room, "--certify", *arguments)]
        result = CliRunner().invoke(app, words)
        if isinstance(result.exception, Exception):
            raise result.exception
        return result

    return play


def test_every_evader_is_played_and_the_games_drawn(play, tmp_path):
    out = tmp_path / "out"
    result = play("--games", 2, "--seed", 3, "--json", "--out", out)
    assert result.exit_code == 0
    found = json.loads(result.stdout)
    assert json.loads((out / "summary.json").read_text()) == found
    assert list(found["policies"]) == list(OPPONENTS)
    assert all(each["games"] == each["kept"] == 2 for each in found["policies"].values())
    assert found["broken"] == []
    assert len({game["seed"] for game in found["games"]}) == 2
    assert sum(each["promised"] for each in found["policies"].values()) > 5
    with Image.open(out / "promises.png") as picture:
        assert len(picture.getcolors(maxcolors=10**6) or []) > 20


def test_a_broken_promise_names_its_game(play, monkeypatch):
    # Pursuers that stand and promise for ever.
    def boast(self, i, pursuers, evaders, evader, commitments):
        found = np.zeros(certified_pursuit.COMMITMENT)
        found[:2], found[certified_pursuit.LEFT] = pursuers[i], 1.0
        found[certified_pursuit.FROM_X :] = pursuers[i]
        found[certified_pursuit.EVADER], found[certified_pursuit.PROMISE] = evader, np.inf
        return found

    monkeypatch.setattr(certified_pursuit.CertifiedPursuit, "_commit", boast)
    result = play("--games", 3, "--grid", 0.4, "--set", "seconds=30")
    assert result.exit_code == 1
    assert "broken: game" in result.stderr
    assert " against " in result.stderr
    assert "(seed" in result.stderr


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--games", 0], "`games` must be positive"),
        (["--seed", -1], "`seed` must be zero or positive"),
        (["--set", "seconds=0"], "`seconds` must be positive"),
        (["--grid", 0], "`grid` must be positive"),
        (["--speed-ratio", 1.0], "must be below pursuers.top_speed"),
        (["--pursuer", 1, 1], "`pursuer` must be left out with certify"),
        (["--load", "x.npz"], "`load` must be left out with certify"),
        (["--bound", "upper"], "`bound` must be left out with certify; got upper"),
        (["--no-cache"], "`cache` must be left out with certify"),
        (
            ["--set", "evaders.radius=0.1", "--set", "bodies_block_sight=true"],
            "`bodies_block_sight` must be false",
        ),
    ],
)
def test_nonsense_is_refused_in_one_line(play, arguments, message):
    with pytest.raises(InvalidInput, match=message) as error:
        play(*arguments)
    assert "\n" not in str(error.value)
