"""`sightfield camera` calibrates, takes pictures and reads them, and names what is wrong."""

import json
import math

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from sightfield.diagrams.commands import camera_calibrate
from sightfield.diagrams.commands.camera import camera
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.calibration import load_calibration


def invoke(*arguments, code=0):
    """Run a command; errors come through as exceptions."""
    result = CliRunner().invoke(camera, [str(each) for each in arguments])
    if isinstance(result.exception, Exception):
        raise result.exception
    assert result.exit_code == code, result.output
    return result.stdout


def report(*arguments, code=0):
    """Run a command and return what it says as JSON."""
    return json.loads(invoke(*arguments, "--json", code=code))


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    """Folder of a simulated calibration, and its report."""
    folder = tmp_path_factory.mktemp("camera") / "new" / "calibration"
    return folder, report("calibrate", "--directions", 3, "--out", folder)


@pytest.fixture(scope="module")
def taken(tmp_path_factory):
    """Folder of a picture with a red and a green shell, and its report."""
    folder = tmp_path_factory.mktemp("picture")
    shells = ("--shell", "red:1.6:1.3", "--shell", "green:0.2:0.9")
    return folder, report("render", *shells, "--pose", 1, 1, 0.5, "--out", folder)


def estimate(calibrated, picture, *arguments, code=0):
    """Report of `estimate` with the simulated calibration."""
    calibration = calibrated[0] / "calibration.json"
    return report("estimate", picture, "--calibration", calibration, *arguments, code=code)


def test_a_calibration_leaves_its_file_its_report_and_its_plots(calibrated):
    folder, found = calibrated
    names = {"calibration.json", "summary.json", "error_curves.png", "direction_spread.png"}
    assert {file.name for file in folder.glob("[!.]*")} == names
    assert json.loads((folder / "summary.json").read_text()) == found
    for name in ("error_curves.png", "direction_spread.png"):
        picture = cv2.imread(str(folder / name))
        assert picture is not None
        assert picture.std() > 10
    assert load_calibration(folder / "calibration.json").k == found["k"]


def test_it_finds_the_k_and_h_that_the_optics_imply(calibrated):
    _, found = calibrated
    assert found["k"] == pytest.approx(found["implied"]["k"], rel=5e-3)
    assert found["height"] == pytest.approx(found["implied"]["height"], abs=4e-3)
    assert found["error_ratio"] > 5
    assert (found["pictures"], found["skipped"]) == (30, [])


def test_a_folder_of_pictures_is_calibrated_as_the_simulation_is(calibrated, tmp_path):
    said = report(
        "render", "--practice", "--directions", 3, "--shell", "red:1:0", "--out", tmp_path
    )
    assert said == {"pictures": 30, "table": "shells.csv"}
    found = report("calibrate", "--pictures", tmp_path)
    assert found["implied"] is None
    for key in ("k", "height", "parabola", "models"):
        assert found[key] == calibrated[1][key]


def test_rendered_shells_are_estimated_where_they_are(calibrated, taken):
    folder, said = taken
    found = estimate(
        calibrated,
        folder / "picture.png",
        "--colour",
        "red",
        "--colour",
        "green",
        "--pose",
        1,
        1,
        0.5,
    )
    for true, seen in zip(said["shells"], found["shells"], strict=True):
        assert (seen["colour"], seen["outcome"], seen["valid"]) == (true["colour"], "seen", True)
        assert abs(seen["range"] - true["range"]) < 4 * seen["range_std"] < 0.1
        assert abs(seen["bearing"] - true["bearing"]) < 4 * seen["bearing_std"]
        assert seen["position"] == pytest.approx(true["position"], abs=0.04)


