"""Pictures, landmarks on walls and what is made of them for the renderer are as recorded."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.forward_camera import (
    ForwardCamera,
    project_forward,
)
from sightfield.systems.numerics.social.landmarks.landmark_pictures import (
    draw_glyph,
    landmark_picture,
    marker_picture,
)
from sightfield.systems.numerics.social.landmarks.maze import (
    Landmark,
    MarkerBlock,
    Maze,
    picture_mtl,
    picture_obj,
    upright_square,
    walls_obj,
)
from sightfield.systems.numerics.social.landmarks.thesis_maze import hang_landmarks, thesis_maze

WORLD = make_world(
    [[0.1, -0.2], [3.1, 0.3], [2.7, 2.5], [-0.4, 2.1]],
    [[[0.9, 0.8], [1.6, 0.9], [1.4, 1.5]], [[2.1, 1.0], [2.3, 1.1], [2.0, 1.9]]],
)


def test_glyphs_are_as_recorded(as_recorded):
    for stroke in (0.075, 0.12):
        glyphs = [draw_glyph(np.random.default_rng(seed), 30, stroke) for seed in range(40)]
        as_recorded(np.stack(glyphs), f"stroke {stroke}")
    as_recorded(draw_glyph(np.random.default_rng(5), 50), "of the usual stroke")


def test_pictures_are_as_recorded(as_recorded):
    as_recorded([landmark_picture(number, 96) for number in range(4)], "landmarks")
    as_recorded([landmark_picture(7), marker_picture(), marker_picture(75)], "sizes")


def test_landmarks_hang_as_recorded(as_recorded):
    as_recorded(hang_landmarks(WORLD, 9, side=0.31, middle_height=0.2), "in a small world")
    maze = thesis_maze()
    as_recorded(maze.landmarks, "in the maze of the thesis")
    as_recorded([maze.world.boundary, *maze.world.obstacles], "its walls")


def test_meshes_are_as_recorded(as_recorded):
    corners = upright_square(np.array([0.7, -0.4, 0.21]), 0.3, 0.6)
    as_recorded(corners, "square")
    as_recorded(MarkerBlock(copies=5, side=0.1).corners(np.array([0.7, -0.4, 0.3])), "block")
    as_recorded(picture_obj(corners, "wall_3").splitlines(), "picture")
    as_recorded(picture_mtl("wall_3", "three.png").splitlines(), "material")
    as_recorded(walls_obj(WORLD, 0.37).splitlines(), "walls")


def test_a_camera_looks_as_recorded(as_recorded):
    camera = ForwardCamera(width=333, height=210, field_of_view=math.radians(71), lens_height=0.23)
    points = np.array([[1.9, 0.3, 0.4], [0.6, 1.2, -0.1], [-2.0, 0.1, 0.3], [0.3, -0.2, 0.2]])
    as_recorded(project_forward(camera, np.array([0.3, -0.2, 0.4]), points), "pixels")
    as_recorded([camera.focal_length, *camera.centre, *camera.matrix.ravel()], "numbers")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ForwardCamera(lens_height=0.0), "`lens_height` must be positive"),
        (lambda: ForwardCamera(width=15), "`width` must be at least 16 pixels"),
        (lambda: ForwardCamera(height=16.0), "`height` must be at least 16 pixels"),
        (lambda: ForwardCamera(field_of_view=0.0), "`field_of_view` must lie between 0 and pi"),
        (lambda: ForwardCamera(field_of_view=math.pi), "`field_of_view` must lie between"),
        (lambda: Landmark(number=-1, x=0.0, y=0.0, facing=0.0), "`number` must"),
        (lambda: Landmark(number=1, x=0.0, y=0.0, facing=0.0, side=0.361), "`middle_height` must"),
        (lambda: MarkerBlock(side=0.0), "`side` must be positive"),
        (lambda: MarkerBlock(copies=2), "`copies` must be at least 3"),
        (lambda: MarkerBlock(side=0.3201), "`middle_height` must be at least half the side"),
        (lambda: Maze(world=WORLD, landmarks=(), wall_height=0.0), "`wall_height` must"),
        (lambda: Maze(world=WORLD, landmarks=(), body_height=0.1601), "`body_height` must stay"),
        (lambda: Maze(world=WORLD, landmarks=(), robot_radius=0.0989), "`robot_radius` must cover"),
        (lambda: landmark_picture(-1), "`number` must be zero or positive"),
        (lambda: hang_landmarks(WORLD, 0), "`count` must be at least 1"),
        (lambda: hang_landmarks(WORLD, 99), "`count` must fit on walls of 0.26 m"),
    ],
)
def test_what_is_no_part_of_a_maze_is_refused(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


def test_what_is_just_a_part_of_a_maze_is_not_refused():
    assert ForwardCamera(width=16, height=16).centre.tolist() == [7.5, 7.5]
    assert Landmark(number=0, x=0.0, y=0.0, facing=0.0, side=0.36).corners[3, 2] == 0.0
    assert MarkerBlock(side=0.32, copies=3).depth == pytest.approx(0.16 / math.sqrt(3))
    maze = Maze(world=WORLD, landmarks=(), body_height=0.16, robot_radius=0.0990)
    assert maze.marker.radius == pytest.approx(0.07 * math.sqrt(2))


def test_a_landmark_hangs_on_one_wall_and_faces_free_space():
    world = make_world([[0, 0], [2, 0], [2, 2], [0, 2]])

    def hang(x=2.0, y=1.0, facing=math.pi, **options):
        landmark = Landmark(number=1, x=x, y=y, facing=facing, **options)
        return Maze(world=world, landmarks=(landmark,)).landmark(1)

    assert hang(y=1.87).y == 1.87
    assert hang(middle_height=0.32).middle_height == 0.32
    for wrong, message in (
        ({"y": 1.88}, "hang on one wall"),
        ({"x": 1.99}, "hang on one wall"),
        ({"facing": 0.0}, "face free space"),
        ({"facing": math.pi / 2}, "hang on one wall"),
        ({"middle_height": 0.3201}, "end below the wall's top"),
    ):
        with pytest.raises(InvalidInput, match=message):
            hang(**wrong)
    twice = Landmark(number=1, x=2.0, y=1.0, facing=math.pi)
    with pytest.raises(InvalidInput, match="differ in number"):
        Maze(world=world, landmarks=(twice, twice))
