"""Common agents' cameras: pictures at their rate."""

from itertools import pairwise

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.recognition.picture_files import decode_picture
from sightfield.systems.numerics.vision.sensor import Sensor, is_dropped
from sightfield.systems.social.forward_cameras import ForwardCameras

AGENTS = np.array([[1.25, 1.0, 0.9], [0.3, 1.2, 0.1]])
SENSOR = Sensor(blur=0.6, noise=3.0, drop_share=0.3, seed=4)


@pytest.fixture(scope="module")
def cameras() -> ForwardCameras:
    return ForwardCameras(thesis_maze(), 2, sensor=SENSOR, period=0.5)


@pytest.fixture
def run(cameras):
    """A function of a time: the pictures then, robots standing still."""
    simulator = Simulator(cameras)
    context = simulator.get_mutable_context()
    cameras.GetInputPort("agent_pose").FixValue(context, AGENTS.ravel())
    cameras.GetInputPort("evader_pose").FixValue(context, [1.55, 1.5, 0.4])
    cameras.GetInputPort("pursuer_pose").FixValue(context, [0.3, 0.3, 0.0])
    simulator.Initialize()

    def at(time: float):
        simulator.AdvanceTo(time)
        return cameras.GetOutputPort("pictures").Eval(simulator.get_context())

    return at


def lost(number: int) -> set[int]:
    return {agent for agent in range(2) if is_dropped(SENSOR, 2 * number + agent)}


def test_every_agent_takes_a_picture_in_each_period_unless_it_is_lost(run):
    names, losses = set(), 0
    for number in range(1, 8):
        pictures = run(0.5 * number + 0.1)
        assert {each.agent for each in pictures} == {0, 1} - lost(number)
        assert all(each.time == pytest.approx(0.5 * number) for each in pictures)
        names |= {each.id for each in pictures}
        losses += len(lost(number))
    assert losses > 0
    assert len(names) == 14 - losses


def test_a_picture_is_a_file_of_the_camera_s_size(run):
    camera = thesis_maze().camera
    for each in run(0.6):
        picture = decode_picture(each.data, camera.width, camera.height)
        assert picture.std() > 10


@pytest.mark.parametrize("released", [False, True])
def test_a_run_repeats_exactly(cameras, run, released):
    first = run(0.6)
    if released:
        cameras.release()
    simulator = Simulator(cameras)
    context = simulator.get_mutable_context()
    for name, value in (
        ("agent_pose", AGENTS.ravel()),
        ("evader_pose", [1.55, 1.5, 0.4]),
        ("pursuer_pose", [0.3, 0.3, 0.0]),
    ):
        cameras.GetInputPort(name).FixValue(context, value)
    simulator.Initialize()
    simulator.AdvanceTo(0.6)
    assert cameras.GetOutputPort("pictures").Eval(context) == first


def test_no_two_pictures_have_the_same_noise(run):
    camera = thesis_maze().camera
    seen = [{each.agent: each for each in run(time)} for time in (0.6, 1.1, 1.6, 2.1)]
    both = next((a[0], b[0]) for a, b in pairwise(seen) if 0 in a and 0 in b)
    pixels = [decode_picture(each.data, camera.width, camera.height) for each in both]
    assert not np.array_equal(*pixels)


def test_a_period_that_is_none_is_refused():
    with pytest.raises(InvalidInput, match=r"`period` must be positive; got 0\.0"):
        ForwardCameras(thesis_maze(), 1, period=0.0)
