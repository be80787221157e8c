"""A small arena and a small camera, and a slow way of looking that shares nothing with the fast."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, pixel_rays
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings


@pytest.fixture(scope="session")
def small_camera() -> OmniCamera:
    """A camera of 96 x 80 pixels that shows the same as the default one."""
    return OmniCamera(width=96, height=80, focal_length=140.0)


@pytest.fixture(scope="session")
def arena():
    """A room with a block, a triangle and a slanted wall."""
    return make_world(
        [[0, 0], [4, 0], [4, 3], [1, 4], [0, 3]],
        [
            [[0.8, 0.7], [1.4, 0.7], [1.4, 1.2], [0.8, 1.2]],
            [[2.5, 1.6], [3.3, 1.6], [2.9, 2.4]],
        ],
    )


@pytest.fixture(scope="session")
def looked_up() -> Callable[..., np.ndarray]:
    """Pictures by intersecting each pixel's ray in space with every surface, one by one."""

    def light(camera: OmniCamera, scene: Surroundings, pose, shells: list[Shell], positions):
        columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        points, directions = pixel_rays(camera, np.stack([columns.ravel(), rows.ravel()], axis=1))
        x, y, heading = pose
        turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
        palette = SimpleNamespace(
            **{
                name: np.array(getattr(scene, name)) / 255
                for name in ("floor", "wall", "wall_top", "room", "robot", "backdrop")
            }
        )
        sun = np.array([np.cos(scene.light_heading), np.sin(scene.light_heading)])
        free = scene.world.polygon

        def lit(colour, normal):
            return colour * (1 - 0.5 * scene.shading * (1 - normal @ sun))

        def colour_of(origin, ray):
            if np.isnan(origin[0]):
                return palette.backdrop
            origin = np.array([*(turn @ origin[:2] + [x, y]), origin[2]])
            ray = np.array([*(turn @ ray[:2]), ray[2]])
            hits = [(np.inf, palette.room)]
            if ray[2] < 0:
                reach = -origin[2] / ray[2]
                tile = np.floor((origin + reach * ray)[:2] / scene.tile).sum() % 2
                hits.append((reach, palette.floor[int(tile)]))
                roof = (scene.wall_height - origin[2]) / ray[2]
                if roof > 0 and not free.contains(shapely.Point((origin + roof * ray)[:2])):
                    hits.append((roof, palette.wall_top))
            for ring in scene.world.rings:
                for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
                    try:
                        reach, share = np.linalg.solve(
                            np.stack([ray[:2], a - b], axis=1), a - origin[:2]
                        )
                    except np.linalg.LinAlgError:
                        continue
                    height = origin[2] + reach * ray[2]
                    if reach > 0 and 0 <= share <= 1 and height <= scene.wall_height:
                        normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a))
                        hits.append((reach, lit(palette.wall, normal)))
            for shell, centre in zip(shells, positions, strict=True):
                aside = origin[:2] - centre
                quadratic = [
                    ray[:2] @ ray[:2],
                    2 * ray[:2] @ aside,
                    aside @ aside - shell.radius**2,
                ]
                for reach in np.roots(quadratic):
                    if np.isreal(reach) and reach.real > 0:
                        at = origin + reach.real * ray
                        if 0 <= at[2] <= shell.top:
                            normal = (at[:2] - centre) / shell.radius
                            own = np.array(shell.colour) / 255
                            paint = own if at[2] >= shell.base else palette.robot
                            hits.append((reach.real, lit(paint, normal)))
                if ray[2] < 0:
                    reach = (shell.top - origin[2]) / ray[2]
                    if reach > 0 and np.hypot(*(aside + reach * ray[:2])) < shell.radius:
                        hits.append((reach, palette.robot))
            return min(hits, key=lambda hit: hit[0])[1]

        colours = [colour_of(*each) for each in zip(points, directions, strict=True)]
        return np.array(colours).reshape(camera.height, camera.width, 3)

    return light
