"""What an omni-directional camera sees among walls and shells.

Walls by the bearing at which they can be met.
"""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, make_ray_table, project_omni
from sightfield.systems.numerics.vision.rendering import edges_by_sector, next_crossing, render
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings, shell_of

PLAIN = {"floor": ((150, 150, 150), (150, 150, 150)), "shading": 0.0}


def red_pixels(picture: np.ndarray) -> np.ndarray:
    return (picture[..., 0] > 0.5) & (picture[..., 1] < 0.3) & (picture[..., 2] < 0.3)


@pytest.mark.parametrize(
    ("wall_height", "pose"),
    [(0.5, (2.0, 1.2, 0.4)), (0.3, (0.45, 2.1, -2.5)), (0.1, (2.0, 1.2, 0.4))],
)
def test_every_pixel_shows_what_its_ray_meets_first(
    small_camera, arena, looked_up, wall_height, pose
):
    scene = Surroundings(world=arena, wall_height=wall_height)
    shells = [shell_of("red"), shell_of("green", radius=0.2, top=0.35), shell_of("blue", base=0.0)]
    positions = np.array([[2.2, 0.4], [1.9, 2.2], pose[:2]])
    picture = render(small_camera, make_ray_table(small_camera), scene, pose, shells, positions)
    expected = looked_up(small_camera, scene, pose, shells, positions)
    different = np.abs(picture - expected).max(axis=2) > 1e-5
    # A ray along an edge, to rounding, may go either way.
    assert different.sum() <= 1
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 10


def test_a_shells_bottom_edge_is_where_its_point_projects():
    camera, world = OmniCamera(), make_world([[-5, -5], [5, -5], [5, 5], [-5, 5]])
    scene, rays = Surroundings(world=world), make_ray_table(OmniCamera())
    shell = shell_of("red")
    for distance in (0.4, 0.8, 1.5):
        for bearing in (0.0, 1.1, -2.8):
            direction = np.array([math.cos(bearing), math.sin(bearing)])
            # The camera is turned against the world: bearings are the robot's own.
            heading = 0.7
            turned = np.array([math.cos(bearing + heading), math.sin(bearing + heading)])
            picture = render(
                camera, rays, scene, (1, 2, heading), [shell], [1, 2] + distance * turned
            )
            (foot,), _ = project_omni(
                camera, np.array([[*((distance - shell.radius) * direction), shell.base]])
            )
            outwards = foot - camera.axis_pixel
            outwards /= np.hypot(*outwards)
            below, above = np.rint(foot - 1.5 * outwards), np.rint(foot + 1.5 * outwards)
            red = red_pixels(picture)
            assert red[int(above[1]), int(above[0])]
            assert not red[int(below[1]), int(below[0])]


def test_a_shell_behind_a_wall_is_hidden_and_half_behind_it_half_hidden():
    world = make_world([[-3, -3], [3, -3], [3, 3], [-3, 3]], [[[1, 0], [1.2, 0], [1.2, 1], [1, 1]]])
    camera, scene = OmniCamera(), Surroundings(world=world)
    rays = make_ray_table(camera)

    def seen(x, y):
        picture = render(camera, rays, scene, (0, 0, 0), [shell_of("red")], np.array([[x, y]]))
        return int(red_pixels(picture).sum())

    assert seen(2, 0.5) == 0
    # The block's lower side is on the axis, and so is the shell: half of it looks out.
    assert seen(2, 0) == pytest.approx(0.5 * seen(-2, 0), rel=0.03)
    assert seen(2, -0.5) > 0


def test_a_low_wall_does_not_hide_a_shell_close_behind_it_from_above():
    world = make_world(
        [[-3, -3], [3, -3], [3, 3], [-3, 3]], [[[0.5, -1], [0.6, -1], [0.6, 1], [0.5, 1]]]
    )
    camera = OmniCamera()
    picture = render(
        camera,
        make_ray_table(camera),
        Surroundings(world=world, wall_height=0.05),
        (0, 0, 0),
        [shell_of("red")],
        np.array([[0.8, 0.0]]),
    )
    assert red_pixels(picture).sum() > 100


def test_the_nearer_of_two_shells_hides_the_farther():
    world = make_world([[-3, -3], [3, -3], [3, 3], [-3, 3]])
    camera, near = OmniCamera(), Shell(radius=0.2, top=0.41, colour=(0, 0, 255))
    rays = make_ray_table(camera)
    for order in (1, -1):
        picture = render(
            camera,
            rays,
            Surroundings(world=world),
            (0, 0, 0),
            [near, shell_of("red")][::order],
            np.array([[0.5, 0], [1.5, 0]])[::order],
        )
        assert red_pixels(picture).sum() == 0


