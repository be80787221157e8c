"""Logs that are whole are read; others are refused in one line."""

import json
import pickle

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.harvest_log import (
    ARRAYS,
    LOG_FILE,
    MACHINES_FILE,
    read_harvest,
)


def refusal(folder):
    with pytest.raises(InvalidInput) as caught:
        read_harvest(folder)
    said = str(caught.value)
    assert "\n" not in said
    assert said.startswith("`")
    return said


def test_what_is_written_is_read(by_hand, tmp_path):
    by_hand.about["combines"][0].update(capacity=9000.0, turning_radius=4.5)
    by_hand.about["parts"][0]["holes"] = [[[20, 5], [20, 8], [23, 8], [23, 5], [20, 5]]]
    log, site = read_harvest(by_hand.write(tmp_path))
    for name in ARRAYS:
        assert getattr(log, name) == pytest.approx(by_hand.log[name])
    (combine,) = site.combines
    assert combine.front.tolist() == by_hand.about["combines"][0]["header"]
    limits = combine.capacity, combine.acceleration, combine.lateral_acceleration
    assert limits == (9000.0, 0.5, np.inf)
    assert combine.turning_radius == 4.5
    assert (site.margin, site.density) == (80.0, 0.7)
    # Rings are taken whichever way round and closed or not.
    assert site.parts[0].holes[0].equals(shapely.box(20, 5, 23, 8))


def test_no_carts_are_no_carts(by_hand, tmp_path):
    by_hand.about["carts"] = []
    for name in ("tractor_pose", "trailer_pose", "cart_load"):
        by_hand.log[name] = by_hand.log[name][:, :0]
    log, site = read_harvest(by_hand.write(tmp_path))
    assert (log.tractor_pose.shape[1], site.carts) == (0, ())


def test_a_folder_that_is_not_there_is_refused(tmp_path):
    assert "folder" in refusal(tmp_path / "none")


@pytest.mark.parametrize("file", [LOG_FILE, MACHINES_FILE])
def test_a_file_that_is_not_there_is_refused(by_hand, tmp_path, file):
    (by_hand.write(tmp_path) / file).unlink()
    assert file in refusal(tmp_path)
    (tmp_path / file).mkdir()
    assert file in refusal(tmp_path)


@pytest.mark.parametrize("name", ARRAYS)
def test_an_array_that_is_missing_or_of_another_shape_is_refused(by_hand, tmp_path, name):
    whole = by_hand.log[name]
    del by_hand.log[name]
    assert f"`{name}`" in refusal(by_hand.write(tmp_path))
    by_hand.log[name] = whole[:-1]
    assert "shape" in refusal(by_hand.write(tmp_path))
    by_hand.log[name] = whole[..., None]
    assert "shape" in refusal(by_hand.write(tmp_path))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("tank", np.nan),
        ("combine_pose", np.inf),
        ("tractor_pose", 4e6),
        ("cutting", 0.5),
        ("time", 0.0),
        ("time", -np.inf),
    ],
)
def test_a_number_that_cannot_be_is_refused(by_hand, tmp_path, name, value):
    by_hand.log[name][7] = value
    assert refusal(by_hand.write(tmp_path)).startswith(f"`{name}`")


@pytest.mark.parametrize("kind", [complex, "U5", object])
def test_arrays_that_are_no_real_numbers_are_refused(by_hand, tmp_path, kind):
    by_hand.log["tank"] = by_hand.log["tank"].astype(kind)
    refusal(by_hand.write(tmp_path))


def test_one_sample_is_no_log(by_hand, tmp_path):
    by_hand.log = {name: array[:1] for name, array in by_hand.log.items()}
    assert "at least 2" in refusal(by_hand.write(tmp_path))


