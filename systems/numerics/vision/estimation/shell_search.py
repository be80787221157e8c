"""All there is to know of the shells in one picture: found, measured, and located."""

from collections.abc import Sequence

import numpy as np

from .calibration import Calibration
from .outcomes import Outcome
from .pictures import as_rgb, has_contrast, require_size
from .shell_colours import ShellColour
from .shell_detection import ShellDetection, detect_shells
from .shell_estimate import ShellEstimate, estimate_shell


def search_shells(
    picture: np.ndarray,
    colours: Sequence[ShellColour],
    calibration: Calibration,
    model: str = "exact",
) -> list[tuple[ShellDetection, ShellEstimate]]:
    """Look for one shell of each colour, and estimate where it is.

    Args:
        picture: Red, green, blue and perhaps alpha, shape (height, width, 3 or 4), uint8. One that
            is a single colour all over, as before the first, gives no estimates.
        colours: What to look for.
        calibration: Of the camera.
        model: Of the range, one of MODELS.

    Returns:
        For each colour, what was seen and where it is.

    Raises:
        InvalidInput: The picture has another type, shape or size than the camera's, or there is
            no such model.
    """
    picture = as_rgb(picture)
    camera = calibration.camera
    require_size(picture, camera.width, camera.height)
    if not has_contrast(picture):
        detections = [ShellDetection(outcome=Outcome.NO_PICTURE) for _ in colours]
    else:
        detections = detect_shells(picture, colours, camera.axis_pixel)
    return [(each, estimate_shell(each, calibration, model)) for each in detections]
