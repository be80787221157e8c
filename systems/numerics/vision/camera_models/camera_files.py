"""Cameras in the files of other programs, and in one of ours that holds every model exactly.

| form | file | models |
| --- | --- | --- |
| `ocamcalib` | `calib_results.txt` of OCamCalib | Scaramuzza |
| `opencv` | YAML of OpenCV's `omnidir` (with `xi`), `fisheye` (`fisheye_model: 1`) | both others |
| `kalibr` | `camchain.yaml`, `cam0`: `omni-radtan`, `pinhole-equidistant` | both others |
| `sightfield` | JSON | all |

Numbers are written so that they come back to the last bit. OCamCalib's second polynomial, from
angles to radii, is approximate by nature: it is fitted anew when written, and not used when read.
"""

import json
import math
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml

from ...errors import InvalidInput, require, require_one_of
from ...files import read_input, read_yaml
from .camera_model import CameraModel
from .central_cameras import KannalaBrandtCamera, MeiCamera, ScaramuzzaCamera

FORMAT, VERSION = "sightfield camera model", 1
_MODELS = {"scaramuzza": ScaramuzzaCamera, "mei": MeiCamera, "kannala_brandt": KannalaBrandtCamera}
# Of OCamCalib's second polynomial: degrees that are tried, and how near it is to come [px].
_INVERSE_DEGREES, _INVERSE_NEAR = range(6, 21), 0.01


