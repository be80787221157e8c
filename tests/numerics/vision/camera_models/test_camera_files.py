"""Files of other programs are read as those programs mean them, and come back as they were."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.camera_models.camera_files import (
    FORMS,
    forms_of,
    load_camera_model,
    save_camera_model,
)
from sightfield.systems.numerics.vision.camera_models.central_cameras import MeiCamera

OCAM = """#polynomial coefficients for the DIRECT mapping function

4 -150.0 0.0 2.5e-03 -1.0e-06

#polynomial coefficients for the inverse mapping function

3 200.0 120.0 5.0

#center: "row" and "column", starting from 0 (C convention)

239.5 320.25

#affine parameters "c", "d", "e"

0.999 -0.002 0.003

#image size: "height" and "width"

480 640
"""
OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 250., 0.5, 321., 0., 251., 239., 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 4
   dt: d
   data: [ -0.1, 0.02, 0.001, -0.002 ]
MARK
"""
KALIBR = """cam0:
  cam_overlaps: []
  camera_model: omni
  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]
  distortion_model: radtan
  intrinsics: [0.9, 250.0, 251.0, 321.0, 239.0]
  resolution: [640, 480]
  rostopic: /cam0/image_raw
"""
MEI = MeiCamera(
    xi=0.9,
    focal_x=250.0,
    focal_y=251.0,
    centre_x=321.0,
    centre_y=239.0,
    k1=-0.1,
    k2=0.02,
    p1=0.001,
    p2=-0.002,
    width=640,
    height=480,
)


def read(text, tmp_path):
    file = tmp_path / "camera"
    file.write_text(text, encoding="utf-8")
    return load_camera_model(file)


def exportable(camera):
    """The same camera without what files of other programs have no place for."""
    zeros = {name: 0.0 for name in ("skew",) if hasattr(camera, name)}
    if isinstance(camera, MeiCamera):
        zeros["k3"] = 0.0
    return replace(camera, **zeros)


def test_every_form_gives_back_the_camera_that_was_written(camera, tmp_path):
    held = forms_of(exportable(camera))
    assert len(held) >= 2
    for form in held:
        save_camera_model(tmp_path / form, exportable(camera), form)
        assert load_camera_model(tmp_path / form) == exportable(camera)
    save_camera_model(tmp_path / "ours", camera, "sightfield")
    assert load_camera_model(tmp_path / "ours") == camera


def test_all_forms_are_tried(cameras):
    assert set().union(*(forms_of(exportable(each)) for each in cameras.values())) == set(FORMS)
    assert forms_of(cameras["mei"]) == ("sightfield",)


def test_ocamcalib_projects_with_the_second_polynomial_to_where_we_do(cameras, tmp_path):
    camera = cameras["scaramuzza"]
    save_camera_model(tmp_path / "calib_results.txt", camera, "ocamcalib")
    text = (tmp_path / "calib_results.txt").read_text(encoding="utf-8")
    lines = [line.split() for line in text.splitlines() if line and line[0] != "#"]
    inverse = [float(word) for word in lines[1]][1:]
    (row, column), (c, d, e) = ([float(word) for word in line] for line in lines[2:4])
    pixels = np.stack(np.meshgrid(np.linspace(0, 639, 21), np.linspace(0, 479, 21)), -1)
    pixels = pixels.reshape(-1, 2)
    # As world2cam does it, in OCamCalib's frame.
    for pixel, (right, down, ahead) in zip(pixels, camera.rays(pixels), strict=True):
        x, y, z = down, right, -ahead
        across = math.hypot(x, y)
        theta = math.atan(z / across)
        rho = sum(a * theta**n for n, a in enumerate(inverse))
        x, y = x / across * rho, y / across * rho
        theirs = (x * e + y + column, x * c + y * d + row)
        assert math.dist(theirs, pixel) < 0.05


def test_a_file_of_ocamcalib_is_read_row_first(tmp_path):
    camera = read(OCAM, tmp_path)
    assert camera.polynomial == (-150.0, 0.0, 2.5e-3, -1e-6)
    assert (camera.centre_x, camera.centre_y) == (320.25, 239.5)
    assert (camera.c, camera.d, camera.e) == (0.999, -0.002, 0.003)
    assert (camera.width, camera.height) == (640, 480)


