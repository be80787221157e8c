"""Pictures beside the map, live and in a replay."""

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams

from sightfield.diagrams.vision.make_picture_tracking import modified_field_of
from sightfield.diagrams.vision.picture_scene import mirror_square
from sightfield.diagrams.vision.report import summarise_picture_tracking, write_picture_report
from sightfield.diagrams.vision.run import run_picture_tracking
from sightfield.systems.numerics.vision.omni_optics import OmniCamera


def test_a_report_holds_the_pictures_in_its_replay(picture_game, tmp_path):
    page = Meshcat(MeshcatParams(port=0, show_stats_plot=False))
    game = picture_game("omni_2v2", "seconds=0.6")
    run = run_picture_tracking(game, page, recording=True)
    # A path for each picture of each camera, at 0, 0.25 and 0.5 s.
    for camera in range(2):
        for tick in (0, 5, 10):
            assert page.HasPath(f"/pictures/views/{camera}/{tick}/square")
        assert not page.HasPath(f"/pictures/views/{camera}/3/square")
    for evader in range(2):
        assert page.HasPath(f"/pictures/estimates/{evader}/ring")
    written = write_picture_report(run, summarise_picture_tracking(run, "short"), tmp_path)
    assert sorted(written) == sorted(path.name for path in tmp_path.iterdir())
    assert (tmp_path / "replay.html").stat().st_size > 1e6


def test_a_live_page_shows_the_last_picture_only(picture_game):
    page = Meshcat(MeshcatParams(port=0, show_stats_plot=False))
    run_picture_tracking(picture_game("omni_1v1", "seconds=0.6"), page)
    assert page.HasPath("/pictures/views/0/0/square")
    assert not page.HasPath("/pictures/views/0/5")


@pytest.mark.parametrize("centre", [None, (100.0, 400.0)])
def test_the_square_shown_is_centred_on_the_mirror(centre):
    camera = OmniCamera(centre=centre)
    image = np.zeros((480, 640, 4), dtype=np.uint8)
    column, row = np.rint(camera.axis_pixel).astype(int)
    image[row, column] = 255
    square = mirror_square(image, camera)
    half = len(square) // 2
    assert half >= camera.rim_radius
    assert square.shape == (2 * half, 2 * half, 3)
    np.testing.assert_array_equal(np.argwhere(square[..., 0] == 255), [[half, half]])


def test_the_arrows_shown_are_the_modified_field(picture_game):
    points, evaders = np.array([[0.4, 0.4], [3.7, 1.7]]), np.array([[2.9, 1.7]])
    pull = modified_field_of(picture_game("omni_1v1", "vision.weight=0"))
    towards = evaders - points
    np.testing.assert_allclose(
        pull(0, points, evaders, np.array([0])),
        towards / np.linalg.norm(towards, axis=1, keepdims=True),
        atol=1e-12,
    )
    assert not pull(0, points, evaders, np.array([-1])).any()