def load_camera_model(path: str | Path) -> CameraModel:
    """Read a camera from a file of any of the forms, told by what is in it.

    Args:
        path: Of the file.

    Raises:
        InvalidInput: No such file, no form that is known, or numbers that are no camera.
    """
    path = Path(path)
    try:
        text = read_input("camera", path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise InvalidInput(f"`camera` must be a file of text; got {path} ({error})") from None
    if text.lstrip().startswith("{"):
        return _from_json(text, path)
    if text.startswith("%YAML"):
        return _from_opencv(text, path)
    if "camera_model" in text:
        return _from_kalibr(text, path)
    return _from_ocamcalib(text, path)


def save_camera_model(path: str | Path, camera: CameraModel, form: str) -> None:
    """Write a camera.

    Args:
        path: Of the file.
        camera: Which.
        form: One of FORMS.

    Raises:
        InvalidInput: Another form, one that does not hold this camera, or no place to write to.
    """
    require_one_of("form", form, FORMS)
    text = _WRITERS[form](camera)
    try:
        Path(path).write_text(text, encoding="utf-8")
    except OSError as error:
        reason = f"{path} ({error.strerror})"
        raise InvalidInput(f"`target` must be a file that can be written; got {reason}") from None


def forms_of(camera: CameraModel) -> tuple[str, ...]:
    """The forms of FORMS that hold a camera."""
    held = []
    for form, write in _WRITERS.items():
        try:
            write(camera)
        except InvalidInput:
            continue
        held.append(form)
    return tuple(held)


def inverse_polynomial(camera: ScaramuzzaCamera) -> np.ndarray:
    """OCamCalib's polynomial from angles to radii, of the least degree that is near enough.

    Args:
        camera: Whose.

    Returns:
        Coefficients of the powers 0, 1, ... of the angle above the horizon, -pi / 2 on the axis,
        in px/rad^n, shape (n,).
    """
    # Denser at both ends, as Chebyshev's points, where polynomials go astray.
    radius = 0.5 * camera.rim * (1 - np.cos(np.linspace(0, math.pi, 400)))
    depth = -np.polynomial.polynomial.polyval(radius, camera.polynomial)
    angle = np.arctan2(-depth, radius)
    fit = np.polynomial.Polynomial.fit(angle, radius, _INVERSE_DEGREES[0])
    for degree in _INVERSE_DEGREES:
        fit = np.polynomial.Polynomial.fit(angle, radius, degree)
        if np.abs(fit(angle) - radius).max() < _INVERSE_NEAR:
            break
    return fit.convert().coef


def _to_ocamcalib(camera: CameraModel) -> str:
    if not isinstance(camera, ScaramuzzaCamera):
        raise _no_place("ocamcalib", "a Scaramuzza camera", camera)

    def line(values: Any) -> str:
        return " ".join(repr(float(value)) for value in values)

    inverse = inverse_polynomial(camera)
    return (
        "#polynomial coefficients for the DIRECT mapping function (ocam_model.ss in MATLAB)."
        " These are used by cam2world\n\n"
        f"{len(camera.polynomial)} {line(camera.polynomial)}\n\n"
        "#polynomial coefficients for the inverse mapping function (ocam_model.invpol in MATLAB)."
        " These are used by world2cam\n\n"
        f"{len(inverse)} {line(inverse)}\n\n"
        '#center: "row" and "column", starting from 0 (C convention)\n\n'
        f"{line([camera.centre_y, camera.centre_x])}\n\n"
        '#affine parameters "c", "d", "e"\n\n'
        f"{line([camera.c, camera.d, camera.e])}\n\n"
        '#image size: "height" and "width"\n\n'
        f"{camera.height} {camera.width}\n"
    )


def _from_ocamcalib(text: str, path: Path) -> CameraModel:
    lines = [line.split() for line in text.splitlines() if line.strip() and line[0] != "#"]
    form = "be a calib_results.txt of OCamCalib, or a file of OpenCV, Kalibr or Sightfield"
    try:
        direct, inverse, centre, stretch, size = ([float(word) for word in line] for line in lines)
    except ValueError:
        raise InvalidInput(f"`camera` must {form}; got {path}") from None
    counts = [len(each) for each in (direct, inverse, centre, stretch, size)]
    whole = counts == [direct[0] + 1, inverse[0] + 1, 2, 3, 2]
    require(whole, "camera", form, path)
    return ScaramuzzaCamera(
        polynomial=tuple(direct[1:]),
        centre_x=centre[1],
        centre_y=centre[0],
        c=stretch[0],
        d=stretch[1],
        e=stretch[2],
        height=_pixels(size[0]),
        width=_pixels(size[1]),
    )


def _to_opencv(camera: CameraModel) -> str:
    store = cv2.FileStorage(".yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
    if isinstance(camera, MeiCamera):
        _require_no_k3(camera, "opencv")
        distortion = [camera.k1, camera.k2, camera.p1, camera.p2]
    elif isinstance(camera, KannalaBrandtCamera):
        distortion = [camera.k1, camera.k2, camera.k3, camera.k4]
        store.write("fisheye_model", 1)
    else:
        raise _no_place("opencv", "a Mei or Kannala-Brandt camera", camera)
    store.write("image_width", camera.width)
    store.write("image_height", camera.height)
    store.write("camera_matrix", camera.matrix)
    store.write("distortion_coefficients", np.array([distortion]))
    if isinstance(camera, MeiCamera):
        store.write("xi", camera.xi)
    return store.releaseAndGetString()


def _from_opencv(text: str, path: Path) -> CameraModel:
    try:
        store = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    except (cv2.error, SystemError):
        raise InvalidInput(f"`camera` must be a YAML file of OpenCV; got {path}") from None
    width, height = (_pixels(store.getNode(f"image_{side}").real()) for side in ("width", "height"))
    matrix = _opencv_matrix(store, "camera_matrix", 9).reshape(3, 3)
    distortion = _opencv_matrix(store, "distortion_coefficients", 4).tolist()
    grid = {
        "focal_x": float(matrix[0, 0]),
        "focal_y": float(matrix[1, 1]),
        "skew": float(matrix[0, 1]),
        "centre_x": float(matrix[0, 2]),
        "centre_y": float(matrix[1, 2]),
        "width": width,
        "height": height,
    }
    xi = store.getNode("xi")
    if not xi.empty():
        value = float(xi.mat().ravel()[0]) if xi.isMap() else xi.real()
        k1, k2, p1, p2 = distortion
        return MeiCamera(xi=value, k1=k1, k2=k2, p1=p1, p2=p2, **grid)
    fisheye = store.getNode("fisheye_model")
    marked = not fisheye.empty() and fisheye.real() == 1
    require(marked, "camera", "say `xi` (omnidir) or `fisheye_model: 1` (fisheye)", path)
    return KannalaBrandtCamera(
        **dict(zip(("k1", "k2", "k3", "k4"), distortion, strict=True)), **grid
    )


def _opencv_matrix(store: cv2.FileStorage, name: str, size: int) -> np.ndarray:
    node = store.getNode(name)
    values = node.mat() if node.isMap() else None
    got = 0 if values is None else values.size
    require(got == size, f"camera.{name}", f"be a matrix of {size} numbers", got)
    return np.asarray(values, dtype=float).ravel()


def _to_kalibr(camera: CameraModel) -> str:
    if isinstance(camera, MeiCamera):
        _require_no_k3(camera, "kalibr")
        kind, head, lens = "omni", [camera.xi], "radtan"
        distortion = [camera.k1, camera.k2, camera.p1, camera.p2]
    elif isinstance(camera, KannalaBrandtCamera):
        kind, head, lens = "pinhole", [], "equidistant"
        distortion = [camera.k1, camera.k2, camera.k3, camera.k4]
    else:
        raise _no_place("kalibr", "a Mei or Kannala-Brandt camera", camera)
    require(camera.skew == 0, "skew", "be 0 in a file of Kalibr", camera.skew)
    focal = [camera.focal_x, camera.focal_y, camera.centre_x, camera.centre_y]
    tree = {
        "camera_model": kind,
        "intrinsics": [float(value) for value in [*head, *focal]],
        "distortion_model": lens,
        "distortion_coeffs": [float(value) for value in distortion],
        "resolution": [camera.width, camera.height],
    }
    return yaml.safe_dump({"cam0": tree}, sort_keys=False)


def _from_kalibr(text: str, path: Path) -> CameraModel:
    try:
        tree = read_yaml(text)
    except yaml.YAMLError:
        raise InvalidInput(f"`camera` must be a camchain.yaml of Kalibr; got {path}") from None
    node = tree.get("cam0") if isinstance(tree, dict) else None
    if not isinstance(node, dict):
        raise InvalidInput(f"`camera` must have a camera `cam0`, as Kalibr writes; got {path}")
    kind = (str(node.get("camera_model")), str(node.get("distortion_model")))
    known = {("omni", "radtan"): 5, ("omni", "none"): 5, ("pinhole", "equidistant"): 4}
    forms = ", ".join("-".join(each) for each in known)
    require(kind in known, "camera.cam0", f"be one of {forms}", "-".join(kind))
    numbers = _numbers("camera.cam0.intrinsics", node.get("intrinsics"), known[kind])
    distortion = [0.0] * 4
    if kind[1] != "none":
        distortion = _numbers("camera.cam0.distortion_coeffs", node.get("distortion_coeffs"), 4)
    width, height = _numbers("camera.cam0.resolution", node.get("resolution"), 2)
    names = ("focal_x", "focal_y", "centre_x", "centre_y")
    grid: dict[str, Any] = dict(zip(names, numbers[-4:], strict=True))
    grid |= {"width": _pixels(width), "height": _pixels(height)}
    if kind[0] == "omni":
        k1, k2, p1, p2 = distortion
        return MeiCamera(xi=numbers[0], k1=k1, k2=k2, p1=p1, p2=p2, **grid)
    return KannalaBrandtCamera(
        **dict(zip(("k1", "k2", "k3", "k4"), distortion, strict=True)), **grid
    )


def _to_json(camera: CameraModel) -> str:
    if not isinstance(camera, (ScaramuzzaCamera, MeiCamera, KannalaBrandtCamera)):
        raise _no_place("sightfield", f"a camera of {', '.join(_MODELS)}", camera)
    (name,) = (name for name, kind in _MODELS.items() if isinstance(camera, kind))
    tree = {"format": FORMAT, "version": VERSION, "model": name, **asdict(camera)}
    return json.dumps(tree, indent=1) + "\n"


def _from_json(text: str, path: Path) -> CameraModel:
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError):
        raise InvalidInput(f"`camera` must be readable JSON; got {path}") from None
    require(tree.pop("format", None) == FORMAT, "camera", f'be of the format "{FORMAT}"', path)
    version, model = tree.pop("version", None), tree.pop("model", None)
    require(version == VERSION, "camera.version", f"be {VERSION}", version)
    require_one_of("camera.model", model, _MODELS)
    kind = _MODELS[model]
    names = {field.name for field in fields(kind)}
    require(set(tree) == names, "camera", f"have the keys {', '.join(sorted(names))}", path)
    if kind is ScaramuzzaCamera:
        polynomial = tree["polynomial"]
        require(isinstance(polynomial, list), "camera.polynomial", "be a list", polynomial)
        tree["polynomial"] = tuple(polynomial)
    return kind(**tree)


def _numbers(name: str, values: object, count: int) -> list[float]:
    listed = values if isinstance(values, list) else []
    fine = len(listed) == count and all(isinstance(each, (int, float)) for each in listed)
    require(fine, name, f"be {count} numbers", values)
    return [float(each) for each in listed]


def _pixels(value: float) -> int:
    """A width or a height, which some forms write as 640.0."""
    require(float(value).is_integer(), "camera", "be of a whole number of pixels", value)
    return int(value)


def _require_no_k3(camera: MeiCamera, form: str) -> None:
    require(camera.k3 == 0, "k3", f"be 0 in a file of the form {form}", camera.k3)


def _no_place(form: str, wish: str, camera: CameraModel) -> InvalidInput:
    return InvalidInput(f"`camera` must be {wish} in the form {form}; got {type(camera).__name__}")


_WRITERS: dict[str, Callable[[CameraModel], str]] = {
    "sightfield": _to_json,
    "ocamcalib": _to_ocamcalib,
    "opencv": _to_opencv,
    "kalibr": _to_kalibr,
}
FORMS = tuple(_WRITERS)
