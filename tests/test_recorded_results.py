"""Results are compared with what was recorded, number by number; what is recorded has its test."""

import ast
import json
from collections import namedtuple
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from pydrake.geometry import Box, Meshcat, Rgba
from pydrake.math import RigidTransform
from recorded_results import differences_of, to_plain

HERE = Path(__file__).parent

RECORDED = sorted(HERE.rglob("recorded/*.json"))


@pytest.mark.parametrize("file", RECORDED, ids=lambda file: str(file.relative_to(HERE)))
def test_what_is_recorded_has_a_test_that_says_so_in_its_name(file):
    tests = file.parents[1] / f"{file.stem}.py"
    tree = ast.parse(tests.read_text(encoding="utf-8"))
    known = {each.name for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)}
    recorded = json.loads(file.read_text(encoding="utf-8"))
    named = {key.partition("[")[0].partition(" ")[0] for key in recorded}
    assert named
    assert named <= known
    assert all("recorded" in name for name in named)


Place = namedtuple("Place", "x y")


@dataclass
class Found:
    where: Place
    sure: bool
    values: np.ndarray


FOUND = Found(Place(1.25, -2), True, np.array([[1.0, np.nan], [np.inf, 4.0]]))


def test_results_are_kept_as_json_has_them():
    plain = to_plain({"found": [FOUND], Path("here/map.png"): {"b", "a"}})
    assert plain == {
        "found": [
            {
                "where": {"x": 1.25, "y": -2},
                "sure": True,
                "values": [[1.0, "nan"], ["inf", 4.0]],
            }
        ],
        "map.png": ["a", "b"],
    }
    assert json.loads(json.dumps(plain)) == plain


def test_what_has_no_known_parts_cannot_be_recorded():
    with pytest.raises(TypeError, match="object"):
        to_plain(object())


@pytest.mark.parametrize(
    ("recorded", "value", "unlike"),
    [
        (1.0, 1.0 + 1e-8, 0),
        (1.0, 1.0 + 1e-4, 1),
        (0.0, 1e-10, 0),
        (2, 3, 1),
        (True, 1.5, 1),
        ("a", "b", 1),
        (None, 0.0, 1),
        ([1.0, 2.0], [1.0], 1),
        ({"a": 1}, {"b": 1}, 2),
        ([1.0, {"a": "b"}], [2.0, {"a": "c"}], 2),
        ("nan", "nan", 0),
    ],
)
def test_each_place_that_is_unlike_is_told(recorded, value, unlike):
    assert len(list(differences_of(recorded, value))) == unlike


def test_in_a_digest_every_number_counts_and_so_does_their_order():
    numbers = np.random.default_rng(3).normal(size=(40, 3))
    digest = to_plain(numbers)
    assert len(json.dumps(digest)) < 400
    assert list(differences_of(digest, to_plain(numbers * (1 + 1e-9)))) == []
    for k in range(numbers.size):
        other = numbers.copy()
        other.flat[k] += 0.01
        assert list(differences_of(digest, to_plain(other)))
    swapped = numbers.copy()
    swapped[[10, 20]] = swapped[[20, 10]]
    assert list(differences_of(digest, to_plain(swapped)))
    holed = numbers.copy()
    holed[20, 1] = np.nan
    assert list(differences_of(digest, to_plain(holed)))


def draw(folder, x=2.0, colour="red", label="way", title="A map"):
    figure = Figure()
    axes = figure.add_subplot()
    axes.plot([0.0, 1.0], [0.0, x], color=colour, label=label)
    axes.fill([0.0, 1.0, 1.0], [0.0, 0.0, 1.0])
    axes.imshow(np.arange(6).reshape(2, 3), extent=(0.0, 3.0, 0.0, x))
    axes.scatter([1.0], [2.0])
    axes.text(0.5, 0.5, "here")
    axes.set_title(title)
    figure.savefig(folder / "map.png")


@pytest.mark.parametrize(
    "otherwise", [{"x": 2.5}, {"colour": "blue"}, {"label": "path"}, {"title": "Another"}]
)
def test_a_picture_is_known_by_what_is_drawn_on_it(saved_pictures, tmp_path, otherwise):
    draw(tmp_path)
    (drawn,) = saved_pictures.values()
    first = to_plain(drawn)
    draw(tmp_path)
    assert to_plain(saved_pictures) == {"map.png": first}
    draw(tmp_path, **otherwise)
    assert list(differences_of(first, to_plain(saved_pictures)["map.png"]))


def test_a_scene_is_known_by_what_meshcat_was_told(meshcat_calls):
    meshcat = Meshcat()
    meshcat.SetObject("robots/1/body", Box(1.0, 2.0, 3.0), Rgba(1.0, 0.5, 0.0))
    for k in range(30):
        meshcat.SetTransform("robots/1", RigidTransform([0.1 * k, 0.0, 0.0]), time_in_recording=k)
    told = to_plain(meshcat_calls)
    assert list(told) == ["SetObject robots/#/body", "SetTransform robots/#"]
    assert told["SetTransform robots/#"]["calls"] == 30
    assert told["SetTransform robots/#"]["then"]["shape"] == [29 * 13]
    assert told["SetObject robots/#/body"]["first"][1:] == [
        "Box(width=1, depth=2, height=3)",
        [1.0, 0.5, 0.0, 1.0],
    ]


def test_a_surface_is_the_same_whatever_triangles_it_is_cut_into(meshcat_calls):
    meshcat = Meshcat()
    square = np.array([[0.0, 2.0, 2.0, 0.0], [0.0, 0.0, 3.0, 3.0], [1.0] * 4])
    cut = [[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]]
    for k, faces in enumerate(cut):
        meshcat.SetTriangleMesh(f"floor/{k}", square, np.array(faces).T, Rgba(0.2, 0.4, 0.6))
    meshcat.SetTriangleMesh("floor/2", square + 0.1, np.array(cut[0]).T, Rgba(0.2, 0.4, 0.6))
    (told,) = meshcat_calls.values()
    one, other, moved = (call[-1] for call in told.calls)
    assert one == pytest.approx([6.0, 6.0, 9.0, 6.0])
    assert other == pytest.approx(one)
    assert moved == pytest.approx([6.0, 6.6, 9.6, 6.6])
