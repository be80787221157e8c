"""What a calibration on a board found, as one JSON object and as a picture of its residuals."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ....systems.numerics.vision.boards.fit import BoardFit, rms_of

_DPI = 120
# Of aspects: beyond so many standard deviations, and so much, the ruler is to be looked at.
_DEVIATIONS, _LEAST = 4.0, 0.005


def summarise_board(
    fit: BoardFit,
    model: str,
    used: Sequence[str],
    skipped: Sequence[str],
    held: np.ndarray | None,
    free: BoardFit,
    ends: np.ndarray,
) -> dict[str, object]:
    """The entries of a calibration's summary.

    Args:
        fit: What was found.
        model: Its name.
        used, skipped: Names of pictures with and without a board.
        held: Residuals of pictures left out, shape (pictures, corners, 2) [px], None if they were
            too few.
        free: The fit with the proportions of the squares free.
        ends: Of the parameters' intervals of 95%, shape (p, 2).

    Returns:
        model, pictures, skipped, converged, rms [px], left_out_rms [px] or null, rms_by_picture
        [px], parameters (value, deviation, interval of 95%, null where it has no end, each in the
        unit of its name), aspect (value, deviation), and in words what is known of the ruler.
    """
    parameters = {
        name: {"value": value, "deviation": spread, "interval": _known(end)}
        for name, value, spread, end in zip(
            fit.camera.names,
            fit.camera.vector.tolist(),
            fit.deviations.tolist(),
            ends.tolist(),
            strict=True,
        )
    }
    return {
        "model": model,
        "pictures": list(used),
        "skipped": list(skipped),
        "converged": fit.converged,
        "rms": fit.rms,
        "left_out_rms": None if held is None else rms_of(held),
        "rms_by_picture": [rms_of(each) for each in fit.residuals],
        "parameters": parameters,
        "aspect": {"value": free.aspect, "deviation": free.aspect_deviation},
        "ruler": _ruler(free),
    }


def _known(ends: list[float]) -> list[float | None]:
    """Ends without those that are infinite, which JSON has no number for."""
    return [end if math.isfinite(end) else None for end in ends]


def save_residuals(path: Path, fit: BoardFit, pictures: Sequence[np.ndarray]) -> None:
    """Draw where the corners were and by how much the model misses them, 50 times as long.

    Args:
        path: Of the PNG file.
        fit: What was found.
        pictures: Pixels of the corners in each picture, shapes (n, 2).
    """
    figure = Figure(figsize=(10.5, 4.8), layout="constrained")
    over, cloud = figure.subplots(1, 2, width_ratios=[1.6, 1])
    pixels = np.concatenate(pictures)
    away = fit.residuals.reshape(-1, 2)
    over.quiver(*pixels.T, *(50 * away).T, angles="xy", scale_units="xy", scale=1, width=0.0015)
    over.set_xlim(0, fit.camera.width)
    over.set_ylim(fit.camera.height, 0)
    over.set_aspect("equal")
    over.set_title("residuals, 50 times as long", fontsize="medium")
    cloud.plot(*away.T, ".", markersize=2)
    cloud.set_aspect("equal")
    cloud.set_title(f"{fit.rms:.3f} px rms", fontsize="medium")
    cloud.set_xlabel("to the right [px]")
    cloud.set_ylabel("down [px]")
    cloud.grid(alpha=0.3)
    figure.savefig(path, dpi=_DPI)


def _ruler(free: BoardFit) -> str:
    """What a board tells of the ruler that measured it: proportions, never the size."""
    off = free.aspect - 1
    if abs(off) > max(_DEVIATIONS * free.aspect_deviation, _LEAST):
        return (
            f"The squares look {100 * abs(off):.2f}% {'higher' if off > 0 else 'lower'} than said "
            f"(+- {100 * free.aspect_deviation:.2f}%): measure them again in both directions, or "
            "try another model. Their size cannot be told from pictures."
        )
    return (
        f"The squares have the proportions that were said, to {100 * free.aspect_deviation:.2f}%. "
        "Their size cannot be told from pictures, and the camera does not depend on it."
    )
