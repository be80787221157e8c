"""Meshes, paints, texts and what a stage says are as they were recorded."""

import json

import numpy as np
import pytest
import shapely
from pydrake.geometry import Meshcat, MeshcatParams

from sightfield.diagrams.visuals import meshes
from sightfield.diagrams.visuals.lighting import paint, picture_square, set_lights
from sightfield.diagrams.visuals.stage import Stage
from sightfield.diagrams.visuals.text import Digits, advance, text_mesh

ELL = shapely.Polygon([[0, 0], [3, 0.2], [3, 1], [1, 1.1], [1.3, 3], [0, 3]])
POINTS, WAYS = np.array([[0.2, 0.1], [2.0, 1.0], [3.0, 3.0]]), np.array([[1, 2], [-3, 1], [0, 0]])


@pytest.fixture
def page() -> Meshcat:
    return Meshcat(MeshcatParams(port=0, show_stats_plot=False))


def test_meshes_are_as_recorded(as_recorded):
    made = {
        "flat": meshes.flat_mesh(ELL, 0.3),
        "extruded": meshes.extruded_mesh(ELL, 0.1, 0.7),
        "line": meshes.line_mesh([np.array([[0, 0], [2, 0], [1, 1.5]])], 0.2),
        "bars": meshes.bar_mesh(POINTS, POINTS + WAYS, 0.15),
        "fan": meshes.fan_mesh(POINTS, np.array([1.0, 2.0])),
        "arrows": meshes.arrow_mesh(POINTS, WAYS, 0.8),
        "ring": meshes.disc_mesh(0.7, 0.3),
        "nose": meshes.nose_mesh(0.4, 0.25),
        "merged": meshes.merged([meshes.disc_mesh(0.2), meshes.unit_bar_mesh(0.1)]),
        "words": text_mesh("Ag 8%", 0.4, align="centre"),
        "bold": text_mesh("Bj.", 0.3, bold=True),
    }
    as_recorded({name: [each.vertices, each.faces, each.area] for name, each in made.items()})
    as_recorded([advance("a b"), advance("W.", bold=True)], "advance")


def test_paints_are_as_recorded(as_recorded):
    colours = [(0.02, 0.5, 0.9), (0.04, 0.041, 1.0), (0.93, 0.75, 0.27), (0.3, 0.0, 0.6)]
    paints = [paint(*colour, opacity=0.4) for colour in colours]
    as_recorded([[each.r(), each.g(), each.b(), each.a()] for each in paints])


def test_a_picture_on_a_page_is_as_recorded(as_recorded):
    picture = np.arange(40 * 30 * 3).reshape(40, 30, 3).astype(np.uint8)
    mesh = picture_square(picture, 1.8, pixels=12)
    scene = json.loads(mesh.source().in_memory().mesh_file.contents())
    assert scene.pop("images")[0]["uri"].startswith("data:image/jpeg;base64,")
    as_recorded(scene)


@pytest.mark.parametrize("recording", [False, True])
def test_what_a_stage_says_is_as_recorded(recording, page, as_recorded, meshcat_calls):
    stage = Stage(page, "/there", recording=recording, period=0.25, tolerance=0.02)
    set_lights(page)
    stage.mesh("glass", meshes.disc_mesh(0.5), paint(0.2, 0.4, 0.6, 0.5))
    stage.raise_to("above", 0.35)
    clock = Digits(stage, "clock", 0.2, paint(0.1, 0.2, 0.3), places=4, decimals=2)
    for k in range(9):
        stage.begin(0.25 * k)
        stage.place("moved", 0.1 * k**2, -0.3 * k)
        stage.pose("turned", 0.2, 0.1 * k, 0.3 * (k % 4), reach=0.7)
        stage.stretch("long", 1.0 + (k > 4))
        stage.fade("glass", 0.5 - 0.05 * k)
        stage.show("lamp", k % 3 == 1)
        clock.show(1.37 * k**2)
    if recording:
        stage.finish_recording()
    calls = {key: told.calls for key, told in meshcat_calls.items()}
    as_recorded({key: each for key, each in calls.items() if "SetTriangleMesh" not in key})
