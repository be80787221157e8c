"""The social story: Figure 2.34, Tables 2.3 and 2.4, and how far off cameras are located."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from ....systems.numerics.social.network.acceptance import OwnAcceptance, thesis_temperaments
from ....systems.numerics.social.network.evolution import EvolutionLimits
from ....systems.numerics.social.network.friendship_chain import friendship_chain
from ...scenario_files import find_scenario, load_scenario
from ...social import scenarios
from ...social.networks import NetworkChoice, open_network
from ...social.pictures.error_curves import ANGLES, measure_errors, save_error_curves
from ...social.report import draw_connectivity
from ...social.run import run_social_search
from ...social.scenario import SocialScenario
from ...social.social_game import set_up_social_game
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Workshop, judged

# Tables 2.3 and 2.4: N_req, T_wait, N_img; friending and unfriending of the three agents.
LIMITS = (3, 10, 1)
FRIENDING, UNFRIENDING = (0.4, 0.5, 0.3), (0.05, 0.02, 0.04)
# Of the runs shown [s], and iterations of Algorithm 2 in the statement about them.
SECONDS, QUICK_SECONDS, ITERATIONS = 240.0, 8.0, 60


def _connect(workshop: Workshop) -> Evidence:
    scenario = load_scenario(SocialScenario, find_scenario("thesis_maze", scenarios))
    scenario = replace(scenario, seconds=QUICK_SECONDS if workshop.quick else SECONDS)
    game = set_up_social_game(scenario)
    with open_network(game, NetworkChoice()) as network:
        run = run_social_search(game, network)
    figure = Figure(figsize=(9, 3.2), layout="constrained")
    connected = run.log["connected"]
    draw_connectivity(figure.subplots(), run.times, connected, run.log["waiting"])
    file = workshop.pictures / "figure_2_34.png"
    figure.savefig(file, dpi=120)
    chain = friendship_chain(thesis_temperaments(), EvolutionLimits())
    everyone = chain.fraction(lambda state: len(state.friends) == 3)
    throughout = chain.chance_throughout(lambda state: len(state.friends) > 0, ITERATIONS)
    search, agents = scenario.search, scenario.agents
    acceptance = thesis_temperaments().acceptance
    as_tables = (
        (search.requests, search.patience, search.pictures) == LIMITS
        and (tuple(agents.friending), tuple(agents.unfriending)) == (FRIENDING, UNFRIENDING)
        and isinstance(acceptance, OwnAcceptance)
        and acceptance.friending == FRIENDING
    )
    return Evidence(
        (Picture(file, "Filled: connected; gray: asked, and no answer yet."),),
        (
            Finding(
                "Parameters (Tables 2.3 and 2.4)",
                "N_req = 3, T_wait = 10, N_img = 1; friending 0.4, 0.5, 0.3, unfriending 0.05, "
                "0.02, 0.04.",
                "The scenario has them; N_f, of which the tables say nothing, is 3.",
                judged(as_tables),
            ),
            Finding(
                "All three at once",
                "All three agents are connected in most of the time.",
                f"In the long run {everyone:.1%} of the time, exactly, by the Markov chain of "
                f"Algorithm 2; in this run {connected.all(axis=1).mean():.0%}.",
                judged(everyone > 0.5),
            ),
            Finding(
                "At least one in any time instant",
                "At least one of them is connected in any time instant.",
                f"Likely and not certain: once somebody is connected, somebody is throughout the "
                f"next {ITERATIONS} iterations with probability {throughout:.3f}. In this run "
                f"{connected.any(axis=1).mean():.0%} of the time, from strangers on.",
                judged(throughout == 1.0),
            ),
            Finding(
                "Each agent alone",
                "",
                ", ".join(
                    f"agent {k + 1} {p / (p + q):.1%}"
                    for k, (p, q) in enumerate(zip(FRIENDING, UNFRIENDING, strict=True))
                )
                + " of the time in the long run, p / (p + q).",
                SHOWN,
            ),
        ),
    )


SOCIAL_CONNECTIVITY = Exhibit(
    id="figure-2.34",
    covers=("Figure 2.34", "Table 2.3", "Table 2.4"),
    title="Connectivity between the pursuer and common agents",
    states="A run of the experiment with three common agents: who is connected when, with the "
    "parameters of Tables 2.3 and 2.4.",
    command="sightfield social --out out/social",
    make=_connect,
)


# Pictures of each distance and each angle.
PICTURES, QUICK_PICTURES = 12, 2
# An error that is larger by less than this factor counts as the same.
ALIKE = 1.5


def _locate(workshop: Workshop) -> Evidence:
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
    make=_locate,
)
