"""From light to pixels: exposure, blur, noise, quantisation, and pictures that never arrive."""

from dataclasses import dataclass

import cv2
import numpy as np

from ..checked import Checked, Count, Finite, NonNegative, Positive
from ..compiled import compiled
from ..errors import require

# A blur wider than any picture, and light and noise that saturate all of it.
_WIDEST_BLUR, _MOST_LIGHT = 1e3, 1e6
# Separates the random numbers of dropped frames from those of noise.
_NOISE, _DROPS = 0, 1


@dataclass(frozen=True, kw_only=True)
class Sensor(Checked):
    """How good pictures are. The response is linear: no gamma.

    Raises:
        InvalidInput: A number is out of its range.
    """

    # Counts per light: 1 turns full white light into 255.
    exposure: Positive = 1.0
    # Standard deviation of the blur by lens and mirror, in pixels.
    blur: NonNegative = 0.6
    # Standard deviation of the noise, in counts of 255, alike in every pixel and channel.
    noise: NonNegative = 3.0
    # Levels of brightness that a channel can tell apart are 2^bits.
    bits: int = 8
    # Share of the pictures that are lost, in [0, 1].
    drop_share: Finite = 0.0
    # Of noise and losses.
    seed: Count = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, most in (
            ("exposure", _MOST_LIGHT),
            ("blur", _WIDEST_BLUR),
            ("noise", _MOST_LIGHT),
        ):
            value = getattr(self, name)
            require(value <= most, name, f"be at most {most:g}", value)
        require(self.bits in range(1, 9), "bits", "be a whole number from 1 to 8", self.bits)
        require(0 <= self.drop_share <= 1, "drop_share", "lie in [0, 1]", self.drop_share)


def expose(sensor: Sensor, light: np.ndarray, frame: int) -> np.ndarray:
    """Take one picture.

    Args:
        sensor: Its quality.
        light: Shape (height, width, 3), 0 to 1, from `render`.
        frame: Number of the picture, which with the seed decides its noise.

    Returns:
        Pixels, red, green, blue and an alpha of 255, shape (height, width, 4), uint8.
    """
    light = np.asarray(light, dtype=np.float32)
    if sensor.blur > 0:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), sensor.blur), dtype=np.float32)
    if sensor.noise > 0:
        noise = _random(sensor, frame, _NOISE).standard_normal(light.shape, dtype=np.float32)
    else:
        noise = np.zeros((1, 1, 3), dtype=np.float32)
    picture = np.empty((*light.shape[:2], 4), dtype=np.uint8)
    scale = np.float32(255 * sensor.exposure)
    _quantise(light, noise, scale, np.float32(sensor.noise), 2**sensor.bits - 1, picture)
    return picture


def is_dropped(sensor: Sensor, frame: int) -> bool:
    """Whether a picture is lost on its way.

    Args:
        sensor: Of the camera.
        frame: Number of the picture.
    """
    if sensor.drop_share == 0:
        return False
    return bool(_random(sensor, frame, _DROPS).random() < sensor.drop_share)


def _random(sensor: Sensor, frame: int, purpose: int) -> np.random.Generator:
    return np.random.Generator(np.random.SFC64([sensor.seed, purpose, frame]))


@compiled
def _quantise(
    light: np.ndarray,
    noise: np.ndarray,
    scale: np.float32,
    deviation: np.float32,
    steps: int,
    picture: np.ndarray,
) -> None:
    """Scale light to counts, add noise, round to the nearest of `steps` + 1 levels, clip."""
    noisy = len(noise) == len(light)
    to_steps = np.float32(steps) / np.float32(255)
    for row in range(light.shape[0]):
        for column in range(light.shape[1]):
            for channel in range(3):
                counts = scale * light[row, column, channel]
                if noisy:
                    counts += deviation * noise[row, column, channel]
                step = np.floor(min(max(counts, np.float32(0)), np.float32(255)) * to_steps + 0.5)
                picture[row, column, channel] = np.uint8(step / to_steps + 0.5)
            picture[row, column, 3] = 255