def test_a_colour_that_is_not_in_the_picture_gives_no_estimate(calibrated, taken):
    picture = taken[0] / "picture.png"
    (blue,) = estimate(calibrated, picture, "--colour", "blue", code=1)["shells"]
    # One of two is not all that was asked for.
    estimate(calibrated, picture, "--colour", "red", "--colour", "blue", code=1)
    assert (blue["outcome"], blue["valid"]) == ("no blob", False)
    assert {blue[key] for key in ("range", "bearing", "range_std", "pixel_radius")} == {None}
    assert blue["position"] is blue["covariance"] is None


def test_an_estimate_is_drawn_and_said(calibrated, taken, tmp_path):
    said = invoke(
        *("estimate", taken[0] / "picture.png", "--colour", "red", "--colour", "magenta"),
        *("--calibration", calibrated[0] / "calibration.json", "--out", tmp_path),
        code=1,
    )
    assert "no estimate" in said
    assert "range to near side [m]" in said
    assert {file.name for file in tmp_path.glob("[!.]*")} == {"estimate.png", "summary.json"}
    assert cv2.imread(str(tmp_path / "estimate.png")) is not None


def test_the_thesis_model_can_be_asked_for(calibrated, taken):
    exact, thesis = (
        estimate(calibrated, taken[0] / "picture.png", "--model", model)
        for model in ("exact", "thesis")
    )
    assert thesis["model"] == "thesis"
    assert thesis["shells"][0]["range"] != exact["shells"][0]["range"]
    assert thesis["shells"][0]["range_std"] > exact["shells"][0]["range_std"]


def test_another_camera_is_described_in_a_file(tmp_path):
    optics = tmp_path / "camera.yaml"
    optics.write_text("width: 320\nheight: 240\nfocal_length: 430\n")
    folder = tmp_path / "out"
    report("render", "--camera", optics, "--out", folder)
    assert cv2.imread(str(folder / "picture.png")).shape == (240, 320, 3)


def test_a_world_s_walls_are_in_the_picture(tmp_path):
    walls = tmp_path / "world.wkt"
    walls.write_text(
        "POLYGON((0 0, 3 0, 3 2, 0 2, 0 0), (1.2 0.8, 1.5 0.8, 1.5 1.2, 1.2 1.2, 1.2 0.8))"
    )
    report(
        "render", "--world", walls, "--pose", 0.6, 1, 0, "--shell", "red:2.2:1", "--out", tmp_path
    )
    picture = cv2.imread(str(tmp_path / "picture.png"))
    # The block hides the shell behind it.
    blue, green, red = np.moveaxis(picture.astype(int), 2, 0)
    assert not np.any((red > 100) & (green < 60) & (blue < 60))


@pytest.fixture
def nonsense(tmp_path, taken):
    """A function of a kind of nonsense: its file."""
    whole = (taken[0] / "picture.png").read_bytes()
    pictures = {
        "black": np.zeros((480, 640, 3), np.uint8),
        "small": np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8),
        "deep": np.random.default_rng(0).integers(0, 60000, (480, 640, 3), np.uint16),
        "grey": np.random.default_rng(0).integers(0, 255, (480, 640), np.uint8),
    }

    def make(kind):
        path = tmp_path / f"{kind}.png"
        if kind in pictures:
            cv2.imwrite(str(path), pictures[kind])
        elif kind == "cut":
            path.write_bytes(whole[: len(whole) // 2])
        elif kind == "text":
            path.write_text("hello")
        return path

    return make


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        ("black", r"`picture` must show something; got one colour, \[0, 0, 0\]"),
        ("small", "`picture` must be 640 x 480 pixels; got 64 x 48"),
        ("deep", "`picture` must hold 8-bit values .uint8.; got uint16"),
        ("grey", r"`picture` must have colours; got .*grey\.png"),
        ("cut", r"`picture` must be a whole PNG or JPEG file; got .*cut\.png"),
        ("text", r"`picture` must be a whole PNG or JPEG file; got .*text\.png"),
        ("missing", r"`picture` must be readable; got .*missing\.png"),
    ],
)
def test_nonsense_pictures_are_named_in_one_line(calibrated, nonsense, tmp_path, kind, message):
    with pytest.raises(InvalidInput, match=message) as caught:
        estimate(calibrated, nonsense(kind), "--out", tmp_path / "never")
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "never").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--colour", "mauve"), "`colour` must be one of red, .*; got mauve"),
        (("--colour", "red", "--colour", "red"), "`colours` must differ from each other"),
        (("--model", "best"), "`model` must be one of thesis, exact; got best"),
        (("--pose", "nan", "0", "0"), "`pose` must be finite"),
    ],
)
def test_bad_questions_are_named(calibrated, taken, arguments, message):
    with pytest.raises(InvalidInput, match=message):
        estimate(calibrated, taken[0] / "picture.png", *arguments)