def test_files_of_opencv_and_kalibr_are_one_camera(tmp_path):
    assert read(KALIBR, tmp_path) == MEI
    assert read(OPENCV.replace("MARK", "xi: 0.9"), tmp_path) == replace(MEI, skew=0.5)
    matrix = "xi: !!opencv-matrix\n   rows: 1\n   cols: 1\n   dt: d\n   data: [ 0.9 ]"
    assert read(OPENCV.replace("MARK", matrix), tmp_path) == replace(MEI, skew=0.5)


def test_fisheyes_of_opencv_and_kalibr_are_one_camera(tmp_path):
    theirs = read(OPENCV.replace("MARK", "fisheye_model: 1"), tmp_path)
    text = KALIBR.replace("omni", "pinhole").replace("radtan", "equidistant")
    assert read(text.replace("0.9, 250", "250"), tmp_path) == replace(theirs, skew=0.0)
    assert (theirs.k1, theirs.k4) == (-0.1, -0.002)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nothing of the kind", "`camera` must be a calib_results.txt of OCamCalib, or"),
        (OCAM.replace("4 -150", "5 -150"), "`camera` must be a calib_results.txt of OCamCalib"),
        (OCAM.replace("-150.0", "150.0"), "`polynomial` must begin with a_0 < 0; got 150.0"),
        (OPENCV.replace("MARK", ""), "`camera` must say `xi` (omnidir) or `fisheye_model: 1`"),
        (
            OPENCV.replace("camera_m", "m").replace("MARK", "xi: 1.0"),
            "`camera.camera_matrix` must be a matrix of 9",
        ),
        (OPENCV.replace("MARK", "xi: ["), "`camera` must be a YAML file of OpenCV"),
        (KALIBR.replace("omni", "ds"), "`camera.cam0` must be one of omni-radtan, omni-none, pin"),
        (KALIBR.replace("[0.9, ", "["), "`camera.cam0.intrinsics` must be 5 numbers; got [250.0"),
        (KALIBR.replace("cam0", "cam1", 1), "`camera` must have a camera `cam0`"),
        (KALIBR.replace("[640, 480]", "[640, ["), "`camera` must be a camchain.yaml of Kalibr"),
        ("{", "`camera` must be readable JSON"),
        ('{"a":' * 100_000, "`camera` must be readable JSON"),
        (OCAM.replace("480 640", "nan 640"), "`camera` must be of a whole number of pixels; got"),
        (OCAM.replace("480 640", "480.5 640"), "`camera` must be of a whole number of pixels; got"),
        (OCAM.replace("4 -150", "nan -150"), "`camera` must be a calib_results.txt of OCamCalib"),
        (OCAM.replace("480 640", "1e300 640"), "`width * height` must be at most 50,000,000"),
        (OCAM.replace("0.999 ", "-0.999 "), "`c, d, e` must stretch a picture; got (-0"),
        ("{}", '`camera` must be of the format "sightfield camera model"'),
    ],
)
def test_what_is_wrong_with_a_file_is_said_in_one_line(text, message, tmp_path):
    with pytest.raises(InvalidInput) as refused:
        read(text, tmp_path)
    assert str(refused.value).startswith(message)
    assert "\n" not in str(refused.value)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InvalidInput, match="`camera` must be readable; got"):
        load_camera_model(tmp_path / "none.txt")


def test_a_place_that_cannot_be_written_is_named(cameras, tmp_path):
    for place in (tmp_path, tmp_path / "no" / "file"):
        with pytest.raises(InvalidInput, match="`target` must be a file that can be written; got"):
            save_camera_model(place, cameras["mei"], "sightfield")


@pytest.mark.parametrize(
    ("model", "form", "message"),
    [
        ("mei", "ocamcalib", "`camera` must be a Scaramuzza camera in the form ocamcalib; got Mei"),
        ("mei", "opencv", "`k3` must be 0 in a file of the form opencv; got -0.0004"),
        ("kannala_brandt", "kalibr", "`skew` must be 0 in a file of Kalibr; got -0.4"),
        ("scaramuzza", "kalibr", "`camera` must be a Mei or Kannala-Brandt camera in the form"),
        ("mei", "matlab", "`form` must be one of sightfield, ocamcalib, opencv, kalibr; got mat"),
    ],
)
def test_a_form_that_has_no_place_for_a_camera_refuses_it(cameras, model, form, message, tmp_path):
    with pytest.raises(InvalidInput) as refused:
        save_camera_model(tmp_path / "file", cameras[model], form)
    assert str(refused.value).startswith(message)
    assert not (tmp_path / "file").exists()