class _Mine:
    """Whoever unpickles it writes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_a_pickle_is_refused_and_not_run(by_hand, tmp_path):
    by_hand.write(tmp_path)
    mark = tmp_path / "mark"
    (tmp_path / LOG_FILE).write_bytes(pickle.dumps(_Mine(mark)))
    refusal(tmp_path)
    by_hand.log["tank"] = np.array([[_Mine(mark)]] * len(by_hand.log["time"]), dtype=object)
    refusal(by_hand.write(tmp_path))
    assert not mark.exists()


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
@pytest.mark.parametrize("file", [LOG_FILE, MACHINES_FILE])
def test_a_file_that_is_cut_short_is_refused(by_hand, tmp_path, share, file):
    path = by_hand.write(tmp_path) / file
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert file in refusal(tmp_path)


def test_a_log_with_changed_bytes_is_refused(by_hand, tmp_path):
    path = by_hand.write(tmp_path) / LOG_FILE
    whole = bytearray(path.read_bytes())
    whole[5000] ^= 0xFF
    path.write_bytes(whole)
    assert LOG_FILE in refusal(tmp_path)


def test_one_array_alone_is_no_log(by_hand, tmp_path):
    with open(by_hand.write(tmp_path) / LOG_FILE, "wb") as file:
        np.save(file, by_hand.log["time"])
    assert LOG_FILE in refusal(tmp_path)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda about: about.pop("combines"), "combines"),
        (lambda about: about.update(carts={"tractor": 1}), "carts"),
        (lambda about: about.update(carts=[3]), "carts[0]"),
        (lambda about: about.update(combines=[], carts=[]), "combines"),
        (lambda about: about["combines"][0].pop("body"), "combines[0].body"),
        (lambda about: about["combines"][0].update(header=[[0, 0], [1, 1]]), "combines[0].header"),
        (
            lambda about: about["combines"][0].update(header=[[0, 0], [1, 1], [1, 0], [0, 1]]),
            "combines[0].header",
        ),
        (lambda about: about["carts"][0].update(trailer=[[0, 0, 0]] * 3), "carts[0].trailer"),
        (lambda about: about["carts"][0].update(tractor=[[0, 0], [1]]), "carts[0].tractor"),
        (lambda about: about["carts"][0].update(tractor="abc"), "carts[0].tractor"),
        (lambda about: about["carts"][0].update(capacity=-1), "carts[0].capacity"),
        (lambda about: about["combines"][0].update(acceleration="1"), "combines[0].acceleration"),
        (lambda about: about.update(parts=[]), "parts"),
        (lambda about: about["parts"][0].update(boundary=None), "parts[0].boundary"),
        (lambda about: about["parts"][0].update(holes=3), "parts[0].holes"),
        (
            lambda about: about["parts"][0].update(holes=[[[0, 0], [1, 0], [1, -1]]]),
            "parts[0].holes[0]",
        ),
        (lambda about: about.pop("margin"), "margin"),
        (lambda about: about.update(margin=-0.1), "margin"),
        (lambda about: about.update(margin=float("nan")), "margin"),
        (lambda about: about.update(margin=10**400), "margin"),
        (lambda about: about.update(margin=True), "margin"),
        (
            lambda about: about["parts"][0]["boundary"].append([float("inf"), 0]),
            "parts[0].boundary",
        ),
    ],
)
def test_machines_that_cannot_be_are_refused(by_hand, tmp_path, change, name):
    change(by_hand.about)
    assert refusal(by_hand.write(tmp_path)).startswith(f"`{name}`")


@pytest.mark.parametrize("text", ["", "[]", "3", "{", "\xff", "[" * 100_000])
def test_what_is_no_object_of_json_is_refused(by_hand, tmp_path, text):
    (by_hand.write(tmp_path) / MACHINES_FILE).write_text(text, encoding="latin-1")
    assert MACHINES_FILE in refusal(tmp_path)


def test_more_machines_than_in_the_log_are_refused(by_hand, tmp_path):
    by_hand.about["combines"] *= 2
    assert json.dumps("combine_pose").strip('"') in refusal(by_hand.write(tmp_path))
