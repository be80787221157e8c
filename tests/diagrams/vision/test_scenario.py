"""What scenarios of tracking on pictures may say.

Games of tracking on pictures, and their cameras' calibration.
"""

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from sightfield.diagrams.vision.calibration import load_camera
from sightfield.diagrams.vision.make_picture_tracking import (
    AddPictureTracking,
    MakePictureTracking,
)
from sightfield.diagrams.vision.run import run_picture_tracking
from sightfield.diagrams.vision.scenario import set_up_picture_game
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.calibration import save_calibration
from sightfield.systems.numerics.vision.omni_optics import OmniCamera


@pytest.mark.parametrize(("name", "size"), [("omni_1v1", 1), ("omni_2v2", 2)])
def test_built_in_scenarios_give_each_evader_a_colour_of_its_own(loaded, name, size):
    scenario = loaded(name)
    assert scenario.pursuers.size == scenario.evaders.size == size
    colours = [shell.colour for shell in scenario.vision.evader_shells]
    assert len(set(colours)) == size
    assert scenario.vision.pursuer_shell.colour not in colours


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("vision.weight=1.5", r"`vision.weight` must lie in \[0, 1\]; got 1.5"),
        ("vision.colours=[puce]", "`vision.colours.0` must be one of red, .*; got puce"),
        ("vision.colours=[red, green]", "`vision.colours` must have 1 entries"),
        ("vision.senses=smell", "`vision.senses` must be one of pictures, truth; got smell"),
        ("vision.model=best", "`vision.model` must be one of .*; got best"),
        ("vision.quality.noise=-1", "`vision.quality.noise` must be zero or positive; got -1"),
        ("vision.quality.grain=1", "`vision.quality.grain` must be a key of the scenario; got 1"),
        ("vision.optics.zoom=1", "`vision.optics.zoom` must be a key of the scenario; got 1"),
        ("vision.optics.mirror_radius=0", "`vision.optics.mirror_radius` must be positive"),
        ("vision.picture_period=0.12", "`vision.picture_period` must be a multiple of `period`"),
        ("vision.calibrated_range=[2, 1]", r"`vision.calibrated_range` must be \[least, gre"),
        ("vision.targets=[0, 0]", "`vision.targets` must have 1 entries or none"),
        ("vision.targets=[1]", r"`vision.targets.0` must lie in \[0, 1\); got 1"),
        ("pursuers.model=point", "`pursuers.model` must be differential_drive"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(loaded, setting, message):
    with pytest.raises(InvalidInput, match=message) as refused:
        loaded("omni_1v1", setting)
    assert "\n" not in str(refused.value)


def test_two_evaders_cannot_share_a_colour(loaded):
    with pytest.raises(InvalidInput, match=r"`vision\.colours` must all be different"):
        loaded("omni_2v2", "vision.colours=[red, red]")


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
    with pytest.raises(InvalidInput, match=r"`calibration` must be readable; got .*none\.json"):
        set_up_picture_game(loaded("omni_1v1", f"vision.calibration={tmp_path / 'none.json'}"))


@pytest.mark.parametrize(
    ("setting", "fine"),
    [
        ("vision.weight=0", True),
        ("vision.weight=1", True),
        ("vision.weight=-0.001", False),
        ("vision.stand_off=0", True),
        ("vision.fade=0", False),
        ("vision.calibrated_range=[0.2, 0.2]", False),
        ("vision.calibrated_range=[0, 1]", False),
        ("vision.calibrated_range=[0.1, 1, 2]", False),
        ("vision.calibrated_range=[0.1, 0.11]", True),
        ("vision.targets=[-1]", False),
        ("vision.targets=[0]", True),
        ("vision.targets=[]", True),
        ("vision.picture_period=0.05", True),
        ("vision.picture_period=0.15", True),
        ("vision.picture_period=0.025", False),
        ("vision.picture_period=0.1000001", False),
        ("vision.colours=[]", False),
    ],
)
def test_settings_end_where_they_say(loaded, setting, fine):
    if fine:
        loaded("omni_1v1", setting)
        return
    with pytest.raises(InvalidInput):
        loaded("omni_1v1", setting)


def test_what_is_no_game_is_refused_by_its_type(loaded):
    scenario = loaded("omni_1v1")
    for call in (
        lambda: MakePictureTracking(scenario),
        lambda: AddPictureTracking(DiagramBuilder(), scenario),
        lambda: run_picture_tracking(scenario),
    ):
        with pytest.raises(InvalidInput, match="`game` must be of type PictureGame; got"):
            call()
    with pytest.raises(InvalidInput, match="`scenario` must be of type PictureTrackingScenario"):
        set_up_picture_game(3)


def test_optics_come_from_a_file_or_are_the_usual(tmp_path):
    assert load_camera(None) == OmniCamera()
    path = tmp_path / "optics.yaml"
    path.write_text("mirror_radius: 0.06\nwidth: 320\n")
    assert load_camera(path) == OmniCamera(mirror_radius=0.06, width=320)
    with pytest.raises(InvalidInput, match="`camera` must be a YAML file"):
        load_camera(tmp_path / "none.yaml")
