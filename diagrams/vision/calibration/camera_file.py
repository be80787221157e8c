"""Optics of a camera from a YAML file, as measured with a ruler."""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from pydantic import ConfigDict

from ....systems.numerics.errors import require
from ....systems.numerics.vision.omni_optics import OmniCamera
from ...scenario_files import NO_OTHER_KEYS, load_scenario


@dataclass(frozen=True, kw_only=True)
class CameraFile(OmniCamera):
    """The keys of a camera file are the fields of `OmniCamera`, each with its default."""

    __pydantic_config__: ClassVar[ConfigDict] = NO_OTHER_KEYS


def load_camera(path: Path | None) -> OmniCamera:
    """The optics in a file, or the default ones.

    Raises:
        InvalidInput: No file there, no YAML mapping, an unknown key, or a value out of its range.
    """
    if path is None:
        return OmniCamera()
    require(path.is_file(), "camera", "be a YAML file", path)
    return load_scenario(CameraFile, path)
