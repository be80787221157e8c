"""What kernels of turns need to know: where a machine may drive, what it covers, how it moves."""

from typing import NamedTuple

import numpy as np

from .borders import Borders
from .footprint import Footprint


class Site(NamedTuple):
    """Where, and with what outline.

    Attributes:
        borders: Of the ground.
        crop: Where crop stands, shape (rows, columns); no cells: nowhere.
        crop_origin: Of its cells [m].
        footprint: Of the machine.
    """

    borders: Borders
    crop: np.ndarray
    crop_origin: np.ndarray
    footprint: Footprint


class Motion(NamedTuple):
    """How a machine moves.

    Attributes:
        radius: Of its arcs [m].
        speed: In either gear [m/s].
        acceleration: [m/s^2].
    """

    radius: float
    speed: float
    acceleration: float
