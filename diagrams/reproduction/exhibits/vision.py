"""Figures 2.10 to 2.12 and 2.20: how well the camera tells distances, and how one is kept by it."""

from dataclasses import replace

import numpy as np

from ....systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop, wanted_equilibrium
from ....systems.numerics.standoff.response import respond, still_integral
from ....systems.numerics.vision.estimation.calibration import THESIS_DISTANCES, calibrate
from ....systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from ....systems.numerics.vision.estimation.range_models import implied_k
from ....systems.numerics.vision.estimation.shell_detection import chosen_colours
from ....systems.numerics.vision.sensor import Sensor
from ....systems.numerics.vision.surroundings import shell_of
from ...standoff.pictures import save_response_picture
from ...vision.calibration import load_camera, save_direction_spread, save_error_curves
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# The thesis's k [px/rad].
THESIS_K = 107.0


def _camera_errors(workshop: Workshop) -> Evidence:
    optics, shell = load_camera(None), shell_of("red")
    taken = simulated_pictures(
        optics,
        Sensor(seed=0),
        shell,
        distances=THESIS_DISTANCES,
        directions=8 if workshop.quick else 24,
    )
    sizes = {"base": shell.base, "shell_radius": shell.radius, "shell_top": shell.top}
    readings, _ = read_pictures(taken, optics, chosen_colours(["red"])[0], **sizes)
    found = calibrate(readings, camera=optics, **sizes)
    spread, errors = (workshop.pictures / f"figure_2_{k}.png" for k in ("10", "11"))
    save_direction_spread(spread, found)
    save_error_curves(errors, found)
    curve, exact = found.curves["thesis"], found.curves["exact"]
    size = np.abs(curve.mean_error)
    far, near = float(size[-3:].mean()), float(size[2:-3].mean())
    implied = implied_k(optics, shell.base, np.array(THESIS_DISTANCES))
    ends = 1000 * curve.spread[[0, -1]]
    a, b, c = found.parabola
    return Evidence(
        (
            Picture(spread, "Estimates over the direction (2.10), their deviation (2.12)."),
            Picture(errors, "Mean error over the distance (2.11), and the parabola (2.8)."),
        ),
        (
            Finding(
                "k by the procedure of 2.2.4.2",
                f"{THESIS_K:g} px/rad for its camera.",
                f"{found.k:.1f} ± {found.k_spread:.1f} px/rad for ours; its optics imply "
                f"{implied.mean():.1f}.",
                SHOWN,
            ),
            Finding(
                "Error over distance (Figure 2.11, 2.2.5)",
                "Errors become notable where the distance is large; fitted by a parabola with "
                "a > 0, b < 0, c > 0: 1.062 1/m, -0.7598, 0.137 m.",
                f"With d = h tan(p / k) {1000 * far:.0f} mm at the three longest distances, "
                f"{1000 * near:.0f} mm in the middle; parabola {a:.3f} 1/m, {b:.3f}, {c:.3f} m.",
                judged(far > near and a > 0 > b and c > 0),
            ),
            Finding(
                "Deviation over the directions (Figure 2.12)",
                "",
                f"{ends[0]:.1f} mm at the shortest distance, {ends[1]:.1f} mm at the longest.",
                SHOWN,
            ),
            Finding(
                "Beyond: the exact mirror ball",
                "",
                f"Mean error {1000 * exact.mean_absolute_error:.1f} mm, where (2.4) leaves "
                f"{1000 * curve.mean_absolute_error:.1f} mm.",
                SHOWN,
            ),
        ),
    )


CAMERA_ERRORS = Exhibit(
    id="figure-2.10",
    covers=("Figure 2.10", "Figure 2.11", "Figure 2.12"),
    title="Errors of the distance estimate",
    states="Estimated distances over the direction of the shell, the error of their average and "
    "their deviation over the true distance, 15 to 60 inches. The camera was a real one; ours is "
    "a simulated mirror ball, so that sizes compare and numbers do not.",
    command="sightfield camera calibrate --out out/calibration",
    make=_camera_errors,
)


# y(0) of 2.2.7 [m], and how near to r a loop that keeps it has to come to rest [m].
START, NEAR = 0.1, 1e-3


def _standoff_responses(workshop: Workshop) -> Evidence:
    loop = StandoffLoop()
    file = workshop.pictures / "figure_2_20.png"
    save_response_picture(file, loop, START)
    ends = {}
    for controller in CONTROLLERS:
        each = replace(loop, controller=controller)
        motion = respond(each, START, integral=still_integral(each, START))
        ends[controller] = f"{motion.end:.4f} m" if motion.outcome == "settled" else motion.outcome
    rest = wanted_equilibrium(loop).y
    return Evidence(
        (Picture(file, "Left: the responses; right: why they do not end at r."),),
        (
            Finding(
                "Where the loops come to rest",
                "The controllers are to maintain r = 0.2 m.",
                f"They settle where the estimate is r: y = {rest:.4f} m, a bias of "
                f"{1000 * (rest - loop.reference):+.1f} mm. From y(0) = {START} m, y'(0) = 0: "
                + ", ".join(f"{name} {end}" for name, end in ends.items())
                + ".",
                judged(abs(rest - loop.reference) < NEAR),
            ),
            Finding(
                "Which of them settle",
                "All four responses are shown; no difference is put into words.",
                "A derivative part makes the equation singular at a distance, and an integral "
                "that does not start empty can overshoot: see the analysis of the command.",
                SHOWN,
            ),
        ),
    )


STANDOFF_RESPONSES = Exhibit(
    id="figure-2.20",
    covers=("Figure 2.20",),
    title="Responses of the P, PI, PD and PID controllers",
    states="Distances over time from y(0) = 100 mm and y'(0) = 0 with r = 200 mm, K_P = 10, "
    "K_I = 5, K_D = 1 and the error a = 0.001062, b = -0.7598, c = 137 (in mm).",
    command="sightfield standoff --controller PID --analyse --out out/standoff",
    make=_standoff_responses,
)
