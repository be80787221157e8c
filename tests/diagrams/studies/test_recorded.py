"""What `sightfield study` says, draws and leaves is as it was recorded."""

import pytest


@pytest.fixture
def room(tmp_path, monkeypatch):
    """A folder with a room in it."""
    room = "POLYGON ((0 0, 4 0, 4 3, 0 3, 0 0), (1.2 1, 2.5 1.1, 2 2, 1.2 1))"
    (tmp_path / "room.wkt").write_text(room, encoding="utf-8")
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    "words",
    [
        "assignment --runs 2 --seconds 0.3 --workers 0 --opponent random_walk",
        "policies --runs 2 --size 1v1 --seconds 0.5 --workers 0 --opponent adversarial "
        "--pursuers thesis --pursuers margin --world room.wkt",
        "map --world room.wkt --grid 0.5 --factor speed_ratio --workers 0",
    ],
    ids=["assignment", "policies", "map"],
)
def test_a_study_is_as_recorded(words, room, as_it_was):
    as_it_was("study", *words.split())
