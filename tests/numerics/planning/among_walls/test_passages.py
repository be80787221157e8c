"""Passages that a grid may not see."""

import math

import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.among_walls.passages import saved_by_narrow_passages
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.vehicle.footprint import covering_discs

# Half a metre wide.
DISCS = covering_discs(Trailer())
ENDS = (2.0, 3.0), (8.0, 3.0)


def rooms(door, end=6.0):
    """Two rooms, ten by six, with a door in the middle of their wall, which stops before y = 6."""
    upper = [(4.9, 3 + door / 2), (5.1, 3 + door / 2), (5.1, end), (4.9, end)]
    lower = [(4.9, 0), (5.1, 0), (5.1, 3 - door / 2), (4.9, 3 - door / 2)]
    return make_world([(0, 0), (10, 0), (10, 6), (0, 6)], [upper, lower])


@pytest.mark.parametrize(("step", "seen"), [(0.2, False), (0.02, True)])
def test_a_narrow_door_is_seen_by_a_fine_grid(step, seen):
    saved = saved_by_narrow_passages(rooms(0.6, end=4.8), DISCS, step, *ENDS)
    # Round the corners of the wall's end, 0.35 away from its sides.
    longer = 2 * math.hypot(2.9 - 0.35, 4.8 + 0.35 - 3.0) + 0.2 + 2 * 0.35 - 6.0
    assert saved == pytest.approx(0.0 if seen else longer, abs=1e-3)


def test_without_another_way_it_saves_everything():
    assert math.isinf(saved_by_narrow_passages(rooms(0.6), DISCS, 0.2, *ENDS))


@pytest.mark.parametrize("door", [1.0, 0.45])
def test_wide_doors_and_those_too_narrow_for_the_cart_are_none(door):
    assert saved_by_narrow_passages(rooms(door), DISCS, 0.2, *ENDS) == 0.0
