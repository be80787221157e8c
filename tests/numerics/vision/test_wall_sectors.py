"""Walls by the bearing at which they can be met."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sightfield.systems.numerics.vision.ray_tracing import next_crossing
from sightfield.systems.numerics.vision.wall_sectors import edges_by_sector

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
