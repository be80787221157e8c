"""Pictures show things where a pinhole camera sees them."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput, SightfieldError
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.forward_camera import (
    ForwardCamera,
    project_forward,
)
from sightfield.systems.numerics.social.landmarks.maze import Landmark, Maze
from sightfield.systems.social import maze_renderer
from sightfield.systems.social.maze_renderer import MazeRenderer, Poster

ROOM = make_world([[0, 0], [2, 0], [2, 2], [0, 2]])
LANDMARK = Landmark(number=1, x=2.0, y=1.0, facing=np.pi)
MAZE = Maze(world=ROOM, landmarks=(LANDMARK,), camera=ForwardCamera(width=320, height=240))
WHITE = np.full((64, 64, 3), 255, np.uint8)


def middle_of(mask: np.ndarray) -> np.ndarray:
    """Column and row."""
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean(), rows.mean()])


@pytest.fixture(scope="module")
def room() -> MazeRenderer:
    """With a white square on the east wall."""
    return MazeRenderer(MAZE, common_agents=2, posters=[Poster(WHITE, LANDMARK.corners)])


@pytest.mark.parametrize(
    "pose", [(1.0, 1.0, 0.0), (0.5, 0.7, 0.2), (1.1, 1.5, -0.6), (0.3, 1.0, 0.35)]
)
def test_a_square_on_a_wall_is_drawn_where_a_pinhole_camera_sees_it(pose, room):
    poses = np.array([pose, [0.2, 0.2, 0.0]])
    picture = room.render(0, poses)
    corners = project_forward(MAZE.camera, poses[0], LANDMARK.corners)
    low, high = np.floor(corners.min(axis=0)).astype(int), np.ceil(corners.max(axis=0)).astype(int)
    part = picture[low[1] - 8 : high[1] + 9, low[0] - 8 : high[0] + 9, 0].astype(float)
    # Brighter than half way between wall and square.
    bright = part > 0.5 * (part.max() + np.median(part[0]))
    # A quadrilateral's centroid, from its two triangles.
    triangles = corners[[0, 1, 2]], corners[[0, 2, 3]]
    areas = [0.5 * abs(np.linalg.det(np.diff(each, axis=0))) for each in triangles]
    centroid = np.average([each.mean(axis=0) for each in triangles], axis=0, weights=areas)
    assert middle_of(bright) + low - 8 == pytest.approx(centroid, abs=0.35)
    assert bright.sum() == pytest.approx(sum(areas), rel=0.05)


def test_the_evader_is_drawn_with_its_markers(room):
    poses = np.array([[0.5, 1.0, 0.0], [0.2, 0.2, 0.0]])
    evader = np.array([1.2, 1.1, 0.4])
    changed = np.any(room.render(0, poses, evader) != room.render(0, poses), axis=2)
    for corners in MAZE.marker.corners(evader)[1:3]:
        column, row = (
            project_forward(MAZE.camera, poses[0], corners).mean(axis=0).round().astype(int)
        )
        assert changed[row, column]


def test_robots_hide_what_is_behind_them_and_do_not_see_themselves(room):
    alone = room.render(0, np.array([[0.5, 1.0, 0.0], [0.2, 0.2, 0.0]]))
    behind = room.render(0, np.array([[0.5, 1.0, 0.0], [0.3, 1.0, 0.0]]))
    before = room.render(0, np.array([[0.5, 1.0, 0.0], [0.9, 1.0, 0.0]]))
    assert np.array_equal(alone, behind)
    assert not np.array_equal(alone, before)


def test_the_pursuer_is_seen_too(room):
    poses = np.array([[0.5, 1.0, 0.0], [0.2, 0.2, 0.0]])
    pursuer = np.array([1.0, 1.0, 0.0])
    assert not np.array_equal(room.render(0, poses), room.render(0, poses, None, pursuer))


def test_without_a_graphics_library_the_line_to_type_is_named(monkeypatch):
    def fail(settings):
        raise RuntimeError("no libEGL.so.1")

    monkeypatch.setattr(maze_renderer, "MakeRenderEngineVtk", fail)
    with pytest.raises(SightfieldError, match=r"apt-get install libegl1 .*no libEGL\.so\.1"):
        MazeRenderer(MAZE)


def test_a_viewer_or_poses_that_there_are_not_are_refused(room):
    with pytest.raises(InvalidInput, match="`viewer` must be below 2; got 2"):
        room.render(2, np.zeros((2, 3)))
    with pytest.raises(InvalidInput, match="`common_agents` must be 2 x 3; got"):
        room.render(0, np.zeros((1, 3)))
