"""What a cart covers, and how deep that is in a wall at poses and along paths."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import (
    TRAILER,
    covering_discs,
    deepest_overlap,
    discs_from_text,
    path_overlap,
)
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer

CART = Trailer()


def test_the_discs_cover_the_centre_lines_of_a_bent_cart():
    discs = covering_discs(Trailer(hitch_offset=0.2))
    state = np.array([1.0, 2.0, 0.4, 0.9])
    covered = shapely.union_all(
        [shapely.Point(*discs.centre(k, state)).buffer(discs.radii[k]) for k in range(len(discs))]
    )
    hitch = state[:2] - 0.2 * np.array([math.cos(0.4), math.sin(0.4)])
    axle = hitch - np.array([math.cos(0.4 - 0.9), math.sin(0.4 - 0.9)])
    nose = state[:2] + 0.5 * np.array([math.cos(0.4), math.sin(0.4)])
    strip = shapely.LineString([nose, hitch, axle]).buffer(0.42 * 0.5, cap_style="flat")
    assert strip.difference(covered).area < 1e-4


def test_the_last_trailer_disc_is_on_its_axle():
    discs = covering_discs(CART)
    first = discs.bodies.index(TRAILER)
    assert discs.centre(first, np.array([0.0, 0.0, 0.3, 0.3])) == pytest.approx((-1.0, 0.0))


def test_discs_are_ahead_of_the_axles_of_their_bodies():
    cart = Trailer(length=2.0, hitch_offset=0.5)
    discs = discs_from_text(cart, "Tractor 0.7 0.4, trailer -0.3 0.6")
    assert discs.radii == (0.4, 0.6)
    state = np.array([1.0, 2.0, math.pi / 2, math.pi / 2])
    np.testing.assert_allclose(discs.centre(0, state), (1.0, 2.7), atol=1e-12)
    # The trailer, at a right angle, heads along x from two behind the hitch.
    np.testing.assert_allclose(discs.centre(1, state), (-1.3, 1.5), atol=1e-12)


def test_overlap_is_the_depth_in_a_wall():
    wall = [(2.4, 0.0), (2.6, 0.0), (2.6, 6.0), (2.4, 6.0)]
    world = make_world([(-4, -4), (10, -4), (10, 10), (-4, 10)], [wall])
    discs = covering_discs(CART)
    states = np.array([[1.0, 3.0, 0.0, 0.0], [1.8, 3.0, 0.0, 0.0]])
    assert deepest_overlap(world, discs, states) == pytest.approx(0.15, abs=1e-9)


def test_overlap_along_a_path_is_that_of_its_arcs():
    """A disc at the axle on a circle of radius 1.5 rises 1.5 m, its chord 1.24."""
    room = make_world([(-4, -4), (4, -4), (4, 1.6), (-4, 1.6)])
    cart = Trailer(length=1.0, hitch_offset=0.2, speed=3.0, turn_rate=2.0)
    discs = discs_from_text(cart, "tractor 0 0.25")
    from_right, held = 0.6, 0.6
    start = (1.5 * math.sin(from_right), 1.5 * math.cos(from_right), math.pi - from_right, 0.2)
    path = driven_path(cart, start, [(3.0, 2.0, held)], held)
    assert deepest_overlap(room, discs, path.states) < 0
    assert path_overlap(room, discs, path, cart) == pytest.approx(0.15, abs=1e-4)
