"""Figure 2.20: how P, PI, PD and PID control keep a distance by a biased estimate."""

from dataclasses import replace

from ....systems.numerics.standoff.loop import CONTROLLERS, StandoffLoop, wanted_equilibrium
from ....systems.numerics.standoff.response import respond, still_integral
from ...standoff.pictures import save_response_picture
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# y(0) of 2.2.7 [m], and how near to r a loop that keeps it has to come to rest [m].
START, NEAR = 0.1, 1e-3


def _make(workshop: Workshop) -> Evidence:
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
    make=_make,
)
