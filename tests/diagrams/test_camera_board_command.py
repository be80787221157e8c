"""`sightfield camera` calibrates on pictures of boards and converts files of cameras."""

import json
import shutil
from dataclasses import replace

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands.camera import camera
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.camera_models.camera_files import load_camera_model
from sightfield.systems.numerics.vision.camera_models.camera_model import angle_between
from sightfield.systems.numerics.vision.camera_models.central_cameras import MeiCamera

TRUTH = MeiCamera(
    xi=0.9, focal_x=130.0, focal_y=130.0, centre_x=244.0, centre_y=176.0, width=480, height=360
)
SQUARE, CORNERS = 0.04, (6, 4)


def invoke(*arguments):
    """Run a command; errors come through as exceptions."""
    result = CliRunner().invoke(camera, [str(each) for each in arguments])
    if isinstance(result.exception, Exception):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.stdout


def picture_of_board(rays, azimuth, angle, tilt):
    """Grey levels of a board before the camera, by the rays of pixels, shape (n,) of 1."""
    across = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    place = np.sin(angle) * across + [0, 0, np.cos(angle)]
    right = np.cross([0, 0, 1], across)
    facing = np.column_stack([right, np.cross(place, right), place])
    rotation = cv2.Rodrigues(np.array(tilt))[0] @ facing
    local, origin = rays @ rotation, 0.25 * place @ rotation
    with np.errstate(divide="ignore", invalid="ignore"):
        far = origin[2] / local[:, 2]
        x, y = (far[:, None] * local - origin)[:, :2].T / SQUARE
    half = (0.5 * (CORNERS[0] + 1), 0.5 * (CORNERS[1] + 1))
    on = (far > 0) & (np.abs(x) < half[0]) & (np.abs(y) < half[1])
    dark = (np.floor(x + half[0]) + np.floor(y + half[1])) % 2 == 0
    return np.where(on & dark, 0.1, 0.9)


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Folder of six pictures of a board and one of nothing."""
    folder = tmp_path_factory.mktemp("boards")
    # Twice as fine, with pixel centres between those of the picture.
    columns, rows = np.meshgrid(0.5 * np.arange(960) - 0.25, 0.5 * np.arange(720) - 0.25)
    rays = TRUTH.rays(np.stack([columns, rows], axis=-1).reshape(-1, 2))
    tilts = [(0.3, 0.1, 0), (-0.3, 0.2, 0.2), (0.1, -0.4, 0), (0.2, 0.3, -0.3), (-0.2, 0, 0.4)]
    for k, tilt in enumerate([*tilts, (0, 0.35, 0.1)]):
        grey = picture_of_board(rays, 1.05 * k, 0.9 + 0.1 * (k % 3), tilt).reshape(720, 960)
        small = cv2.resize(255 * grey, (480, 360), interpolation=cv2.INTER_AREA)
        colours = np.repeat(small.astype(np.uint8)[..., None], 3, axis=2)
        cv2.imwrite(str(folder / f"board{k}.png"), colours)
    cv2.imwrite(str(folder / "nothing.png"), np.full((360, 480, 3), 200, np.uint8))
    return folder


def test_copies_of_a_picture_make_no_camera_surer(pictures, tmp_path):
    words = ("calibrate", "--board", "6x4", "--square", SQUARE, "--json", "--pictures")
    for k in range(4):
        shutil.copy(pictures / f"board{k}.png", tmp_path / f"board{k}.png")
    once = json.loads(invoke(*words, tmp_path))
    for k in range(3):
        shutil.copy(pictures / "board0.png", tmp_path / f"copy{k}.png")
    again = json.loads(invoke(*words, tmp_path))
    assert again.pop("skipped") == ["copy0.png", "copy1.png", "copy2.png"]
    assert once.pop("skipped") == []
    assert again == once


def test_pictures_of_a_board_give_back_the_camera_that_took_them(pictures, tmp_path):
    out = tmp_path / "new" / "calibration"
    words = ("calibrate", "--board", "6x4", "--square", SQUARE, "--model", "mei")
    said = json.loads(invoke(*words, "--pictures", pictures, "--out", out, "--json"))
    assert len(said["pictures"]) == 6
    assert said["skipped"] == ["nothing.png"]
    assert said["rms"] < 0.1
    assert said["left_out_rms"] < 0.2
    assert abs(said["aspect"]["value"] - 1) < 5 * said["aspect"]["deviation"]
    assert "proportions that were said" in said["ruler"]
    assert json.loads((out / "summary.json").read_text()) == said
    files = {"camera.json", "opencv.yaml", "camchain.yaml", "summary.json", "residuals.png"}
    assert {file.name for file in out.glob("[!.]*")} == files
    assert cv2.imread(str(out / "residuals.png")).std() > 10
    found = load_camera_model(out / "opencv.yaml")
    assert load_camera_model(out / "camchain.yaml") == found
    pixels = np.stack(np.meshgrid(np.arange(120, 370, 25), np.arange(80, 280, 25)), -1)
    pixels = pixels.reshape(-1, 2).astype(float)
    apart = angle_between(found.rays(pixels), TRUTH.rays(pixels))
    assert np.degrees(apart).max() < 1.0


def test_a_report_in_words_doubts_a_ruler_that_is_wrong_in_one_direction(pictures, tmp_path):
    for name in ("board0.png", "board1.png", "board2.png", "board3.png", "nothing.png"):
        (tmp_path / name).symlink_to(pictures / name)
    words = ("calibrate", "--board", "6x4", "--square", f"{SQUARE}x{1.05 * SQUARE}")
    said = invoke(*words, "--model", "kannala_brandt", "--pictures", tmp_path)
    assert "focal_x [px]" in said
    assert "Skipped nothing.png" in said
    assert "lower than said" in said
    # Three pictures are too few to fit without a fourth.
    assert "left out" not in said


def test_a_file_goes_from_program_to_program(tmp_path):
    (tmp_path / "camera.json").write_text("{")
    kalibr = tmp_path / "camchain.yaml"
    kalibr.write_text(
        "cam0:\n  camera_model: omni\n  intrinsics: [0.9, 130, 130, 244, 176]\n"
        "  distortion_model: radtan\n  distortion_coeffs: [0.1, 0, 0, 0]\n"
        "  resolution: [480, 360]\n"
    )
    target = tmp_path / "opencv.yaml"
    assert "MeiCamera" in invoke("convert", kalibr, target, "--format", "opencv")
    assert load_camera_model(target) == replace(TRUTH, k1=0.1)
    with pytest.raises(InvalidInput, match="must be a Scaramuzza camera in the form ocamcalib"):
        invoke("convert", kalibr, tmp_path / "calib_results.txt", "--format", "ocamcalib")
    with pytest.raises(InvalidInput, match="`camera` must be readable JSON"):
        invoke("convert", tmp_path / "camera.json", target)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--board", "6by4"], "`--board` must have the form 11x7; got 6by4"),
        (["--board", "6x4", "--square", "3cm"], "`--square` must be 0.03 or 0.03x0.031; got 3cm"),
        (["--board", "6x4"], "`pictures` must be a folder; got None"),
    ],
)
def test_what_is_wrong_with_a_board_is_said(words, message):
    with pytest.raises(InvalidInput) as refused:
        invoke("calibrate", *words)
    assert str(refused.value) == message