def test_a_calibration_without_a_key_is_named(calibrated, taken, tmp_path):
    tree = json.loads((calibrated[0] / "calibration.json").read_text())
    del tree["k"]
    broken = tmp_path / "broken.json"
    broken.write_text(json.dumps(tree))
    with pytest.raises(InvalidInput, match=r"`calibration` must have the keys .*; got no k"):
        report("estimate", taken[0] / "picture.png", "--calibration", broken)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[" * 100_000, "`calibration` must be readable JSON"),
        (None, "`calibration` must be a file; got /dev/zero"),
    ],
)
def test_a_calibration_without_an_end_is_not_read(taken, tmp_path, text, message):
    path = "/dev/zero"
    if text is not None:
        path = tmp_path / "deep.json"
        path.write_text(text)
    with pytest.raises(InvalidInput, match=message):
        report("estimate", taken[0] / "picture.png", "--calibration", path)


@pytest.mark.parametrize("keys", [("height",), ("readings", "distance", 0)])
def test_a_calibration_with_endless_numbers_is_refused(calibrated, taken, tmp_path, keys):
    tree = json.loads((calibrated[0] / "calibration.json").read_text())
    node = tree
    for key in keys[:-1]:
        node = node[key]
    node[keys[-1]] = 1e300
    broken = tmp_path / "broken.json"
    broken.write_text(json.dumps(tree))
    with pytest.raises(InvalidInput, match=f"`.*{keys[min(1, len(keys) - 1)]}` must be"):
        report("estimate", taken[0] / "picture.png", "--calibration", broken)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--colour", "mauve"), "`colour` must be one of"),
        (("--directions", 0), "`directions` must be positive; got 0"),
        (("--directions", 10**9), "`directions` must be at most 1080; got 1000000000"),
        (("--height", 1e300, "--directions", 2), "`height` must be of a size from"),
        (("--noise", -1), "`noise` must be zero or positive; got -1.0"),
        (("--height", -1), "`height` must be positive; got -1.0"),
        (("--top", 0.01), "`top` must be above the base"),
        (("--pictures", "nowhere"), "`pictures` must be a folder; got nowhere"),
        (("--camera", "nowhere.yaml"), "`camera` must be a YAML file; got nowhere.yaml"),
    ],
)
def test_bad_calibrations_are_named_before_any_picture_is_taken(
    tmp_path, monkeypatch, arguments, message
):
    monkeypatch.delattr(camera_calibrate, "read_pictures")
    with pytest.raises(InvalidInput, match=message):
        invoke("calibrate", *arguments, "--out", tmp_path / "never")
    assert not (tmp_path / "never").exists()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mirror_radius: -1\n", "`mirror_radius` must be positive; got -1"),
        ("mirror_radius: 1.0e300\n", "`mirror_radius` must be of a size from 1e-18 to"),
        ("focal_length: 1.0e-300\n", "`focal_length` must be of a size from 1e-18 to"),
        ("centre: [1.0e300, 0]\n", r"`centre` must be at most 1e\+06 px from the picture"),
        (
            "width: 10000000\n",
            r"`width \* height` must be at most 50,000,000 pixels; got 4800000000",
        ),
        ("zoom: 2\n", "`zoom` must be a key"),
        ("focal_length: long\n", "`focal_length` must be a valid number"),
        ("[1, 2\n", "must be readable YAML"),
    ],
)
def test_a_camera_file_that_makes_no_sense_is_named(tmp_path, text, message):
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    with pytest.raises(InvalidInput, match=message):
        invoke("calibrate", "--camera", path)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--shell", "mauve:1:0"), "`colour` must be one of .*; got 'mauve'"),
        (("--shell", "red:1"), "`--shell` must have the form COLOUR:X:Y; got red:1"),
        (("--shell", "red:far:0"), "`--shell` must have the form COLOUR:X:Y; got red:far:0"),
        (("--shell", "red:nan:0"), "`--shell` must have a finite place; got red:nan:0"),
        (("--pose", "inf", 0, 0), "`pose` must be finite"),
        (("--blur", -1), "`blur` must be zero or positive"),
        (("--wall-height", 0), "`wall_height` must be positive"),
    ],
)
def test_bad_scenes_are_named(tmp_path, arguments, message):
    with pytest.raises(InvalidInput, match=message):
        invoke("render", *arguments, "--out", tmp_path / "never")
    assert not (tmp_path / "never").exists()


