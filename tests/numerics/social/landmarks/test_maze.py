"""The maze: landmarks hang on its walls, spread out, and the evader's block stands as it should."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.social.landmarks.maze import Landmark, MarkerBlock, Maze
from sightfield.systems.numerics.social.landmarks.thesis_maze import hang_landmarks, thesis_maze

ROOM = make_world([[0, 0], [2, 0], [2, 2], [0, 2]])


def test_the_thesis_maze_is_eight_feet_wide_with_thirteen_landmarks():
    maze = thesis_maze()
    assert maze.world.bounds == pytest.approx([0, 0, 2.4384, 2.4384])
    assert [each.number for each in maze.landmarks] == list(range(13))


def test_every_robot_can_go_everywhere_in_the_thesis_maze():
    maze = thesis_maze()
    assert len(shrink_world(maze.world, maze.robot_radius)) == 1


def test_landmarks_hang_on_walls_and_do_not_overlap():
    maze = thesis_maze()
    bases = [shapely.LineString(each.corners[:2, :2]) for each in maze.landmarks]
    walls = maze.world.polygon.boundary.buffer(1e-9)
    assert all(walls.covers(base) for base in bases)
    gaps = [a.distance(b) for i, a in enumerate(bases) for b in bases[:i]]
    assert min(gaps) > 0.01


def test_most_views_show_a_landmark():
    # From random poses, one in three turned to a wall right before it.
    maze, rng = thesis_maze(), np.random.default_rng(0)
    free = shrink_world(maze.world, maze.robot_radius)[0].polygon
    views = hits = 0
    while views < 300:
        x, y, heading = rng.uniform(0, 2.4384), rng.uniform(0, 2.4384), rng.uniform(-3.2, 3.2)
        if not shapely.contains_xy(free, x, y):
            continue
        views += 1
        for each in maze.landmarks:
            away = math.atan2(each.y - y, each.x - x)
            line = shapely.LineString([(x, y), (each.x, each.y)])
            front = math.cos(away + math.pi - each.facing) > 0.4
            if front and math.cos(away - heading) > 0.9 and maze.world.polygon.covers(line):
                hits += 1
                break
    assert hits / views > 0.5


def test_a_landmark_is_seen_with_its_left_edge_on_the_left():
    # On the east wall, facing west: who looks east has north on the left.
    landmark = Landmark(number=0, x=2.0, y=1.0, facing=math.pi)
    top_left, top_right, bottom_right, bottom_left = landmark.corners
    assert top_left[1] > top_right[1]
    assert bottom_left[1] > bottom_right[1]
    assert top_left[2] - bottom_left[2] == pytest.approx(landmark.side)


def test_the_markers_of_a_block_close_it_all_round():
    block = MarkerBlock(copies=6, side=0.1)
    corners = block.corners(np.array([1.0, 2.0, 0.7]))
    # Seen from outside, the left edge of each copy is the right edge of the one before.
    assert corners[:, 0] == pytest.approx(np.roll(corners[:, 1], 1, axis=0))
    reach = np.hypot(corners[..., 0] - 1.0, corners[..., 1] - 2.0)
    assert reach == pytest.approx(np.full((6, 4), block.radius))
    middles = corners.mean(axis=1)[:, :2] - [1.0, 2.0]
    assert np.hypot(*middles.T) == pytest.approx(np.full(6, block.depth))


def test_more_landmarks_than_there_is_room_for_are_refused():
    with pytest.raises(InvalidInput, match=r"`count` must fit .* got 40, room for [12][0-9]$"):
        hang_landmarks(ROOM, 40)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ({"x": 1.0}, r"`landmarks\[0\]` must hang on one wall, all of it"),
        ({"y": 1.95}, r"`landmarks\[0\]` must hang on one wall, all of it"),
        ({"facing": 0.0}, r"`landmarks\[0\]` must face free space"),
        ({"middle_height": 0.4}, r"`landmarks\[0\]` must end below the wall's top; got 0.53 m"),
    ],
)
def test_a_landmark_that_cannot_hang_there_is_refused(setting, message):
    place = {"number": 0, "x": 2.0, "y": 1.0, "facing": math.pi}
    with pytest.raises(InvalidInput, match=message):
        Maze(world=ROOM, landmarks=(Landmark(**{**place, **setting}),))


def test_two_landmarks_with_one_picture_are_refused():
    twins = [Landmark(number=4, x=2.0, y=y, facing=math.pi) for y in (0.5, 1.5)]
    with pytest.raises(InvalidInput, match="`landmarks` must differ in number"):
        Maze(world=ROOM, landmarks=tuple(twins))


def test_a_marker_block_wider_than_its_robot_is_refused():
    with pytest.raises(InvalidInput, match="`robot_radius` must cover the marker block"):
        Maze(world=ROOM, landmarks=(), marker=MarkerBlock(side=0.2))
