"""Calibrations as files: JSON in SI units, with the readings they were made from."""

import json
import math
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import InvalidInput, require
from ..omni_optics import OmniCamera
from .calibration import Calibration
from .readings import Readings

FORMAT, VERSION = "sightfield camera calibration", 1
_NUMBERS = ("base", "shell_radius", "shell_top", "height", "k", "k_spread")
_KEYS = ("format", "version", "camera", *_NUMBERS, "parabola", "readings")
_CAMERA_KEYS = tuple(field.name for field in fields(OmniCamera))
_READING_KEYS = tuple(field.name for field in fields(Readings))


def save_calibration(path: Path, calibration: Calibration) -> None:
    """Write a calibration, for `load_calibration`."""
    tree = {
        "format": FORMAT,
        "version": VERSION,
        "camera": asdict(calibration.camera) | {"centre": calibration.camera.axis_pixel.tolist()},
        **{key: getattr(calibration, key) for key in _NUMBERS},
        "parabola": dict(zip("abc", calibration.parabola, strict=True)),
        "readings": {key: getattr(calibration.readings, key).tolist() for key in _READING_KEYS},
    }
    path.write_text(json.dumps(tree, indent=1) + "\n", encoding="utf-8")


def load_calibration(path: str | Path) -> Calibration:
    """Read a calibration.

    Raises:
        InvalidInput: No readable JSON, not a calibration or of another version, keys missing or
            unknown, or values that make no sense.
    """
    path = Path(path)
    try:
        tree = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise InvalidInput(f"`calibration` must be readable JSON; got {path} ({reason})") from None
    is_ours = isinstance(tree, dict) and tree.get("format") == FORMAT
    require(is_ours, "calibration", f'be a file of the format "{FORMAT}"', path)
    version = tree.get("version")
    require(version == VERSION, "calibration.version", f"be {VERSION}", version)
    _require_keys("calibration", tree, _KEYS)
    _require_keys("calibration.camera", tree["camera"], _CAMERA_KEYS)
    _require_keys("calibration.parabola", tree["parabola"], ("a", "b", "c"))
    _require_keys("calibration.readings", tree["readings"], _READING_KEYS)
    camera = dict(tree["camera"])
    camera["centre"] = tuple(_array("calibration.camera.centre", camera["centre"], 1).tolist())
    for key in ("mirror_radius", "mirror_distance", "pinhole_height", "focal_length"):
        camera[key] = _number(f"calibration.camera.{key}", camera[key])
    readings = {
        key: _array(f"calibration.readings.{key}", tree["readings"][key], ndim)
        for key, ndim in zip(_READING_KEYS, (1, 1, 2), strict=True)
    }
    a, b, c = (_number(f"calibration.parabola.{key}", tree["parabola"][key]) for key in "abc")
    return Calibration(
        camera=OmniCamera(**camera),
        parabola=(a, b, c),
        readings=Readings(**readings),
        **{key: _number(f"calibration.{key}", tree[key]) for key in _NUMBERS},
    )


def _require_keys(name: str, tree: Any, keys: tuple[str, ...]) -> None:
    require(isinstance(tree, dict), name, "be a mapping", tree)
    missing = [key for key in keys if key not in tree]
    require(not missing, name, f"have the keys {', '.join(keys)}", f"no {', '.join(missing)}")
    others = [key for key in tree if key not in keys]
    require(not others, name, f"have the keys {', '.join(keys)}", f"also {', '.join(others)}")


def _number(name: str, value: object) -> float:
    fine = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    require(fine, name, "be a finite number", value)
    return float(value)  # type: ignore[arg-type]  # a number, or the line above had raised


def _array(name: str, values: object, ndim: int) -> np.ndarray:
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f"`{name}` must be a list of numbers; got something else") from None
    require(array.ndim == ndim, name, f"be a list of {ndim} dimensions", array.ndim)
    return array
