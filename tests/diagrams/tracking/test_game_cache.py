"""Solved visibility games are kept on disk, and whatever happens to the disk the run goes on."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest

from sightfield.diagrams.tracking import solved_game
from sightfield.diagrams.tracking.solved_game import games_folder, recall_or_solve
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world

CORNERS = [(0, 0), (3, 0), (3, 3), (1.53, 3), (1.53, 1.53), (0, 1.53)]
ROOM = make_world(CORNERS)
OPTIONS = {"pursuer_speed": 1.0, "evader_speed": 0.3, "grid": 0.3}


def ask(folder, world=ROOM, **changes):
    return recall_or_solve(world, folder=folder, **(OPTIONS | changes))


def files(folder):
    return sorted(path for path in Path(folder).rglob("*") if path.is_file())


def test_a_game_is_solved_once(tmp_path):
    first, known = ask(tmp_path / "games")
    assert not known
    second, known = ask(tmp_path / "games")
    assert known
    np.testing.assert_array_equal(second.planes.tiles, first.planes.tiles)
    assert len(files(tmp_path)) == 1


@pytest.mark.parametrize(
    "changes",
    [
        {"world": make_world([(x + 1e-9 * (x == 3), y) for x, y in CORNERS])},
        {"pursuer_speed": 1.0 + 1e-12},
        {"evader_speed": 0.31},
        {"grid": 0.29},
        {"bound": "lower"},
        {"horizon": 60.0},
        {"sight_range": 4.0},
        {"pursuer_regions": (make_world([(0.1, 0.1), (2.9, 0.1), (2.9, 1.4), (0.1, 1.4)]),)},
        {"evader_regions": (make_world([(0.1, 0.1), (2.9, 0.1), (2.9, 1.4), (0.1, 1.4)]),)},
    ],
)
def test_another_game_is_another_file(tmp_path, changes):
    ask(tmp_path)
    assert not ask(tmp_path, **changes)[1]
    assert len(files(tmp_path)) == 2
    assert ask(tmp_path, **changes)[1]


def test_another_solver_is_another_game(tmp_path, monkeypatch):
    ask(tmp_path)
    solver = tmp_path / "solver"
    solver.mkdir()
    (solver / "sweeps.py").write_text("FOR_EVER = 254")
    monkeypatch.setattr(solved_game.visibility_game, "__path__", [str(solver)])
    assert not ask(tmp_path)[1]


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.setenv("SIGHTFIELD_GAMES", "")
    monkeypatch.chdir(tmp_path)
    assert games_folder() is None
    assert not ask(games_folder())[1]
    assert not ask(games_folder())[1]
    assert files(tmp_path) == []


def test_the_folder_is_in_the_users_cache(tmp_path, monkeypatch):
    monkeypatch.delenv("SIGHTFIELD_GAMES")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    assert games_folder() == tmp_path / "caches" / "sightfield" / "games"
    # As the convention has it: nothing relative.
    monkeypatch.setenv("XDG_CACHE_HOME", "caches")
    assert games_folder() == tmp_path / ".cache" / "sightfield" / "games"


@pytest.mark.parametrize("damage", ["truncated", "flipped", "foreign"])
def test_a_damaged_file_is_said_in_a_line_and_replaced(tmp_path, caplog, damage):
    first, _ = ask(tmp_path)
    (path,) = files(tmp_path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes({"truncated": data[:-50], "flipped": data, "foreign": b"hello"}[damage])
    again, known = ask(tmp_path)
    assert not known
    np.testing.assert_array_equal(again.planes.tiles, first.planes.tiles)
    (line,) = caplog.messages
    assert line.startswith("a kept visibility game is solved anew: `file` must be")
    assert str(path) in line
    assert "\n" not in line
    assert ask(tmp_path)[1]


def test_where_nothing_can_be_kept_the_run_goes_on(tmp_path, caplog):
    # A file where the folder should be; permissions would not stop root.
    (tmp_path / "games").write_text("")
    table, known = ask(tmp_path / "games")
    assert not known
    assert table.pairs > 0
    (line,) = caplog.messages
    assert line.startswith(f"the solved visibility game is not kept in {tmp_path / 'games'}: ")
    assert "\n" not in line


def test_a_full_disk_does_not_end_the_run(tmp_path, caplog, monkeypatch):
    def fail(table, path):
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(solved_game, "save_guaranteed_times", fail)
    table, known = ask(tmp_path)
    assert not known
    assert table.pairs > 0
    assert [line.endswith("No space left on device") for line in caplog.messages] == [True]
    assert files(tmp_path) == []


def test_the_tables_not_used_for_longest_make_room(tmp_path, monkeypatch):
    for grid in (0.3, 0.31, 0.32):
        ask(tmp_path, grid=grid)
        (path,) = (each for each in files(tmp_path) if os.stat(each).st_mtime > 1e9)
        os.utime(path, (1e8 + 1e4 * grid, 1e8 + 1e4 * grid))
    sizes = sum(os.path.getsize(each) for each in files(tmp_path))
    # The first one is used again.
    assert ask(tmp_path, grid=0.3)[1]
    monkeypatch.setattr(solved_game, "MOST_BYTES", sizes)
    ask(tmp_path, grid=0.33)
    assert sum(os.path.getsize(each) for each in files(tmp_path)) <= sizes
    assert ask(tmp_path, grid=0.3)[1]
    assert ask(tmp_path, grid=0.33)[1]
    assert not ask(tmp_path, grid=0.31)[1]


def test_what_a_killed_process_left_is_removed(tmp_path):
    for name, age in (("old.npz.part", 1e5), ("new.npz.part", 0.0)):
        (tmp_path / name).write_text("half a table")
        if age:
            os.utime(tmp_path / name, (1.0, 1.0))
    ask(tmp_path)
    assert [path.name for path in files(tmp_path) if path.suffix == ".part"] == ["new.npz.part"]


def test_several_may_keep_the_same_game_at_once(tmp_path):
    found = []
    threads = [threading.Thread(target=lambda: found.append(ask(tmp_path)[0])) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 4
    assert len(files(tmp_path)) == 1
    assert ask(tmp_path)[1]


def test_a_kept_table_that_takes_too_much_memory_is_refused(tmp_path):
    ask(tmp_path)
    with pytest.raises(InvalidInput, match="so that the table takes at most 1e-06 GB"):
        ask(tmp_path, memory=1e3)
