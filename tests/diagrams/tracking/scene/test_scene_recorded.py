"""What the scene tells a page of a known game, and where its parts are, is as it was recorded."""

import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.tracking.scene import View
from sightfield.diagrams.tracking.scene.layout import make_layout


@pytest.mark.parametrize("recording", [False, True])
def test_a_known_game_is_shown_as_recorded(recording, make_game, told, meshcat_calls, as_recorded):
    page = Meshcat(MeshcatParams(port=0, show_stats_plot=False))
    time = [0.0]
    game = make_game(
        page,
        recording=recording,
        view=lambda: View(chosen_pursuer=int(time[0] > 1.5) - (time[0] > 3.2)),
    )
    simulator = Simulator(game.diagram)
    for step in range(1, 13):
        time[0] = step / 3
        simulator.AdvanceTo(time[0])
    if recording:
        game.scene.finish_recording()
    as_recorded(told(meshcat_calls))


def test_the_layout_is_as_recorded(as_recorded):
    names = ("span", "map_bounds", "panel_bounds", "line", "wall")
    names += ("obstacle_height", "robot_height")
    layouts = [
        make_layout(bounds, radius)
        for bounds in ([0, 0, 4, 3], [-1.5, 2, 11, 4.2], [0, 0, 0.7, 6])
        for radius in (0.16, 0.004, 0.7)
    ]
    as_recorded([[getattr(layout, name) for name in names] for layout in layouts])
