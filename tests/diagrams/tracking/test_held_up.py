"""Moments of games at which a pursuer once stood for long because of a teammate.

From random starts of `thesis_borda_4v3`, or as said, whose seeds are named. Each pursuer was
pressed against a wall or an evader by a teammate that wanted to pass, saw no way aside, and lost
its turn as soon as it began to use it; or it stood at a wall until it had turned along it to the
last digit.
"""

from typing import NamedTuple

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, LogVectorOutput

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.scenario import TrackingScenario

# After so long [s] the pursuer has come as far as this [m].
SECONDS, FAR = 5.0, 0.1


class Moment(NamedTuple):
    """Where everybody is, and what the pursuers want; the evaders stay.

    Attributes:
        stood: Number of the pursuer that stood.
        seconds: For how long, in the game [s].
        pursuers, wishes, evaders: Positions [m], desired velocities [m/s], positions [m].
    """

    stood: int
    seconds: float
    pursuers: list
    wishes: list
    evaders: list


MOMENTS = {
    # Seed 161.
    "a teammate presses it against an evader at a box": Moment(
        3,
        5.6,
        [[0.16, 3.133], [3.84, 0.994], [0.887, 2.381], [1.196, 2.54]],
        [[-0.112, 0.278], [0.001, 0.122], [0.189, 0.144], [0.294, 0.06]],
        [[0.44, 3.365], [1.54, 2.494], [3.453, 1.16]],
    ),
    # Seed 241.
    "its way crosses that of a teammate whom a third presses": Moment(
        0,
        6.1,
        [[1.54, 2.364], [3.84, 1.19], [0.96, 2.376], [1.254, 2.54]],
        [[0.017, 0.299], [0.078, -0.29], [0.263, 0.14], [0.255, 0.159]],
        [[2.46, 2.559], [1.26, 3.429], [3.46, 0.876]],
    ),
    # Seed 593.
    "in file along a wall behind one that an evader stops": Moment(
        1,
        10.5,
        [[3.361, 3.84], [3.016, 3.84], [2.786, 1.186], [3.299, 1.794]],
        [[0.3, 0.011], [0.292, 0.07], [-0.021, 0.054], [0.023, -0.004]],
        [[3.56, 3.193], [3.56, 3.555], [3.19, 1.194]],
    ),
    # Seed 671.
    "a teammate presses it against an evader at a box for half a minute": Moment(
        3,
        30.45,
        [[0.875, 2.396], [1.706, 1.208], [3.415, 1.24], [1.193, 2.54]],
        [[0.196, 0.023], [0.034, -0.032], [0.014, -0.058], [0.289, 0.074]],
        [[1.544, 1.583], [3.56, 2.574], [1.54, 2.508]],
    ),
    # Seed 728.
    "a teammate presses it against an evader at a wall": Moment(
        0,
        7.8,
        [[3.84, 2.754], [3.84, 0.603], [3.633, 3.03], [1.688, 0.601]],
        [[0.086, -0.287], [0.001, -0.062], [0.203, -0.207], [0.015, -0.201]],
        [[3.788, 2.409], [3.457, 0.44], [2.327, 0.616]],
    ),
    # Seed 806.
    "a box, an evader and a teammate at a box surround it": Moment(
        1,
        20.95,
        [[1.679, 0.611], [2.46, 2.251], [2.64, 2.544], [2.982, 1.801]],
        [[0.012, -0.06], [0.157, -0.256], [0.235, -0.186], [-0.01, -0.019]],
        [[2.318, 0.677], [2.734, 1.41], [2.702, 2.005]],
    ),
    # Seed 896.
    "a teammate head on behind it and an evader before it": Moment(
        3,
        10.3,
        [[0.303, 1.184], [1.47, 1.728], [0.904, 2.371], [1.206, 2.54]],
        [[0.046, 0.148], [0.156, -0.209], [0.278, 0.113], [0.3, 0.013]],
        [[1.54, 2.448], [1.526, 1.36], [0.638, 1.203]],
    ),
    # Of `thesis_3v3`, seed 42.
    "two want the same passage between boxes": Moment(
        2,
        6.35,
        [[2.788, 2.44], [0.405, 0.682], [2.46, 2.326]],
        [[-0.047, 0.296], [0.286, 0.052], [-0.107, 0.28]],
        [[1.26, 3.46], [0.763, 0.54], [2.64, 3.324]],
    ),
    # Of `thesis_4v3`, seed 64.
    "a teammate that swings to and fro keeps it between a box and an evader": Moment(
        2,
        12.4,
        [[3.117, 2.399], [2.805, 1.887], [2.46, 1.948], [2.917, 3.604]],
        [[-0.065, 0.112], [-0.192, 0.078], [-0.007, 0.3], [0.0, 0.0]],
        [[2.763, 2.44], [2.64, 3.091], [2.46, 2.294]],
    ),
}


def play(moment, model):
    """Tracks of the pursuers if wishes stay as they are, and evaders where they are, [m]."""
    headings = [float(np.arctan2(vy, vx)) for vx, vy in moment.wishes]
    scenario = load_scenario(
        TrackingScenario,
        find_scenario("thesis_3v3"),
        [
            f"pursuers.model={model}",
            f"seconds={SECONDS}",
            f"pursuers.positions={moment.pursuers}",
            f"pursuers.headings={headings}",
            f"evaders.positions={moment.evaders}",
            "evaders.policies=[waypoints]",
            f"evaders.waypoints={[[place] for place in moment.evaders]}",
        ],
    )
    builder, pursuit = DiagramBuilder(), DiagramBuilder()
    source = pursuit.AddSystem(ConstantVectorSource(np.ravel(moment.wishes)))
    pursuit.ExportOutput(source.get_output_port(), "velocity")
    tracking = builder.AddSystem(MakeTracking(set_up_game(scenario), pursuit=pursuit.Build()))
    sink = LogVectorOutput(tracking.GetOutputPort("pursuer_position"), builder, scenario.period)
    simulator = Simulator(builder.Build())
    simulator.AdvanceTo(SECONDS)
    data = sink.FindLog(simulator.get_context()).data().T
    return data.reshape(len(data), -1, 2)


@pytest.mark.parametrize("model", ["point", "differential_drive"])
@pytest.mark.parametrize("name", MOMENTS)
def test_a_pursuer_that_stood_is_let_go(name, model):
    moment = MOMENTS[name]
    track = play(moment, model)[:, moment.stood]
    assert np.hypot(*(track - track[0]).T).max() > FAR
