"""The colours that tell shells apart, and which pixels have them.

A colour is a range of hues: hue hardly changes with light and shadow, unlike red, green and blue.
"""

import colorsys
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from ...errors import require
from ..shells import SHELL_COLOURS


@dataclass(frozen=True, kw_only=True)
class ShellColour:
    """Which pixels count as one colour of shell.

    Attributes:
        name: What the colour is called.
        hue: Middle of the hues, 0 red, 120 green, 240 blue [deg].
        hue_tolerance: How far a pixel's hue may be from it [deg].
        min_saturation: Least saturation, from 0 (grey) to 1.
        min_value: Least brightness of the strongest part, from 0 (black) to 1.

    Raises:
        InvalidInput: A number is out of its range.
    """

    name: str
    hue: float
    hue_tolerance: float = 22.0
    min_saturation: float = 0.4
    min_value: float = 0.18

    def __post_init__(self) -> None:
        require(0 <= self.hue < 360, "hue", "lie in [0, 360) degrees", self.hue)
        require(
            0 < self.hue_tolerance < 180,
            "hue_tolerance",
            "lie between 0 and 180 degrees",
            self.hue_tolerance,
        )
        for key in ("min_saturation", "min_value"):
            require(0 < getattr(self, key) < 1, key, "lie between 0 and 1", getattr(self, key))


COLOURS: dict[str, ShellColour] = {
    name: ShellColour(name=name, hue=360 * colorsys.rgb_to_hsv(*paint)[0])
    for name, paint in SHELL_COLOURS.items()
}


def chosen_colours(names: Sequence[str]) -> list[ShellColour]:
    """The colours of some names, in their order.

    Raises:
        InvalidInput: No name, an unknown one, or one that comes twice.
    """
    known = ", ".join(COLOURS)
    require(len(names) > 0, "colours", "name at least one colour", "none")
    for name in names:
        require(name in COLOURS, "colour", f"be one of {known}", name)
    require(len(set(names)) == len(names), "colours", "differ from each other", ", ".join(names))
    return [COLOURS[name] for name in names]


def hue_saturation_value(picture: np.ndarray) -> np.ndarray:
    """Hue (256 steps round the circle), saturation and value, each uint8, as `colour_mask` wants.

    Args:
        picture: Red, green, blue, shape (height, width, 3), uint8.
    """
    return cv2.cvtColor(picture, cv2.COLOR_RGB2HSV_FULL)


def colour_mask(hsv: np.ndarray, colour: ShellColour, light: float = 1.0) -> np.ndarray:
    """Pixels of a colour, 255 where they have it and else 0, shape (height, width), uint8.

    Args:
        hsv: The picture as hue, saturation and value, shape (height, width, 3).
        colour: Which.
        light: How bright the picture is, as a share of usual; the least value falls with it.
    """
    low = (colour.hue - colour.hue_tolerance) / 360 * 256
    high = (colour.hue + colour.hue_tolerance) / 360 * 256
    least = (255 * colour.min_saturation, 255 * light * colour.min_value)
    mask = np.zeros(hsv.shape[:2], np.uint8)
    # Red lies on both sides of the seam of the circle.
    for turn in (-256, 0, 256):
        if high + turn >= 0 and low + turn <= 255:
            bounds = (max(low + turn, 0), *least), (min(high + turn, 255), 255, 255)
            np.maximum(mask, cv2.inRange(hsv, *bounds), out=mask)
    return mask
