"""Beyond the thesis: how far off cameras and evaders are located by a landmark in a picture."""

import numpy as np

from ...social.pictures.error_curves import ANGLES, measure_errors, save_error_curves
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# Pictures of each distance and each angle.
PICTURES, QUICK_PICTURES = 12, 2
# An error that is larger by less than this factor counts as the same.
ALIKE = 1.5


def _make(workshop: Workshop) -> Evidence:
    pictures = QUICK_PICTURES if workshop.quick else PICTURES
    curves = measure_errors(pictures=pictures)
    file = workshop.pictures / "landmark_location.png"
    save_error_curves(file, curves)
    printed, corrected, level = (
        1000 * np.nanmedian(curves.over_angle[method].camera)
        for method in ("thesis", "edges", "level")
    )
    by_size, by_marks = (
        1000 * np.nanmedian(curves.over_angle[method].evader) for method in ("edges", "level")
    )
    steepest = np.degrees(ANGLES[-1])
    return Evidence(
        (Picture(file, f"Errors of positions, {pictures} pictures a point."),),
        (
            Finding(
                "Distance to a landmark's edge (2.14)",
                "d_1 = f d_landmark / (n_edge / k_ppm).",
                f"That is the depth along the camera's axis: it puts the camera off by "
                f"{printed:.0f} mm (median, at 1 m, up to {steepest:.0f} degrees off the "
                f"landmark's normal); divided by the cosine of the bearing by {corrected:.0f} mm.",
                judged(printed <= ALIKE * corrected),
            ),
            Finding(
                "A level camera, corners weighted by their doubt",
                "",
                f"The camera is off by {level:.0f} mm, the evader by {by_marks:.0f} mm; by the "
                f"size of its picture alone the evader is off by {by_size:.0f} mm.",
                SHOWN,
            ),
        ),
    )


LANDMARK_LOCATION = Exhibit(
    id="beyond-landmarks",
    covers=(),
    title="Where a picture was taken, and where the evader in it is",
    states="Agents find where they took a picture by the landmarks in it, with (2.13) and (2.14), "
    "and the thesis says nothing of errors. Here pictures of one landmark are rendered, and "
    "located by the printed equation, the corrected one, and two estimators.",
    command="sightfield social --set search.localisation=edges --out out/social",
    make=_make,
)
