"""What commands take, and what the short ones say, draw and leave, is as it was recorded."""

import math

import pytest

from sightfield.diagrams.commands.app import COMMANDS, import_command

ROOM = (
    "POLYGON ((0 0, 6 0, 6 5, 0 5, 0 0), (2 1, 3 1.4, 2.4 2.2, 2 1), (4 3, 5 3, 5 4, 4 3.4, 4 3))"
)
GAME = """\
world: {file: room.wkt}
pursuers: {top_speed: 1.0, positions: [[3.4, 1.1], [0.6, 3.1]], radius: 0.1, assignment: borda_max}
evaders: {top_speed: 0.4, positions: [[1.0, 1.2], [5.1, 2.2]], policies: [adversarial, random_walk]}
seconds: 0.8
"""


def options_of(command):
    """Names, defaults and numbers of values of what a command and those below it take."""
    if hasattr(command, "commands"):
        return {name: options_of(each) for name, each in command.commands.items()}
    return {
        " ".join([*each.opts, *each.secondary_opts]): [
            each.default if not callable(each.default) else "found out",
            each.required,
            each.multiple,
            each.nargs,
        ]
        for each in command.params
    }


@pytest.mark.parametrize("name", COMMANDS)
def test_options_are_as_recorded(name, as_recorded):
    told = options_of(import_command(name))
    as_recorded({key: repr(each) if each is math.inf else each for key, each in told.items()})


@pytest.fixture
def room(tmp_path, monkeypatch):
    (tmp_path / "room.wkt").write_text(ROOM, encoding="utf-8")
    (tmp_path / "game.yaml").write_text(GAME, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    "words",
    [
        "world room.wkt",
        "track game.yaml",
        "track thesis_3v4 --world room.wkt --seconds 0.4 --seed 2 --set pursuers.count=2 --json",
        "guarantee --world room.wkt --grid 0.5 --pursuer 1 3.3 --evader 3.3 2.6 --speed-ratio 0.6",
        "guarantee --world room.wkt --grid 0.5 --bound upper --json",
    ],
)
def test_a_command_is_as_recorded(words, room, as_it_was):
    as_it_was(*words.split(), besides=("scene",))


@pytest.mark.parametrize(
    "words",
    [
        "camera render --shell red:1.3:0.4 --shell green:-0.4:0.9 --pose 0.1 0.2 0.3",
        "camera calibrate --directions 2",
        "station --simulate --seconds 0.6",
    ],
)
def test_a_laboratory_is_as_recorded(words, as_it_was):
    as_it_was(*words.split(), relative=1e-4)
