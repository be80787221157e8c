"""A saved visibility game comes back as it was, or not at all."""

import json
import math
import zipfile

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.files import (
    load_guaranteed_times,
    save_guaranteed_times,
)
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

ROOM = make_world([(0, 0), (4, 0), (4, 4), (2.03, 4), (2.03, 2.03), (0, 2.03)])


@pytest.fixture(scope="module", params=["middle", "lower"])
def table(request):
    return solve_visibility_game(
        ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.3, bound=request.param, sight_range=3.0
    )


@pytest.fixture
def saved(table, tmp_path):
    path = tmp_path / "game.npz"
    save_guaranteed_times(table, path)
    return path


def test_what_is_saved_comes_back(table, saved):
    back = load_guaranteed_times(saved)
    assert (back.bound, back.sight_range, back.step) == (table.bound, 3.0, table.step)
    assert back.share_for_ever == table.share_for_ever
    assert back.nbytes == table.nbytes
    for p in table.places[::9]:
        np.testing.assert_array_equal(back.times_from(p), table.times_from(p))
    place, time = table.best_step([1.0, 1.0], [2.4, 1.5])
    again, same = back.best_step([1.0, 1.0], [2.4, 1.5])
    np.testing.assert_array_equal(again, place)
    assert same == time > 0


def test_any_numpy_can_read_it(table, saved):
    with np.load(saved, allow_pickle=False) as archive:
        np.testing.assert_array_equal(archive["planes.tiles"], table.planes.tiles)


def test_no_range_comes_back_as_infinite(tmp_path):
    table = solve_visibility_game(ROOM, pursuer_speed=1.0, evader_speed=0.3, grid=0.4)
    save_guaranteed_times(table, tmp_path / "game.npz")
    assert load_guaranteed_times(tmp_path / "game.npz").sight_range == math.inf


def test_nothing_else_is_left_in_the_folder(saved):
    assert list(saved.parent.iterdir()) == [saved]


@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_file_is_refused(saved, part):
    data = saved.read_bytes()
    saved.write_bytes(data[: int(part * len(data))])
    with pytest.raises(InvalidInput, match="`file` must be"):
        load_guaranteed_times(saved)


def entries_of(path):
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def fault_of(path):
    """What is wrong with a file, or nothing."""
    try:
        load_guaranteed_times(path)
    except InvalidInput as error:
        return str(error)
    return ""


def test_a_flipped_bit_is_refused_wherever_it_is(saved):
    whole, entries = saved.read_bytes(), entries_of(saved)
    rng = np.random.default_rng(1)
    refused = 0
    for at in rng.integers(len(whole), size=60):
        data = bytearray(whole)
        data[at] ^= 1 << int(rng.integers(8))
        saved.write_bytes(data)
        fault = fault_of(saved)
        # Some bits are dates and the like, which nobody reads.
        assert fault.startswith("`file` must") or entries_of(saved) == entries
        assert "\n" not in fault
        refused += bool(fault)
    assert refused > 50


def change(path, alter):
    """Write an archive anew, as someone would who knows its format but not its checksums."""
    entries = entries_of(path)
    alter(entries)
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in entries.items():
            archive.writestr(name, data)


def test_a_changed_table_is_refused(saved):
    def alter(entries):
        tiles = bytearray(entries["planes.tiles.npy"])
        tiles[-1] ^= 255
        entries["planes.tiles.npy"] = bytes(tiles)

    change(saved, alter)
    with pytest.raises(InvalidInput, match="`file` must match its checksums"):
        load_guaranteed_times(saved)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"version": 99}, "have version 3 of the format; got 99"),
        ({"format": "something"}, "be a sightfield visibility game"),
        ({"step": None}, "be a whole sightfield visibility game"),
        ({"checksums": {}}, "match its checksums"),
    ],
)
def test_a_foreign_description_is_refused(saved, changes, words):
    def alter(entries):
        entries["about.json"] = json.dumps(json.loads(entries["about.json"]) | changes)

    change(saved, alter)
    with pytest.raises(InvalidInput, match=words):
        load_guaranteed_times(saved)


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04", b"\x93NUMPY"])
def test_a_foreign_file_is_refused(tmp_path, content):
    path = tmp_path / "game.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match="`file` must be a whole sightfield visibility game"):
        load_guaranteed_times(path)


def test_an_archive_of_someone_else_is_refused(tmp_path):
    path = tmp_path / "game.npz"
    np.savez(path, table=np.zeros(3))
    with pytest.raises(InvalidInput, match="`file` must be a sightfield visibility game"):
        load_guaranteed_times(path)


def test_code_is_not_read(saved):
    def alter(entries):
        # An array of objects, which only pickle could read.
        header = entries["kept.npy"].replace(b"'<f8'", b"'|O' ")
        assert header != entries["kept.npy"]
        entries["kept.npy"] = header

    change(saved, alter)
    about = entries_of(saved)
    with zipfile.ZipFile(saved) as archive:
        sums = {info.filename: info.CRC for info in archive.infolist() if info.filename[-1] == "y"}
    described = json.loads(about["about.json"]) | {"checksums": sums}
    change(saved, lambda entries: entries.update({"about.json": json.dumps(described)}))
    with pytest.raises(InvalidInput, match="`file` must be a whole sightfield visibility game"):
        load_guaranteed_times(saved)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="`file` must be readable"):
        load_guaranteed_times(tmp_path / "none.npz")


def test_a_missing_folder_is_refused(table, tmp_path):
    with pytest.raises(InvalidInput, match="folder that exists"):
        save_guaranteed_times(table, tmp_path / "none" / "game.npz")
