"""Where an evader may be: what it can reach, less what has been seen to be empty."""

import itertools

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.vision.whereabouts.reachable_set import (
    empty_set,
    fill_disc,
    fill_everywhere,
    grow,
    look_and_see_nothing,
    make_place_grid,
    may_be_at,
    members,
    see_places,
    view_depths,
)

SPEED = 0.5
NOWHERE = np.array([0.0, 0.0, -np.inf])
NO_LOOK = np.empty((4, 0))


@pytest.fixture(scope="module")
def grid(block):
    return make_place_grid([block], 3000)


def wait(grid, reach, now, until, disc=NOWHERE):
    grow(grid, reach, NO_LOOK, np.zeros(len(grid.usable), dtype=bool), disc, SPEED, now, until)


def around_the_block(start, end):
    """Length of the shortest way round the block, by all orders of its corners."""
    corners = np.array([[1.5, 1], [2.5, 1], [2.5, 2], [1.5, 2]])

    def clear(a, b):
        inner = a + np.linspace(0, 1, 401)[1:-1, None] * (b - a)
        inside = (np.abs(inner - [2, 1.5]) < 0.5 - 1e-9).all(axis=1)
        return not inside.any()

    ways = [np.linalg.norm(end - start)] if clear(start, end) else []
    for turns in (1, -1):
        for first in range(4):
            for count in (1, 2):
                way = [start, *(corners[(first + turns * k) % 4] for k in range(count)), end]
                if all(clear(a, b) for a, b in itertools.pairwise(way)):
                    ways.append(sum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    return min(ways)


def test_arrivals_are_the_shortest_ways_round_walls(grid):
    start = np.array([0.5, 1.5])
    reach = empty_set(grid)
    fill_disc(grid, reach, *start, 0.0, SPEED, 0.0, 100.0)
    for place in np.flatnonzero(grid.usable)[::97]:
        shortest = around_the_block(start, grid.places[place]) / SPEED
        assert reach[3, place] >= shortest - 1e-9
        assert reach[3, place] <= shortest + 1.5 * grid.cell / SPEED


def test_growth_in_steps_is_growth_at_once(grid):
    once, steps = empty_set(grid), empty_set(grid)
    fill_disc(grid, once, 0.5, 1.5, 0.1, SPEED, 0.0, 6.0)
    fill_disc(grid, steps, 0.5, 1.5, 0.1, SPEED, 0.0, 0.5)
    for now in np.arange(0.1, 5.6, 0.1):
        wait(grid, steps, now, now + 0.5, np.array([0.5, 1.5, -0.2]))
    for time in (0.5, 2.0, 5.5):
        np.testing.assert_array_equal(members(once, time), members(steps, time))


def test_a_point_is_in_the_set_to_finer_than_a_cell(grid):
    reach = empty_set(grid)
    fill_disc(grid, reach, 0.7, 0.6, 0.013, SPEED, 0.0, 1.0)
    for angle in np.arange(0, 6, 0.7):
        out = np.array([np.cos(angle), np.sin(angle)])
        for radius in (0.013, 0.2, 0.4):
            time = (radius - 0.013) / SPEED
            assert may_be_at(grid, reach, SPEED, time, *([0.7, 0.6] + (radius - 1e-6) * out))
            assert not may_be_at(grid, reach, SPEED, time, *([0.7, 0.6] + (radius + 1e-6) * out))


def test_a_camera_in_the_middle_of_a_side_empties_what_it_sees_and_no_more(grid, block):
    walls = build_edge_index(block)
    reach = empty_set(grid)
    fill_everywhere(grid, reach, SPEED, 0.0)
    camera = (2.0, 0.2)
    depths = view_depths(walls, *camera, np.empty((0, 3)))
    seen = see_places(grid, depths, *camera, 0.1, 0.0, 9.0)
    for place in np.flatnonzero(seen)[::31]:
        assert segment_is_clear(walls, *camera, *grid.places[place])
    assert look_and_see_nothing(grid, reach, seen, NOWHERE, SPEED, 1.0, 2.0)
    np.testing.assert_array_equal(members(reach, 1.0), grid.usable & ~seen)
    # What is behind the block comes back at the evader's speed, and no faster.
    assert not may_be_at(grid, reach, SPEED, 1.0, 2.0, 0.6)
    assert may_be_at(grid, reach, SPEED, 1.5, 2.0, 2.5)
    wait(grid, reach, 2.0, 20.0)
    assert may_be_at(grid, reach, SPEED, 20.0, 2.0, 0.6)


def test_a_body_casts_its_shadow(grid, block):
    walls = build_edge_index(block)
    body = np.array([[0.8, 0.5, 0.2]])
    seen, past = (
        see_places(grid, view_depths(walls, 0.3, 0.5, each), 0.3, 0.5, 0.1, 0.0, 9.0)
        for each in (np.empty((0, 3)), body)
    )
    behind = np.nanargmin(np.linalg.norm(grid.places - [1.3, 0.5], axis=1))
    beside = np.nanargmin(np.linalg.norm(grid.places - [0.3, 1.3], axis=1))
    assert seen[behind]
    assert not past[behind]
    assert past[beside]


def test_cameras_that_watch_a_gap_hold_the_set_back_and_time_alone_does_not(grid):
    held, free = empty_set(grid), empty_set(grid)
    for reach in (held, free):
        fill_disc(grid, reach, 0.2, 1.5, 0.05, SPEED, 0.0, 0.5)
    disc = np.array([0.2, 1.5, -0.1])
    # A band of places that are seen at every tick parts the room.
    band = grid.usable & (np.abs(grid.places[:, 0] - 0.8) < 0.2)
    for now in np.arange(0.1, 8.0, 0.1):
        assert look_and_see_nothing(grid, held, band, disc, SPEED, now, now + 0.5)
        wait(grid, free, now, now + 0.5, disc)
    beyond = grid.usable & (grid.places[:, 0] > 1.0)
    assert not members(held, 7.9)[beyond].any()
    assert members(free, 7.9)[beyond].any()
    # Looks only take away.
    assert not (members(held, 7.9) & ~members(free, 7.9)).any()


def test_a_look_that_leaves_nothing_is_refused_and_changes_nothing(grid):
    reach = empty_set(grid)
    fill_disc(grid, reach, 0.5, 0.5, 0.1, SPEED, 0.0, 1.0)
    before = reach.copy()
    assert not look_and_see_nothing(grid, reach, grid.usable, NOWHERE, SPEED, 0.5, 1.0)
    np.testing.assert_array_equal(reach, before)