def test_turning_the_robot_turns_the_picture(arena):
    camera = OmniCamera(width=120, height=120, focal_length=200.0)
    scene, rays = Surroundings(world=arena), make_ray_table(camera)
    shells, positions = [shell_of("red")], np.array([[2.2, 0.4]])
    straight = render(camera, rays, scene, (2, 1.2, 0.3), shells, positions)
    # A turn to the left moves the front's picture a quarter turn, seen from below: what was at
    # the top, ahead, is now at the robot's right, the picture's left.
    left = render(camera, rays, scene, (2, 1.2, 0.3 + math.pi / 2), shells, positions)
    different = np.abs(np.rot90(straight) - left).max(axis=2) > 1e-5
    assert different.mean() < 1e-3


def test_pictures_do_not_depend_on_where_the_world_is(arena):
    camera = OmniCamera(width=96, height=80, focal_length=140.0)
    rays, shells = make_ray_table(camera), [shell_of("red")]
    pose, position = np.array([2, 1.2, 0.3]), np.array([[2.2, 0.4]])
    here = render(camera, rays, Surroundings(world=arena, **PLAIN), pose, shells, position)
    turn, shift = 2.0, np.array([7.0, -11.0])
    c, s = math.cos(turn), math.sin(turn)
    matrix = np.array([[c, s], [-s, c]])
    moved = make_world(
        arena.boundary @ matrix + shift, [ring @ matrix + shift for ring in arena.obstacles]
    )
    there = render(
        camera,
        rays,
        Surroundings(world=moved, **PLAIN),
        [*(pose[:2] @ matrix + shift), pose[2] + turn],
        shells,
        position @ matrix + shift,
    )
    assert (np.abs(here - there).max(axis=2) > 1e-5).mean() < 1e-3


def test_beside_the_mirror_there_is_the_backdrop_and_above_the_walls_the_room(arena):
    camera, scene = OmniCamera(), Surroundings(world=arena)
    picture = render(camera, make_ray_table(camera), scene, (2, 1.2, 0), [], np.empty((0, 2)))
    np.testing.assert_allclose(picture[0, 0], np.array(scene.backdrop) / 255, atol=1e-6)
    inside_rim = round(camera.axis_pixel[0] + camera.rim_radius - 3)
    np.testing.assert_allclose(picture[240, inside_rim], np.array(scene.room) / 255, atol=1e-6)


def test_positions_and_shells_come_in_pairs(arena):
    camera = OmniCamera(width=8, height=8)
    with pytest.raises(InvalidInput, match="`positions` must be 1; got 2"):
        render(
            camera,
            make_ray_table(camera),
            Surroundings(world=arena),
            (2, 1, 0),
            [shell_of("red")],
            np.zeros((2, 2)),
        )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"wall_height": 0.0}, "`wall_height` must be positive; got 0.0"),
        ({"shading": 1.0}, r"`shading` must lie in \[0, 1\); got 1.0"),
        ({"room": (0, 0, 300)}, "`colours` must be"),
    ],
)
def test_impossible_surroundings_are_refused(arena, change, message):
    with pytest.raises(InvalidInput, match=message):
        dataclasses.replace(Surroundings(world=arena), **change)


SECTORS = 32


@given(
    arrays(float, (6, 4), elements=st.floats(-3, 3, width=16)),
    st.floats(-np.pi, np.pi),
    st.booleans(),
)
def test_a_bearings_own_sector_lists_every_edge_that_it_crosses(edges, bearing, entering):
    starts, lists = edges_by_sector(edges, SECTORS)
    sector = min(int((bearing / (2 * np.pi) + 0.5) * SECTORS), SECTORS - 1)
    way = (np.sin(bearing), np.cos(bearing), 0.0, entering)
    own = next_crossing(edges, lists, starts[sector], starts[sector + 1], *way)
    everything = np.arange(len(edges))
    every = next_crossing(edges, everything, 0, len(edges), *way)
    assert own[0] == every[0]


def test_sectors_list_few_edges():
    # A regular polygon around the camera: each sector meets one or two of its sides, and its
    # neighbours for rounding.
    angles = np.linspace(0, 2 * np.pi, 65)
    ring = 2 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    starts, lists = edges_by_sector(np.hstack([ring[:-1], ring[1:]]), 64)
    assert np.diff(starts).max() <= 5
    assert set(lists) == set(range(64))
