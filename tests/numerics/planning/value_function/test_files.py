"""A saved value function comes back as it was, or not at all."""

import json
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.files import (
    load_value_function,
    save_value_function,
)
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.obstacles import room_of
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function


@pytest.fixture(scope="module")
def value():
    goal = Goal(state=(1.0, 2.0, 0.5, 0.0), tolerance=(0.8, 0.8, 1.1, np.inf))
    table = solve_value_function(Trailer(), goal, StateGrid.of_step(0.8, (1, 2)), polish=2)
    # Only its times are those of a cart that cannot reverse; such tables are solved sooner.
    return replace(table, trailer=Trailer(reverse=True))


@pytest.fixture
def saved(value, tmp_path):
    path = tmp_path / "value.npz"
    save_value_function(value, path)
    return path


def test_what_is_saved_comes_back(value, saved):
    back = load_value_function(saved)
    np.testing.assert_array_equal(back.table, value.table)
    for name in ("grid", "trailer", "goal", "scheme", "sweeps", "warnings", "placement"):
        assert getattr(back, name) == getattr(value, name)
    state = [-1.0, 1.0, 0.3, 0.2]
    assert back.time_to_go(state) == value.time_to_go(state)


def test_walls_come_back_too(tmp_path):
    """With them a loaded table drives as the one that was solved, and a change of them is seen."""
    goal = Goal(state=(6.0, 2.0, 0.0, 0.0), tolerance=(0.8, 0.8, 1.1, 1.1))
    world = make_world([(0, 0), (8, 0), (8, 4), (0, 4)])
    grid = StateGrid.covering((0, 0, 8, 4), 0.8)
    cart = Trailer(hitch_offset=0.1)
    value = solve_value_function(cart, goal, grid, obstacles=world)
    save_value_function(value, tmp_path / "walled.npz")
    back = load_value_function(tmp_path / "walled.npz")
    state = (2.0, 0.6, 0.1, 0.0)
    assert room_of(back.walls, state) == room_of(value.walls, state)
    with np.load(tmp_path / "walled.npz") as archive:
        parts = {name: archive[name].copy() for name in archive.files}
    parts["distance"] += 0.1
    np.savez(tmp_path / "walled.npz", **parts)
    with pytest.raises(InvalidInput, match="`file` must match its checksum"):
        load_value_function(tmp_path / "walled.npz")


def test_nothing_else_is_left_in_the_folder(saved):
    assert list(saved.parent.iterdir()) == [saved]


@pytest.mark.parametrize("part", [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_file_is_refused(saved, part):
    data = saved.read_bytes()
    saved.write_bytes(data[: int(part * len(data))])
    with pytest.raises(InvalidInput, match="`file` must be"):
        load_value_function(saved)


def test_a_changed_table_is_refused(value, saved):
    with np.load(saved) as archive:
        parts = {name: archive[name].copy() for name in archive.files}
    parts["table"][0, 0, 0, 0] = 1.0
    np.savez(saved, **parts)
    with pytest.raises(InvalidInput, match="`file` must match its checksum"):
        load_value_function(saved)


def test_a_flipped_bit_is_refused(saved):
    data = bytearray(saved.read_bytes())
    data[len(data) // 2] ^= 1
    saved.write_bytes(data)
    with pytest.raises(InvalidInput, match="`file` must"):
        load_value_function(saved)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"version": 99}, "have version 3 of the format; got 99"),
        ({"format": "something"}, "be a sightfield value function"),
        ({"grid": {"x_min": 0.0}}, "have every parameter"),
    ],
)
def test_a_foreign_header_is_refused(saved, change, words):
    with np.load(saved) as archive:
        parts = {name: archive[name] for name in archive.files}
    about = json.loads(str(parts.pop("about")))
    np.savez(saved, about=np.array(json.dumps(about | change)), **parts)
    with pytest.raises(InvalidInput, match=words):
        load_value_function(saved)


@pytest.mark.parametrize("content", [b"hello", b"PK\x03\x04", b"\x93NUMPY"])
def test_a_foreign_file_is_refused(tmp_path, content):
    path = tmp_path / "value.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidInput, match="`file` must be"):
        load_value_function(path)


def test_an_array_of_someone_else_is_refused(tmp_path):
    path = tmp_path / "value.npz"
    np.savez(path, table=np.zeros(3))
    with pytest.raises(InvalidInput, match="be a sightfield value function"):
        load_value_function(path)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(InvalidInput, match="`file` must be readable"):
        load_value_function(tmp_path / "none.npz")


def test_a_missing_folder_is_refused(value, tmp_path):
    with pytest.raises(InvalidInput, match="folder that exists"):
        save_value_function(value, tmp_path / "none" / "value.npz")
