"""Games of tracking on pictures, and their cameras' calibration."""

import numpy as np
import pytest

from sightfield.diagrams.vision.tracking.picture_game import set_up_picture_game
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.calibration_files import save_calibration


def test_practice_finds_the_cameras_own_optics(practised, loaded):
    optics = loaded("omni_1v1").vision.optics
    assert practised.camera.focal_length == pytest.approx(optics.focal_length, rel=2e-3)
    assert practised.camera.pinhole_height == pytest.approx(optics.pinhole_height, rel=2e-3)
    np.testing.assert_allclose(practised.camera.axis_pixel, optics.axis_pixel, atol=0.1)


def test_a_scenario_may_name_its_calibration_file(loaded, practised, tmp_path):
    path = tmp_path / "camera.json"
    save_calibration(path, practised)
    game = set_up_picture_game(loaded("omni_1v1", f"vision.calibration={path}"))
    assert game.calibration.k == practised.k
    with pytest.raises(InvalidInput, match="`calibration` must be readable JSON"):
        set_up_picture_game(loaded("omni_1v1", f"vision.calibration={tmp_path / 'none.json'}"))
