"""All there is to know of the shells in one picture: found, measured, and located."""

from collections.abc import Sequence

import numpy as np

from .calibration import Calibration
from .outcomes import Outcome
from .pictures import as_rgb, has_contrast, require_size
from .shell_colours import ShellColour
from .shell_detection import ShellDetection, detect_blobs
from .shell_estimate import ShellEstimate, estimate_shell, no_estimate


def search_shells(
    picture: np.ndarray,
    colours: Sequence[ShellColour],
    calibration: Calibration,
    model: str = "exact",
) -> list[tuple[ShellDetection, ShellEstimate]]:
    """Look for one shell of each colour, and estimate where it is.

    What has a shell's colour but not its outline does not count, unless it is all there is. A
    colour that comes twice stands for two identical shells, in any order.

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
        nothing = ShellDetection(outcome=Outcome.NO_PICTURE)
        return [(nothing, no_estimate(Outcome.NO_PICTURE)) for _ in colours]
    blobs = detect_blobs(picture, list(dict.fromkeys(colours)), camera.axis_pixel)
    found: dict[ShellColour, list[tuple[ShellDetection, ShellEstimate]]] = {}
    for colour, detections in zip(dict.fromkeys(colours), blobs, strict=True):
        pairs = [(each, estimate_shell(each, calibration, model)) for each in detections]
        found[colour] = _shared_out(pairs, list(colours).count(colour))
    return [found[colour].pop(0) for colour in colours]


def _shared_out(
    pairs: list[tuple[ShellDetection, ShellEstimate]], count: int
) -> list[tuple[ShellDetection, ShellEstimate]]:
    """What to say of each of `count` shells of one colour, given all blobs of it."""
    shells = [pair for pair in pairs if pair[1].outcome.has_estimate]
    if len(shells) > count:
        area = pairs[0][0].area
        return [_nothing(Outcome.TWO_BLOBS, area) for _ in range(count)]
    if not shells:
        return [pairs[0]] * count
    rest = [_nothing(Outcome.NOT_ANOTHER, 0) for _ in range(count - len(shells))]
    return shells + rest


def _nothing(outcome: Outcome, area: int) -> tuple[ShellDetection, ShellEstimate]:
    return ShellDetection(outcome=outcome, area=area), no_estimate(outcome)
