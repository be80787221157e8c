"""From the pictures of friends to the evader's position, pixels only."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import shapely
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.landmarks.landmark_pictures import landmark_picture
from sightfield.systems.numerics.social.landmarks.maze import Maze
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.localisation.location import Outcome
from sightfield.systems.numerics.social.network.interface import Picture
from sightfield.systems.numerics.social.recognition.picture_files import encode_picture
from sightfield.systems.numerics.vision.sensor import Sensor, expose
from sightfield.systems.social.evader_locator import EvaderLocator
from sightfield.systems.social.maze_renderer import MazeRenderer, Poster, posters_of

# In sight of the evader: one sees landmark 1, the other 0, 1 and 9.
CAMERAS = np.array([[1.25, 1.0, 0.9], [1.3, 1.3, 0.4]])
EVADER = np.array([1.55, 1.5, 0.4])
SPEED = 0.1


@pytest.fixture(scope="module")
def maze() -> Maze:
    return thesis_maze()


@pytest.fixture(scope="module")
def shoot(maze):
    """A function of a camera's pose: a picture as bytes."""
    renderers = {None: MazeRenderer(maze)}

    def make(camera, evader=EVADER, *, posters=None, name=None) -> bytes:
        if name not in renderers:
            renderers[name] = MazeRenderer(maze, posters=posters)
        seen = renderers[name].render(0, np.asarray(camera)[None], evader)
        return encode_picture(expose(Sensor(), seen / np.float32(255), 0))

    return make


@pytest.fixture(scope="module")
def system(maze) -> EvaderLocator:
    return EvaderLocator(maze, speed=SPEED, period=1.0, offset=1.0)


class Look:
    """A simulation of the locator alone, which is handed pictures."""

    def __init__(self, system: EvaderLocator):
        self.system, self.count = system, 0
        self.simulator = Simulator(system)
        self.context = self.simulator.get_mutable_context()
        self.hand()
        self.simulator.Initialize()

    def hand(self, *files: bytes, time: float = 0.0) -> None:
        pictures = tuple(
            Picture(id=f"{self.count}-{k}", agent=k, time=time, data=each)
            for k, each in enumerate(files)
        )
        self.count += 1
        port = self.system.GetInputPort("pictures")
        port.FixValue(self.context, AbstractValue.Make(pictures))

    def until(self, time: float) -> None:
        self.simulator.AdvanceTo(time)
        self.simulator.AdvancePendingEvents()

    def value(self, name: str):
        return self.system.GetOutputPort(name).Eval(self.context)


@pytest.fixture
def look(system) -> Look:
    return Look(system)


@pytest.mark.parametrize("k", [0, 1])
def test_the_evader_is_located_from_one_picture(k, look, shoot):
    look.hand(shoot(CAMERAS[k]), time=0.5)
    look.until(1.0)
    assert look.value("evader_position") == pytest.approx(EVADER[:2], abs=0.05)
    assert look.value("located_at") == [0.5]
    (reading,) = look.value("readings")
    assert reading.location.outcome is Outcome.LOCATED
    assert reading.location.camera.pose == pytest.approx(CAMERAS[k], abs=0.05)


def test_before_the_first_location_nothing_is_known(look, shoot):
    look.hand(shoot(CAMERAS[0], None), time=0.5)
    look.until(1.0)
    assert np.isnan(look.value("evader_position")).all()
    assert np.isinf(look.value("evader_covariance")[[0, 3]]).all()
    assert look.value("located_at")[0] < 0
    (reading,) = look.value("readings")
    assert reading.location.outcome is Outcome.NO_EVADER
    assert reading.location.camera.pose == pytest.approx(CAMERAS[0], abs=0.02)


def test_pictures_of_one_moment_are_averaged(look, shoot):
    one = shoot(CAMERAS[0])
    look.hand(one, time=0.5)
    look.until(1.0)
    alone = np.trace(look.value("evader_covariance").reshape(2, 2))
    again = Look(look.system)
    again.hand(one, shoot(CAMERAS[1]), time=0.5)
    again.until(1.0)
    assert again.value("locations") == [2]
    assert np.trace(again.value("evader_covariance").reshape(2, 2)) < alone


