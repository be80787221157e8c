"""The camera as a system: pictures at its rate."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import TrajectorySource
from pydrake.trajectories import PiecewisePolynomial

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, make_ray_table
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import Sensor, expose, is_dropped
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings, shell_of
from sightfield.systems.vision.omni_camera import OmniCameraSensor

CAMERA = OmniCamera(width=96, height=80, focal_length=140.0)
SCENE = Surroundings(world=make_world([[-3, -3], [3, -3], [3, 3], [-3, 3]]))
OWN = Shell(colour=(60, 60, 60))


class Drive:
    """A robot that drives and turns past a red shell that moves too, and its camera."""

    def __init__(self, sensor: Sensor, period: float = 0.2):
        builder = DiagramBuilder()
        self.system = builder.AddSystem(
            OmniCameraSensor(CAMERA, sensor, SCENE, [shell_of("red")], own_shell=OWN, period=period)
        )
        ends = {
            "pose": ([0, 0, 0], [1, 0.5, 2]),
            "shell_position": ([0.8, -0.4], [1.2, 0.9]),
        }
        for name, (start, end) in ends.items():
            way = PiecewisePolynomial.FirstOrderHold([0.0, 2.0], np.array([start, end]).T)
            source = builder.AddSystem(TrajectorySource(way))
            builder.Connect(source.get_output_port(), self.system.GetInputPort(name))
        self.simulator = Simulator(builder.Build())
        self.simulator.Initialize()

    def at(self, time: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        self.simulator.AdvanceTo(time)
        # What is due at this very time included.
        self.simulator.AdvancePendingEvents()
        context = self.system.GetMyContextFromRoot(self.simulator.get_context())
        image, frame, pose = (
            self.system.GetOutputPort(name).Eval(context)
            for name in ("image", "frame", "exposure_pose")
        )
        return image.data.copy(), frame, pose


def picture(sensor: Sensor, tick: int, period: float = 0.2) -> np.ndarray:
    share = tick * period / 2.0
    pose = share * np.array([1, 0.5, 2])
    shell = np.array([0.8, -0.4]) + share * np.array([0.4, 1.3])
    light = render(
        CAMERA, make_ray_table(CAMERA), SCENE, pose, [shell_of("red"), OWN], [shell, pose[:2]]
    )
    return expose(sensor, light, tick)


def test_the_image_is_the_picture_of_the_last_tick():
    sensor = Sensor(seed=3)
    drive = Drive(sensor)
    for time, tick in ((0.0, 0), (0.1, 0), (0.2, 1), (0.35, 1), (1.0, 5)):
        image, frame, pose = drive.at(time)
        np.testing.assert_array_equal(frame, [tick, frame[1], 1])
        assert frame[1] == pytest.approx(0.2 * tick)
        np.testing.assert_allclose(pose, tick * 0.1 * np.array([1, 0.5, 2]), atol=1e-12)
        off = image.astype(int) - picture(sensor, tick)
        # Poses differ in the last bit, and so may a ray that grazes an edge.
        assert (np.abs(off) > 1).mean() < 1e-3


def test_a_lost_picture_leaves_the_one_before():
    sensor = Sensor(drop_share=0.5, seed=2)
    lost = [is_dropped(sensor, tick) for tick in range(10)]
    assert any(lost[1:])
    assert not all(lost)
    drive = Drive(sensor)
    arrived = -1
    for tick in range(10):
        arrived = arrived if lost[tick] else tick
        image, frame, _ = drive.at(0.2 * tick + 0.1)
        np.testing.assert_array_equal(frame[[0, 2]], [arrived, not lost[tick]])
        if arrived < 0:
            assert (image == [0, 0, 0, 255]).all()
        else:
            off = image.astype(int) - picture(sensor, arrived)
            assert (np.abs(off) > 1).mean() < 1e-3


def test_runs_repeat_with_their_seed():
    images = [Drive(Sensor(seed=seed)).at(0.7)[0] for seed in (1, 1, 2)]
    np.testing.assert_array_equal(images[0], images[1])
    assert (images[0] != images[2]).any()


def test_poses_matter_only_at_ticks():
    system = OmniCameraSensor(CAMERA, Sensor(), SCENE, [shell_of("red")])
    assert not system.HasAnyDirectFeedthrough()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"period": 0.0}, "`period` must be positive; got 0.0"),
        ({"own_shell": Shell(top=0.4)}, "`own_shell` must stay below the mirror, 0.37 m"),
    ],
)
def test_impossible_cameras_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        OmniCameraSensor(CAMERA, Sensor(), SCENE, [], **change)
