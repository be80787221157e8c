"""A page shows all that its camera was asked to show, whatever its shape: replays and live ones."""

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from sightfield.diagrams.visuals.lighting import paint
from sightfield.diagrams.visuals.live_page import open_live_page
from sightfield.diagrams.visuals.meshes import disc_mesh
from sightfield.diagrams.visuals.replay import write_replay
from sightfield.diagrams.visuals.stage import Stage

pytestmark = pytest.mark.browser

SIZES = [(1024, 768), (1280, 720), (1920, 1080), (400, 800)]
# What the camera is asked to show, 16 by 9 [m], not about the middle of its picture.
LEFT, RIGHT, BOTTOM, TOP = -2.0, 14.0, -3.0, 6.0


class CornersScene:
    """Four discs at the corners of what is to be seen, and one in the middle."""

    def __init__(self, meshcat: Meshcat, *, recording: bool) -> None:
        self.meshcat = meshcat
        self._stage = Stage(meshcat, "/corners", recording=recording, period=0.1, tolerance=1e-3)
        self.meshcat.SetCamera(
            Meshcat.OrthographicCamera(
                left=LEFT, right=RIGHT, bottom=BOTTOM, top=TOP, near=0.1, far=20.0
            )
        )
        self.meshcat.SetCameraPose(np.array([0.0, -0.01, 10.0]), np.zeros(3))
        for k, (x, y) in enumerate(((LEFT, BOTTOM), (RIGHT, TOP), (6.0, 1.5))):
            self._stage.mesh(f"{k}", disc_mesh(0.2), paint(0.1, 0.1, 0.1))
            for time in (0.0, 1.0):
                self._stage.begin(time)
                self._stage.place(f"{k}", x, y + 0.01 * time)

    def finish_recording(self) -> None:
        self._stage.finish_recording()


@pytest.fixture(scope="module", params=["replay", "live"])
def shown(request, tmp_path_factory):
    """The replay's file, or the live page."""
    if request.param == "live":
        meshcat = open_live_page(port=0)
        CornersScene(meshcat, recording=False)
        return meshcat
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    meshcat = Meshcat(MeshcatParams(port=0, show_stats_plot=False))
    write_replay(CornersScene(meshcat, recording=True), path)
    return path


@pytest.fixture(scope="module")
def watched(shown, new_page):
    """The same, open in a browser."""
    watched = new_page()
    if isinstance(shown, Meshcat):
        watched.page.goto(shown.web_url())
    else:
        watched.open_replay(shown)
    watched.page.wait_for_function("viewer.camera.type === 'OrthographicCamera'")
    return watched


def pixels(watched, size) -> np.ndarray:
    """Where points of the floor are on a page of a size: corners, middle, 1 m east and 1 m north.

    Shape (7, 2), from the page's upper left corner [px].
    """
    watched.resize(*size)
    corners = [(x, y) for x in (LEFT, RIGHT) for y in (BOTTOM, TOP)]
    return watched.on_screen(np.array([*corners, (6.0, 1.5), (7.0, 1.5), (6.0, 2.5)]))


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_all_that_was_asked_for_is_on_the_page_and_nothing_is_stretched(watched, size):
    seen = pixels(watched, size)
    assert (seen[:4] >= -0.5).all()
    assert (seen[:4] <= np.array(size) + 0.5).all()
    middle, east, north = seen[4:]
    # As large as the page lets it be, and as wide as high.
    scale = min(size[0] / (RIGHT - LEFT), size[1] / (TOP - BOTTOM))
    np.testing.assert_allclose(east - middle, [scale, 0.0], atol=1e-3 * scale)
    np.testing.assert_allclose(north - middle, [0.0, -scale], atol=1e-3 * scale)


def test_a_page_that_was_narrow_and_is_wide_again_is_as_it_was(watched):
    before = pixels(watched, (1280, 720))
    pixels(watched, (400, 800))
    np.testing.assert_allclose(pixels(watched, (1280, 720)), before, atol=1e-6)


def test_what_is_left_of_a_narrow_page_is_above(watched):
    seen = pixels(watched, (400, 800))
    assert seen[0, 1] == pytest.approx(800, abs=1)
    assert watched.complaints == []
