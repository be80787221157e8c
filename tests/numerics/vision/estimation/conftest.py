"""A camera that has been calibrated on simulated pictures, and a way to take more of them."""

from collections.abc import Callable

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.estimation.calibration import (
    THESIS_DISTANCES,
    Calibration,
    Readings,
    calibrate,
)
from sightfield.systems.numerics.vision.estimation.expected_picture import Scene
from sightfield.systems.numerics.vision.estimation.labelled_pictures import (
    read_pictures,
    simulated_pictures,
)
from sightfield.systems.numerics.vision.estimation.range_models import make_outline
from sightfield.systems.numerics.vision.estimation.shell_detection import COLOURS
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, make_ray_table, project_omni
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import Sensor, expose
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings

SHELL = Shell()
SIZES = {"base": SHELL.base, "shell_radius": SHELL.radius, "shell_top": SHELL.top}


@pytest.fixture(scope="session")
def camera() -> OmniCamera:
    """The true optics."""
    return OmniCamera()


@pytest.fixture(scope="session")
def scene(camera) -> Scene:
    """A window of 28 by 44 pixels, all of which are fitted."""
    shape = 28, 44
    count = shape[0] * shape[1]
    return Scene(
        outline=make_outline(camera, radius=0.1, base=0.04, top=0.2),
        shape=shape,
        axis=np.zeros(2),
        bearings=np.zeros(count),
        radii=np.ones(count),
        strength=np.zeros(count),
        inside=np.arange(count),
        ring=np.zeros(count, bool),
        points=np.ones((count, 1)),
        noise=0.02,
        saturated=False,
    )


@pytest.fixture(scope="session")
def shell_sizes() -> dict[str, float]:
    """Of the default shell, as `calibrate` wants them."""
    return SIZES


@pytest.fixture(scope="session")
def ideal_readings(camera) -> Callable[..., Readings]:
    """A function of distances and a number of directions: readings without pictures or noise."""

    def read(distances=THESIS_DISTANCES, directions=8, optics=camera):
        bearing = np.tile(2 * np.pi * np.arange(directions) / directions, len(distances))
        distance = np.repeat(distances, directions)
        at = np.column_stack([np.cos(bearing), np.sin(bearing)]) * distance[:, None]
        pixels, _ = project_omni(optics, np.column_stack([at, np.full(len(at), SHELL.base)]))
        return Readings(distance=distance, bearing=bearing, pixels=pixels)

    return read


@pytest.fixture(scope="session")
def calibration(camera) -> Calibration:
    """Of 2.2.4.2, on noisy pictures of a red shell."""
    # An odd number of directions: from opposite ones the raster errs alike.
    pictures = simulated_pictures(camera, Sensor(), SHELL, distances=THESIS_DISTANCES, directions=7)
    readings, skipped = read_pictures(pictures, camera, COLOURS["red"], **SIZES)
    assert skipped == []
    return calibrate(readings, camera=camera, **SIZES)


@pytest.fixture(scope="session")
def photograph(camera) -> Callable[..., np.ndarray]:
    """A function of shells at (distance to the near side, bearing): a picture from the origin."""
    rays = make_ray_table(camera)

    def take(shells, blocks=(), wall_height=0.5, seed=0, noise=3.0):
        world = make_world([[-4, -4], [4, -4], [4, 4], [-4, 4]], list(blocks))
        scene = Surroundings(world=world, wall_height=wall_height)
        places = [(d + s.radius, b) for s, d, b in shells]
        at = np.array([(reach * np.cos(b), reach * np.sin(b)) for reach, b in places])
        light = render(camera, rays, scene, (0, 0, 0), [s for s, _, _ in shells], at)
        return expose(Sensor(seed=seed, noise=noise), light, 0)

    return take
