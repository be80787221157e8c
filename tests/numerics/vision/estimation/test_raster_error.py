"""A shell's place is less sure where its edges run along the pixels' grid."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.estimation.shell_detection import COLOURS
from sightfield.systems.numerics.vision.estimation.shell_estimate import search_shells
from sightfield.systems.numerics.vision.omni_optics import make_ray_table
from sightfield.systems.numerics.vision.rendering import render
from sightfield.systems.numerics.vision.sensor import Sensor, expose
from sightfield.systems.numerics.vision.surroundings import Shell, Surroundings

SHELL = Shell()
DISTANCE = 0.9
# Half the angle that the shell takes up: at this bearing one of its sides runs along a column.
HALF = np.arcsin(SHELL.radius / (DISTANCE + SHELL.radius))


@pytest.fixture(scope="module")
def turned(camera, calibration):
    """A function of a bearing: errors of bearings within a pixel of it, and their deviations."""
    rays = make_ray_table(camera)
    room = Surroundings(world=make_world([[-3, -3], [3, -3], [3, 3], [-3, 3]], []))

    def measure(middle):
        errors, deviations = [], []
        for turn in np.linspace(-0.5, 0.5, 12, endpoint=False):
            # A pixel there is 1 / 140 rad.
            bearing = middle + turn / 140
            at = (DISTANCE + SHELL.radius) * np.array([[np.cos(bearing), np.sin(bearing)]])
            light = render(camera, rays, room, (0, 0, 0), [SHELL], at)
            picture = expose(Sensor(noise=1.0), light, 0)[:, :, :3]
            ((_, estimate),) = search_shells(picture, [COLOURS["red"]], calibration)
            errors.append(estimate.bearing - bearing)
            deviations.append(estimate.covariance[1, 1] ** 0.5)
        return np.array(errors), np.array(deviations)

    return measure


def test_a_side_along_the_grid_makes_bearings_less_sure(turned):
    errors, deviations = turned(HALF)
    others, usual = turned(HALF + 0.35)
    assert deviations.mean() > 1.5 * usual.mean()
    # And rightly so, in both ways of lying.
    assert 0.6 < np.sqrt(np.mean(errors**2)) / deviations.mean() < 1.5
    assert np.sqrt(np.mean(others**2)) / usual.mean() < 1.5
    assert errors.std() > 1.5 * others.std()
