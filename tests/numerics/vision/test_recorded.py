"""Rays, pictures and sensors of odd cameras in odd places are as recorded, to their limits."""

import math
from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.omni_optics import (
    OmniCamera,
    bearing_of,
    floor_range,
    make_ray_table,
    pixel_rays,
    project_omni,
)
from sightfield.systems.numerics.vision.rendering import edges_by_sector, next_crossing, render
from sightfield.systems.numerics.vision.sensor import Sensor, expose, is_dropped
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings, shell_of

ODD = OmniCamera(
    mirror_radius=0.07,
    mirror_distance=0.11,
    pinhole_height=0.31,
    focal_length=95.0,
    width=110,
    height=84,
    centre=(52.25, 44.5),
)
# Its picture ends before the mirror does.
LONG = replace(ODD, focal_length=200.0)


def test_rays_of_an_odd_camera_are_as_recorded(as_recorded):
    pixels = np.random.default_rng(0).uniform([0, 0], [110, 84], (40, 2))
    as_recorded(pixel_rays(ODD, pixels), "rays")
    as_recorded(bearing_of(ODD, pixels), "bearings")
    as_recorded(make_ray_table(ODD), "table")
    # A pixel that is the axis itself has a ray straight down.
    as_recorded(make_ray_table(OmniCamera(width=9, height=7, focal_length=8.0)), "small table")
    points = np.random.default_rng(1).normal([0.0, 0.0, 0.2], 0.6, (60, 3))
    shown, visible = project_omni(LONG, points)
    assert 5 < visible.sum() < 55
    as_recorded([shown, visible], "points")
    radii = np.array([0.0, 5.0, 21.0, 38.0, ODD.rim_radius - 1e-6, ODD.rim_radius + 1e-6])
    as_recorded(floor_range(ODD, radii, 0.08), "ranges")
    heights = ODD.mirror_height, ODD.focus_height, ODD.rim_radius
    as_recorded([*heights, ODD.axis_pixel, OmniCamera().axis_pixel], "sizes")
    as_recorded(OmniCamera(), "defaults")


def test_a_point_is_visible_to_the_outer_sides_of_the_last_pixels():
    # Straight ahead and behind, left and right, a hundredth of a pixel inside and outside.
    for way, edge in (
        ((0, -1), ODD.centre[1] + 0.5),
        ((0, 1), 83.5 - ODD.centre[1]),
        ((1, 0), 109.5 - ODD.centre[0]),
        ((-1, 0), ODD.centre[0] + 0.5),
    ):
        for off, inside in ((-0.01, True), (0.01, False)):
            pixel = np.array(ODD.centre) + (edge + off) * np.array(way)
            points, rays = pixel_rays(LONG, pixel[None])
            shown, visible = project_omni(LONG, points + 0.4 * rays)
            assert shown[0] == pytest.approx(pixel, abs=1e-6)
            assert visible.tolist() == [inside]


SHELLS = [shell_of("red"), Shell(radius=0.17, base=0.1, top=0.35, colour=(10, 200, 90))]
PLACES = np.array([[1.9, 0.9], [2.2, 2.6]])


@pytest.mark.parametrize("wall_height", [0.12, 0.31, 0.9])
@pytest.mark.parametrize(
    "pose", [(1.73, 0.94, 0.6), (0.51, 2.3, -2.4), (2.75, 1.31, 1.9)], ids=["near", "far", "wall"]
)
def test_a_picture_is_as_recorded(arena, as_recorded, pose, wall_height):
    scene = Surroundings(
        world=arena, wall_height=wall_height, tile=0.37, light_heading=-0.8, shading=0.45
    )
    # The robot's own shell is seen from above.
    places = np.vstack([PLACES, pose[:2]])
    light = render(ODD, make_ray_table(ODD), scene, pose, [*SHELLS, Shell(top=0.2)], places)
    assert len(np.unique(light.reshape(-1, 3), axis=0)) > 8
    as_recorded(light)


def test_the_usual_surroundings_are_as_recorded(arena, as_recorded):
    scene = Surroundings(world=arena)
    numbers = {key: value for key, value in vars(scene).items() if key not in ("world", "palette")}
    as_recorded([numbers, scene.palette, Shell()])