def test_a_pose_inside_a_wall_is_refused(tmp_path):
    walls = tmp_path / "world.wkt"
    walls.write_text("POLYGON((0 0, 3 0, 3 2, 0 2, 0 0))")
    with pytest.raises(InvalidInput, match="`pose` must be in the free region of the world"):
        invoke("render", "--world", walls, "--pose", 5, 1, 0, "--out", tmp_path / "never")


def test_bearings_in_reports_are_wrapped(tmp_path):
    said = report("render", "--shell", "red:-1:-0.1", "--pose", 0, 0, 3, "--out", tmp_path)
    (shell,) = said["shells"]
    assert shell["bearing"] == pytest.approx(math.atan2(-0.1, -1) - 3 + 2 * math.pi)


def test_where_nobody_watches_a_calibration_says_its_report_alone(sightfield_here):
    done = sightfield_here("camera", "calibrate", "--directions", 2)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("k = ")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("track", "--seeds", 4), "`seeds` must come with sweep; got 4"),
        (("track", "--sweep", "0,1", "--meshcat"), "`meshcat` must be left out with sweep; got"),
        (("render", "--directions", 4), "`directions` must come with practice; got 4"),
        (("render", "--practice", "--wall-height", 1), "`wall_height` must be left out with"),
        (("calibrate", "--model", "mei"), "`model` must come with board; got mei"),
        (("calibrate", "--board", "6x4", "--noise", 1), "`noise` must be left out with board"),
        (("calibrate", "--pictures", ".", "--seed", 1), "`seed` must be left out with pictures"),
    ],
    ids=lambda part: " ".join(map(str, part)) if isinstance(part, tuple) else "",
)
def test_an_option_that_would_change_nothing_is_refused(words, says, sightfield_here, tmp_path):
    out = ("--out", tmp_path / "out")
    done = sightfield_here("camera", *words, *out)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {says}")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("place", ["0:0", "0.1:0", "-0.12:0.05"])
def test_a_shell_on_the_camera_is_refused(place, sightfield_here, tmp_path):
    out = ("--out", tmp_path / "out")
    done = sightfield_here("camera", "render", "--shell", f"red:{place}", *out)
    assert done.returncode == 2
    line = "error: `--shell` must stand clear of the camera and its mirror; got red:"
    assert done.stderr == f"{line}{place}\n"
    assert not (tmp_path / "out").exists()


def test_shells_stand_clear_of_one_another(tmp_path):
    shells = ("--shell", "red:0.7:0.3", "--shell", "green:0.75:0.3")
    result = CliRunner().invoke(camera, ["render", *shells, "--out", str(tmp_path / "new")])
    assert "`--shell` must stand clear of the other shells; got green" in str(result.exception)