def test_an_old_picture_changes_nothing(look, shoot):
    look.hand(shoot(CAMERAS[0]), time=0.8)
    look.until(1.0)
    known = look.value("evader_position").copy()
    look.hand(shoot(CAMERAS[1], np.array([1.65, 1.55, 0.4])), time=0.3)
    look.until(2.0)
    assert look.value("evader_position") == pytest.approx(known)
    assert look.value("located_at") == [0.8]
    assert look.value("locations") == [2]


def test_what_is_known_grows_old_as_fast_as_the_evader_moves(look, shoot):
    look.hand(shoot(CAMERAS[0]), time=0.5)
    look.until(1.0)
    then = look.value("evader_covariance").reshape(2, 2).copy()
    look.hand()
    look.until(4.0)
    grown = (SPEED * 3.5) ** 2 - (SPEED * 0.5) ** 2
    now = look.value("evader_covariance").reshape(2, 2)
    assert now - then == pytest.approx(grown * np.eye(2), abs=1e-12)


def test_what_is_no_picture_says_so_and_harms_nothing(look, shoot):
    good = shoot(CAMERAS[0])
    noise = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8)
    other_size = cv2.resize(noise, (320, 240))
    files = [b"", b"\xff\xd8\xff", good[:-300], encode_picture(other_size), encode_picture(noise)]
    look.hand(*files, good, time=0.5)
    look.until(1.0)
    outcomes = [each.location.outcome for each in look.value("readings")]
    assert outcomes == [*[Outcome.NO_PICTURE] * 4, Outcome.NO_EVADER, Outcome.LOCATED]
    assert look.value("evader_position") == pytest.approx(EVADER[:2], abs=0.05)


def test_upside_down_landmarks_give_no_location(look, shoot, maze):
    turned = [Poster(each.picture, each.corners[[2, 3, 0, 1]]) for each in posters_of(maze)]
    look.hand(shoot(CAMERAS[0], posters=turned, name="upside down"), time=0.5)
    look.until(1.0)
    (reading,) = look.value("readings")
    assert reading.recognition.landmarks
    assert reading.location.outcome is Outcome.NOT_UPRIGHT


def test_landmarks_that_are_not_on_the_map_give_no_location(look, shoot, maze):
    foreign = [
        Poster(landmark_picture(200 + k), each.corners) for k, each in enumerate(posters_of(maze))
    ]
    look.hand(shoot(CAMERAS[0], posters=foreign, name="foreign"), time=0.5)
    look.until(1.0)
    (reading,) = look.value("readings")
    assert reading.location.outcome is Outcome.NO_LANDMARK


def test_landmarks_that_hang_elsewhere_never_give_a_location_outside_the_maze(look, shoot, maze):
    # Each place shows the picture of another.
    pictures = [each.picture for each in posters_of(maze)]
    moved = [replace(each, picture=pictures[k - 5]) for k, each in enumerate(posters_of(maze))]
    files = [shoot(camera, posters=moved, name="moved") for camera in CAMERAS]
    look.hand(*files, time=0.5)
    look.until(1.0)
    for reading in look.value("readings"):
        location = reading.location
        if location.outcome.has_location:
            assert maze.world.polygon.distance(shapely.Point(location.position)) < 1e-9


def test_a_landmark_cut_by_the_frame_still_serves(look, shoot):
    look.hand(shoot([1.4, 1.2, 0.95]), time=0.5)
    look.until(1.0)
    (reading,) = look.value("readings")
    assert any(each.visible < 0.9 for each in reading.recognition.landmarks)
    assert look.value("evader_position") == pytest.approx(EVADER[:2], abs=0.1)


def test_an_unknown_method_is_refused(maze):
    with pytest.raises(InvalidInput, match="`method` must be one of thesis, edges, pnp, level"):
        EvaderLocator(maze, speed=0.1, method="guess")
