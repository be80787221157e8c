"""From the camera's port to positions in the world."""

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource
from pydrake.systems.sensors import ImageRgba8U

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.estimation.shell_detection import Outcome
from sightfield.systems.numerics.vision.estimation.shell_estimate import search_shells
from sightfield.systems.numerics.vision.omni_optics import OmniCamera
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.numerics.vision.surroundings import Surroundings, shell_of
from sightfield.systems.vision import shell_estimator
from sightfield.systems.vision.omni_camera import OmniCameraSensor
from sightfield.systems.vision.shell_estimator import ShellEstimator

POSE = np.array([2.0, 1.5, 2.5])
# Red ahead, green behind; blue nowhere.
SHELLS = np.array([[1.2, 2.1], [2.5, 0.9]])


@pytest.fixture(scope="module")
def run(ideal_calibration):
    """A function of a model: a simulated camera and its estimator, and the context after 0.25 s."""

    def simulate(model="exact", colours=("red", "green", "blue")):
        builder = DiagramBuilder()
        room = Surroundings(world=make_world([[0, 0], [4, 0], [4, 3], [0, 3]], []))
        camera = builder.AddSystem(
            OmniCameraSensor(
                OmniCamera(), Sensor(), room, [shell_of("red"), shell_of("green")], period=0.1
            )
        )
        estimator = builder.AddSystem(ShellEstimator(ideal_calibration, colours, model=model))
        pose = builder.AddSystem(ConstantVectorSource(POSE))
        shells = builder.AddSystem(ConstantVectorSource(SHELLS.ravel()))
        builder.Connect(pose.get_output_port(), camera.GetInputPort("pose"))
        builder.Connect(shells.get_output_port(), camera.GetInputPort("shell_position"))
        builder.Connect(camera.GetOutputPort("image"), estimator.GetInputPort("image"))
        builder.Connect(camera.GetOutputPort("exposure_pose"), estimator.GetInputPort("pose"))
        simulator = Simulator(builder.Build())
        simulator.AdvanceTo(0.25)
        return estimator, estimator.GetMyContextFromRoot(simulator.get_context())

    return simulate


def value(system, context, name):
    return system.GetOutputPort(name).Eval(context)


@pytest.fixture
def still(ideal_calibration):
    """An estimator that looks at one picture, and its context, from a given array."""

    def look(picture, pose=POSE, colours=("red",)):
        system = ShellEstimator(ideal_calibration, colours)
        context = system.CreateDefaultContext()
        image = ImageRgba8U(picture.shape[1], picture.shape[0])
        if picture.size:
            image.mutable_data[:] = picture
        system.GetInputPort("image").FixValue(context, AbstractValue.Make(image))
        system.GetInputPort("pose").FixValue(context, pose)
        return system, context

    return look


def test_shells_are_located_and_a_missing_one_is_not(run):
    system, context = run()
    position = value(system, context, "position").reshape(3, 2)
    covariance = value(system, context, "covariance").reshape(3, 2, 2)
    assert value(system, context, "valid").tolist() == [1, 1, 0]
    assert value(system, context, "outcome").tolist() == [0, 0, Outcome.NO_BLOB]
    assert np.isnan(position[2]).all()
    assert np.isinf(np.diag(covariance[2])).all()
    for k in range(2):
        off = position[k] - SHELLS[k]
        assert np.linalg.norm(off) < 0.03
        assert off @ np.linalg.solve(covariance[k], off) < 16


def test_range_and_bearing_are_in_the_robot_s_frame(run):
    system, context = run()
    found = value(system, context, "range_bearing").reshape(3, 2)
    away = SHELLS - POSE[:2]
    turn = np.arctan2(away[:, 1], away[:, 0]) - POSE[2]
    assert found[:2, 0] == pytest.approx(np.hypot(*away.T) - 0.1, abs=0.02)
    assert found[:2, 1] == pytest.approx((turn + np.pi) % (2 * np.pi) - np.pi, abs=0.01)


def test_the_thesis_model_owns_its_error(run):
    (exact, one), (thesis, other) = run("exact"), run("thesis")
    for k in range(2):
        sure = value(exact, one, "covariance").reshape(3, 2, 2)[k]
        wide = value(thesis, other, "covariance").reshape(3, 2, 2)[k]
        assert np.trace(wide) > np.trace(sure)
        off = value(thesis, other, "position").reshape(3, 2)[k] - SHELLS[k]
        assert off @ np.linalg.solve(wide, off) < 16


def test_colours_come_in_the_order_that_is_asked_for(run):
    one, other = run(colours=("red", "green")), run(colours=("green", "red"))
    there, back = (value(*each, "position").reshape(2, 2) for each in (one, other))
    assert np.array_equal(there, back[::-1])


def test_a_picture_is_looked_at_once(still, monkeypatch):
    pictures = []

    def counted(picture, *arguments):
        pictures.append(picture)
        return search_shells(picture, *arguments)

    monkeypatch.setattr(shell_estimator, "search_shells", counted)
    system, context = still(np.full((480, 640, 4), 90, np.uint8))
    for name in ("position", "covariance", "valid", "range_bearing", "outcome"):
        value(system, context, name)
    # Nor again when only the robot has moved.
    system.GetInputPort("pose").FixValue(context, POSE + 1)
    value(system, context, "position")
    assert len(pictures) == 1


@pytest.mark.parametrize("colour", [(0, 0, 0, 255), (205, 30, 35, 255), (255, 255, 255, 255)])
def test_one_colour_all_over_gives_no_estimate(still, colour):
    system, context = still(np.full((480, 640, 4), colour, np.uint8))
    assert value(system, context, "outcome").tolist() == [Outcome.NO_PICTURE]
    assert value(system, context, "valid").tolist() == [0]


@pytest.mark.parametrize("shape", [(240, 320, 4), (640, 480, 4)])
def test_a_picture_of_another_size_is_named(still, shape):
    system, context = still(np.zeros(shape, np.uint8))
    message = f"`picture` must be 640 x 480 pixels; got {shape[1]} x {shape[0]}"
    with pytest.raises(InvalidInput, match=message):
        value(system, context, "valid")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"colours": ["mauve"]}, "`colour` must be one of .*; got mauve"),
        ({"colours": []}, "`colours` must name at least one colour"),
        ({"colours": ["red"], "model": "best"}, "`model` must be one of thesis, exact; got best"),
    ],
)
def test_bad_arguments_are_named(ideal_calibration, arguments, message):
    with pytest.raises(InvalidInput, match=message):
        ShellEstimator(ideal_calibration, **arguments)
