"""A calibration file gives back what was saved, and says in one line what is wrong with it."""

import json

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.calibration_files import (
    load_calibration,
    save_calibration,
)


@pytest.fixture
def saved(calibration, tmp_path):
    """A calibration file."""
    path = tmp_path / "calibration.json"
    save_calibration(path, calibration)
    return path


def edited(path, keys, value):
    """Set, or with `value` None delete, an entry of a file."""
    tree = json.loads(path.read_text())
    *parents, last = keys
    node = tree
    for key in parents:
        node = node[key]
    if value is None:
        del node[last]
    else:
        node[last] = value
    path.write_text(json.dumps(tree))


def test_what_was_saved_comes_back(saved, calibration):
    again = load_calibration(saved)
    for name in ("k", "height", "k_spread", "parabola", "base", "shell_radius", "shell_top"):
        assert getattr(again, name) == getattr(calibration, name)
    assert again.camera == calibration.camera
    p = np.linspace(90, 155, 20)
    for model in ("thesis", "exact"):
        assert np.array_equal(again.range_of(model, p), calibration.range_of(model, p))
        assert np.array_equal(again.curves[model].rms, calibration.curves[model].rms)


KEYS = [
    ("k",),
    ("height",),
    ("camera",),
    ("parabola",),
    ("readings",),
    ("shell_top",),
    ("camera", "focal_length"),
    ("camera", "centre"),
    ("parabola", "b"),
    ("readings", "pixels"),
]


@pytest.mark.parametrize("keys", KEYS, ids=".".join)
def test_a_missing_key_is_named(saved, keys):
    edited(saved, keys, None)
    with pytest.raises(InvalidInput, match=f"got no {keys[-1]}$"):
        load_calibration(saved)


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (["version"], 2, "`calibration.version` must be 1; got 2"),
        (["format"], "other", "`calibration` must be a file of the format"),
        (["extra"], 1, "got also extra"),
        (["k"], "many", "`calibration.k` must be a finite number; got many"),
        (["k"], float("nan"), "`calibration.k` must be a finite number; got nan"),
        (["k"], True, "`calibration.k` must be a finite number; got True"),
        (["k"], -3.0, "`k` must be positive; got -3.0"),
        (["camera"], 3, "`calibration.camera` must be a mapping; got 3"),
        (["camera", "width"], 1.5, "`width` must be a positive whole number; got 1.5"),
        (["camera", "focal_length"], [], "`calibration.camera.focal_length` must be a finite"),
        (["camera", "centre"], [1], r"`centre` must be \(column, row\)"),
        (["camera", "centre"], ["a", 1], "`calibration.camera.centre` must be a list of numbers"),
        (["parabola", "a"], "x", "`calibration.parabola.a` must be a finite number; got x"),
        (["readings", "distance"], [1, 2], "`readings` must hold a distance, a bearing and a"),
        (["readings", "distance"], 1, "`calibration.readings.distance` must be a list of 1"),
        (["readings", "pixels"], [[1], [1, 2]], "`calibration.readings.pixels` must be a list"),
        (["shell_top"], 0.0, "`shell_top` must be above the base"),
    ],
)
def test_nonsense_is_named(saved, keys, value, message):
    edited(saved, keys, value)
    with pytest.raises(InvalidInput, match=message) as caught:
        load_calibration(saved)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("text", ["", "{", "[1, 2]", "3", "\x00", '{"version": 1}'])
def test_what_is_no_calibration_is_refused(tmp_path, text):
    path = tmp_path / "other.json"
    path.write_text(text)
    with pytest.raises(InvalidInput, match="`calibration` must be"):
        load_calibration(path)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidInput, match=r"got .*nowhere.json"):
        load_calibration(tmp_path / "nowhere.json")