def test_edges_of_sectors_are_as_recorded(as_recorded):
    edges = np.random.default_rng(3).normal(0.0, 1.0, (9, 4))
    # One runs through the camera, and one behind it.
    edges[0] = [-0.3, -0.4, 0.6, 0.8]
    edges[1] = [-1.0, -0.3, -1.2, 0.4]
    for sectors in (8, 60):
        starts, lists = edges_by_sector(edges, sectors)
        as_recorded([starts, lists], f"{sectors}")
    crossings = []
    everything = np.arange(len(edges))
    for bearing in np.linspace(-3.1, 3.1, 25):
        for entering in (True, False):
            found = next_crossing(
                edges, everything, 1, 9, math.sin(bearing), math.cos(bearing), 0.21, entering
            )
            crossings.append(found)
    as_recorded(np.array(crossings), "crossings")


@pytest.mark.parametrize(
    ("corners", "enters", "leaves"),
    [
        # A tip towards the camera, one away from it, and one that is only grazed, from each side.
        ([(1, 0), (2, 1), (2, -1)], 1.0, 2.0),
        ([(1, 1), (2, 0), (1, -1)], 1.0, 2.0),
        ([(1, 0), (2, -1), (0.5, -1)], math.inf, math.inf),
        ([(0.5, 1), (2, 1), (1, 0)], 1.0, 1.0),
    ],
)
def test_a_corner_on_a_ray_is_crossed_once_or_as_often_as_it_is_left(corners, enters, leaves):
    edges = np.array([(*a, *b) for a, b in zip(corners, corners[1:] + corners[:1], strict=True)])
    ways = (edges.astype(float), np.arange(3), 0, 3, 0.0, 1.0)
    assert next_crossing(*ways, 0.0, True)[0] == enters
    assert next_crossing(*ways, 0.0, False)[0] == leaves
    # Up to a distance, itself included, crossings do not count.
    assert next_crossing(*ways, 1.0, True)[0] == math.inf


def test_pictures_of_all_sensors_are_as_recorded(as_recorded):
    light = np.random.default_rng(4).uniform(0.0, 1.1, (12, 15, 3)).astype(np.float32)
    for name, sensor in {
        "noisy": Sensor(noise=9.0, seed=3),
        "blurred": Sensor(blur=1.7, noise=0.0),
        "coarse": Sensor(bits=3, noise=2.0, exposure=0.7),
        "bright": Sensor(exposure=1.9, noise=1.0),
        "usual": Sensor(),
    }.items():
        pictures = np.array([expose(sensor, light, frame) for frame in (0, 5)])
        assert (pictures[..., 3] == 255).all()
        as_recorded(pictures, name, relative=1e-5)
    lossy = Sensor(drop_share=0.3, seed=7)
    as_recorded([is_dropped(lossy, frame) for frame in range(40)], "losses")
    as_recorded(Sensor(), "defaults")
    assert not any(is_dropped(replace(lossy, drop_share=0.0), frame) for frame in range(20))
    assert all(is_dropped(replace(lossy, drop_share=1.0), frame) for frame in range(20))


@pytest.mark.parametrize(
    ("make", "allowed", "refused"),
    [
        (lambda v: Sensor(blur=v), [0.0, 1e3], [1001.0, -1.0]),
        (lambda v: Sensor(noise=v), [0.0, 1e6], [1.1e6]),
        (lambda v: Sensor(exposure=v), [1e6], [0.0, 1.1e6]),
        (lambda v: Sensor(bits=v), [1, 8], [0, 9]),
        (lambda v: Sensor(drop_share=v), [0.0, 1.0], [-0.01, 1.01]),
        (lambda v: Shell(top=v, base=0.1), [0.1001], [0.1, 0.05]),
        (lambda v: Shell(colour=v), [(0, 255, 9)], [(0, 0), (0, 0, 256), (-1, 0, 0), (0, 0, True)]),
        (lambda v: OmniCamera(centre=v), [(1e6, -1e6)], [(1.0,), (1e6 + 1, 0.0), (0.0, math.nan)]),
        (lambda v: OmniCamera(width=v, height=5000), [10_000, 1], [10_001, 0, 3.0, True]),
    ],
)
def test_cameras_sensors_and_shells_end_where_they_say(make, allowed, refused):
    for value in allowed:
        make(value)
    for value in refused:
        with pytest.raises(InvalidInput):
            make(value)


def test_shading_and_colours_of_surroundings_end_where_they_say(arena):
    Surroundings(world=arena, shading=0.0, wall=(0, 255, 0))
    for wrong in ({"shading": 1.0}, {"shading": -0.1}, {"room": (0, 256, 0)}, {"wall": (1, 2)}):
        with pytest.raises(InvalidInput):
            Surroundings(world=arena, **wrong)
