"""Calibrating the cameras of a scenario in simulation, before its run."""

import numpy as np

from ....systems.numerics.vision.estimation.calibration import Calibration, calibrate
from ....systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from ....systems.numerics.vision.estimation.shell_colours import chosen_colours
from .scenario import PursuerVision

# How many distances, in equal ratios, and directions.
_DISTANCES, _DIRECTIONS = 9, 5


def practise(vision: PursuerVision) -> Calibration:
    """Calibrate by the procedure of 2.2.4.2, on simulated pictures over the range that is asked.

    Args:
        vision: Whose cameras and shells.

    Raises:
        InvalidInput: Too few of the pictures show a shell.
    """
    shell = vision.evader_shells[0]
    nearest, farthest = vision.calibrated_range
    pictures = simulated_pictures(
        vision.optics,
        vision.quality,
        shell,
        distances=np.geomspace(nearest, farthest, _DISTANCES).tolist(),
        directions=_DIRECTIONS,
    )
    readings, _ = read_pictures(pictures, vision.optics, chosen_colours(vision.colours)[0])
    return calibrate(
        readings,
        camera=vision.optics,
        base=shell.base,
        shell_radius=shell.radius,
        shell_top=shell.top,
    )
