"""The system draws what its ports say, when Drake says, and refuses what it cannot draw."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.tracking.scene import TrackingScene
from sightfield.systems.numerics.errors import InvalidInput


@pytest.fixture
def make_scene(arena, meshcat_log):
    def make(**changes) -> TrackingScene:
        arguments = {
            "pursuers": 2,
            "evaders": 3,
            "robot_radius": 0.12,
            "publish_period": 0.05,
            "visibility_polygon": lambda point: point + np.array([[1, 0], [0, 1], [-1, -1]]),
            "pursuit_field": lambda pursuer, points, evaders, assignment: np.ones_like(points),
            "recording": False,
        }
        return TrackingScene(arena, [arena], meshcat_log, **(arguments | changes))

    return make


def fix_ports(scene: TrackingScene, context, **changes) -> None:
    values = {
        "pursuer_position": [0.5, 0.5, 3.5, 0.5],
        "evader_position": [0.5, 2.5, 2.0, 2.5, 3.5, 2.5],
        "pursuer_direction": [0.0] * 4,
        "evader_direction": [1.0, 0.0] * 3,
        "visibility": [1, 1, 0, 0, 0, 1],
        "assignment": [0, 2],
    }
    for name, value in (values | changes).items():
        scene.GetInputPort(name).FixValue(context, value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("pursuers", 0),
        ("evaders", 0),
        ("robot_radius", 0.0),
        ("robot_radius", float("nan")),
        ("publish_period", -0.1),
    ],
)
def test_bad_input_is_refused_by_name(make_scene, name, value):
    with pytest.raises(InvalidInput, match=f"`{name}` must"):
        make_scene(**{name: value})


@pytest.mark.parametrize("recording", [False, True])
def test_a_picture_that_says_nothing_new_sends_nothing(make_scene, meshcat_log, recording):
    scene = make_scene(recording=recording)
    context = scene.CreateDefaultContext()
    fix_ports(scene, context)
    scene.ForcedPublish(context)
    before = len(meshcat_log.sent)
    context.SetTime(0.05)
    scene.ForcedPublish(context)
    assert len(meshcat_log.sent) == before


def test_it_draws_at_the_start_and_then_once_in_a_period(make_scene, meshcat_log):
    scene = make_scene()
    simulator = Simulator(scene)
    fix_ports(scene, simulator.get_mutable_context())
    times = []
    meshcat_log.SetSimulationTime = times.append
    simulator.AdvanceTo(0.2)
    np.testing.assert_allclose(times, [0.0, 0.05, 0.1, 0.15, 0.2])


def test_it_has_no_state(make_scene):
    context = make_scene().CreateDefaultContext()
    assert context.num_total_states() == 0
    assert context.num_abstract_states() == 0


def test_visibility_is_read_row_by_row(make_scene, meshcat_log):
    scene = make_scene(recording=True)
    context = scene.CreateDefaultContext()
    fix_ports(scene, context, visibility=[0, 0, 1, 0, 0, 0])
    scene.ForcedPublish(context)
    assert [path for path in meshcat_log.meshes if path.startswith("/tracking/sight/")] == [
        "/tracking/sight/0_2/bar"
    ]


def test_grown_regions_in_pieces_or_none_at_all_are_drawn(make_scene, arena, meshcat_log):
    def scene_with(grown) -> TrackingScene:
        return TrackingScene(
            arena,
            grown,
            meshcat_log,
            pursuers=1,
            evaders=1,
            robot_radius=0.1,
            publish_period=0.1,
            visibility_polygon=lambda point: point + np.eye(3, 2),
            pursuit_field=lambda pursuer, points, evaders, assignment: points,
            recording=False,
        )

    scene_with([])
    assert "/tracking/boundaries" not in meshcat_log.meshes
    scene_with([arena])
    one = meshcat_log.meshes["/tracking/boundaries"][1].shape[1]
    scene_with([arena, arena])
    assert meshcat_log.meshes["/tracking/boundaries"][1].shape[1] == one
    assert one > 0


def test_only_a_recording_can_be_finished(make_scene):
    with pytest.raises(InvalidInput, match="`recording` must be on"):
        make_scene(recording=False).finish_recording()


@pytest.mark.parametrize(
    "name",
    [
        "pursuer_position",
        "evader_position",
        "pursuer_direction",
        "evader_direction",
        "visibility",
        "assignment",
    ],
)
def test_each_port_has_a_getter(make_scene, name):
    scene = make_scene()
    assert getattr(scene, f"get_{name}_input_port")().get_name() == name
