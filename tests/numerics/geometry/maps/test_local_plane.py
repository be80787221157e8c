"""Degrees become metres as on the ellipsoid."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.maps.local_plane import from_local_plane, local_plane

PLACES = [(0.0, 0.0), (6.06, 51.51), (-88.2, 40.1), (151.2, -33.9), (179.99, 78.0)]

# 1 / 298.257223563 and its squared eccentricity, worked out apart from the code.
SEMI_MAJOR, ECCENTRICITY_SQUARED = 6378137.0, 0.0066943799901413165


@pytest.mark.parametrize("place", PLACES)
def test_the_origin_is_zero(place):
    assert np.abs(local_plane(np.array([place]), np.array(place))).max() == 0.0


@pytest.mark.parametrize("place", PLACES)
def test_a_small_step_is_as_long_as_the_radii_of_curvature_say(place):
    longitude, latitude = place
    step = 1e-5
    east, north = local_plane(
        np.array([[longitude + step, latitude], [longitude, latitude + step]]), np.array(place)
    )
    root = np.sqrt(1.0 - ECCENTRICITY_SQUARED * np.sin(np.radians(latitude)) ** 2)
    across = SEMI_MAJOR / root * np.cos(np.radians(latitude))
    along = SEMI_MAJOR * (1.0 - ECCENTRICITY_SQUARED) / root**3
    np.testing.assert_allclose(east, [np.radians(step) * across, 0.0], atol=1e-6)
    np.testing.assert_allclose(north, [0.0, np.radians(step) * along], atol=1e-6)


def test_a_degree_of_latitude_is_longest_at_the_poles():
    lengths = [
        local_plane(np.array([[0.0, latitude + 0.5]]), np.array([0.0, latitude - 0.5]))[0, 1]
        for latitude in (0.5, 45.0, 89.0)
    ]
    # Published lengths of a degree: 110.574, 111.132, 111.694 km; a chord is a little shorter.
    np.testing.assert_allclose(lengths, [110574.0, 111132.0, 111694.0], rtol=2e-4)
    assert lengths == sorted(lengths)


def test_distances_do_not_depend_on_where_the_origin_is():
    place = np.array([6.06, 51.51])
    field = place + np.array([[0.0, 0.0], [0.02, 0.0], [0.02, 0.015]])
    for origin in (place, place + 0.01, place - [0.02, -0.01]):
        sides = np.linalg.norm(np.diff(local_plane(field, origin), axis=0), axis=1)
        np.testing.assert_allclose(
            sides, np.linalg.norm(np.diff(local_plane(field, place), axis=0), axis=1), rtol=1e-6
        )


@pytest.mark.parametrize("place", PLACES[1:-1])
def test_metres_become_the_degrees_that_they_came_from(place):
    """To a tenth of a millimetre within 9 km, about 1e-9 degrees."""
    origin = np.array(place)
    away = np.random.default_rng(0).uniform(-0.05, 0.05, (200, 2))
    degrees = from_local_plane(local_plane(origin + away, origin), origin)
    np.testing.assert_allclose(degrees, origin + away, atol=1e-9)
