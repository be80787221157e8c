"""Figure 2.6: three pursuers with three risk vectors after one evader."""

import numpy as np

from ...scenario_files import find_scenario, load_scenario
from ...tracking.game import set_up_game
from ...tracking.report import draw_tracks
from ...tracking.run import run_tracking
from ...tracking.scenario import TrackingScenario
from ..evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged


def _make(workshop: Workshop) -> Evidence:
    scenario = load_scenario(TrackingScenario, find_scenario("risk_vectors"))
    run = run_tracking(set_up_game(scenario))
    file = workshop.pictures / "figure_2_6.png"
    draw_tracks(run).savefig(file, dpi=110)
    ways = run.log["pursuer_position"]
    seen = run.log["visibility"][:, :, 0]
    shares = ", ".join(
        f"{name} {part:.0%}"
        for name, part in zip(scenario.pursuers.risk_vectors, seen.mean(axis=0), strict=True)
    )
    apart = max(
        float(np.hypot(*(ways[:, i] - ways[:, j]).T).max()) for i in range(3) for j in range(i)
    )
    return Evidence(
        (
            Picture(
                file, "Green, black and blue: uniform, majority, proportional; red: the evader."
            ),
        ),
        (
            Finding(
                "One start, three tracks",
                "Pursuers with the three risk vectors start on one spot and go different ways.",
                f"They are up to {apart:.2f} m apart.",
                judged(apart > 0.1),
            ),
            Finding(
                "Who sees the evader, of the time",
                "",
                f"{shares} of {run.tracking_time:g} s.",
                SHOWN,
            ),
        ),
    )


RISK_TRACKS = Exhibit(
    id="figure-2.6",
    covers=("Figure 2.6",),
    title="Tracks with the three risk vectors",
    states="Trajectories of three pursuers that start on one spot and follow the same evader, "
    "each with its risk vector. Map and evader's path are not described.",
    command="sightfield track risk_vectors --out out/risk_vectors",
    make=_make,
)
