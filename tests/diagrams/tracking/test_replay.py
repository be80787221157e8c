"""A replay is one whole file, or none."""

import re

import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.visuals.replay import write_replay
from sightfield.systems.numerics.errors import InvalidInput


@pytest.fixture
def recorded(meshcat, make_game):
    game = make_game(meshcat, recording=True)
    Simulator(game.diagram).AdvanceTo(0.2)
    return game


def test_it_is_one_file_that_others_may_read(recorded, tmp_path):
    path = write_replay(recorded.scene, tmp_path / "replay.html")
    assert list(tmp_path.iterdir()) == [path]
    assert path.stat().st_mode & 0o777 == 0o644


def test_it_names_no_other_file_or_place(recorded, tmp_path):
    page = write_replay(recorded.scene, tmp_path / "replay.html").read_text(encoding="utf-8")
    assert re.findall(r"<(?:script|link|img|iframe)[^>]*\b(?:src|href)=", page) == []
    assert 'fetch("data:application/octet' not in page
    assert page.count('obey("') > 100


def test_it_has_the_title_that_it_was_given(recorded, tmp_path):
    page = write_replay(recorded.scene, tmp_path / "replay.html", title="Sight < 3")
    assert "<title>Sight &lt; 3</title>" in page.read_text(encoding="utf-8")


def test_a_later_replay_takes_the_place_of_an_earlier_one(recorded, tmp_path):
    path = tmp_path / "replay.html"
    path.write_text("earlier")
    write_replay(recorded.scene, path)
    assert path.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_failure_leaves_the_earlier_replay_and_no_draft(recorded, tmp_path, monkeypatch):
    path = tmp_path / "replay.html"
    path.write_text("earlier")

    def fail(source, target):
        raise OSError("no space left")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="no space left"):
        write_replay(recorded.scene, path)
    assert path.read_text() == "earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_a_scene_that_does_not_record_has_no_replay(meshcat, make_game, tmp_path):
    game = make_game(meshcat, recording=False)
    with pytest.raises(InvalidInput, match="`recording` must be on"):
        write_replay(game.scene, tmp_path / "replay.html")
    assert list(tmp_path.iterdir()) == []
