"""Where evaders may be, and what is believed of them, is as recorded."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.vision.whereabouts.evader_tracks import (
    Picture,
    Search,
    covariances_now,
    no_knowledge,
    positions_now,
    take_in,
)
from sightfield.systems.numerics.vision.whereabouts.occlusion_trial import run_occlusion_trial
from sightfield.systems.numerics.vision.whereabouts.reachable_set import (
    cell_at,
    empty_set,
    fill_disc,
    fill_everywhere,
    look_and_see_nothing,
    make_place_grid,
    may_be_at,
    members,
    see_places,
    view_depths,
)


@pytest.fixture(scope="module")
def crooked():
    """A room without a right angle, with two pillars."""
    return make_world(
        [[0.1, -0.2], [3.1, 0.15], [2.9, 2.3], [1.4, 2.75], [-0.15, 2.1]],
        [
            [[0.7, 0.6], [1.25, 0.75], [1.1, 1.3], [0.65, 1.15]],
            [[1.8, 1.1], [2.35, 1.0], [2.1, 1.7]],
        ],
    )


@pytest.fixture(scope="module")
def grid(crooked):
    """Places for the middles of robots in it."""
    return make_place_grid(shrink_world(crooked, 0.11), 450)


@pytest.fixture(scope="module")
def search(crooked, grid):
    """A function of colours: a search there."""

    def make(*colours: int) -> Search:
        return Search(
            grid=grid,
            walls=build_edge_index(crooked),
            colours=colours,
            speed=0.21,
            density=0.3,
            shell_radius=0.09,
            certain_range=(0.33, 2.2),
            body_radius=0.12,
        )

    return make


def test_a_grid_of_places_is_as_recorded(grid, as_recorded):
    numbers = {key: value for key, value in grid._asdict().items() if key != "edges"}
    as_recorded(numbers)
    spots = [[-9.0, -9.0], [9.0, 9.0], [0.77, 1.61], [2.61, 0.43], [1.0, 9.0]]
    as_recorded([cell_at(grid, *spot) for spot in spots], "cells")
    with pytest.raises(ValueError, match="`cells` must be at least 100; got 99"):
        make_place_grid([make_world([[0, 0], [1, 0], [1, 1]])], 99)
    make_place_grid([make_world([[0, 0], [1, 0], [1, 1]])], 100)


BODIES = [np.zeros((0, 3)), np.array([[1.6, 2.2, 0.12], [0.41, 0.52, 0.2], [-0.4, 1.9, 0.3]])]


@pytest.mark.parametrize("bodies", BODIES, ids=["alone", "among bodies"])
@pytest.mark.parametrize("spot", [(0.4, 1.7), (2.6, 1.9), (1.5, 0.4)])
def test_what_a_camera_sees_is_as_recorded(crooked, grid, as_recorded, spot, bodies):
    depths = view_depths(build_edge_index(crooked), *spot, bodies)
    as_recorded(depths, "depths")
    for near, far in ((0.3, 2.0), (0.7, 5.0)):
        seen = see_places(grid, depths, *spot, 0.09, near, far)
        assert 0 < seen.sum() < len(seen)
        as_recorded(np.flatnonzero(seen), f"{near}")
    assert not view_depths(build_edge_index(crooked), 1.0, 1.0, bodies).any()


@pytest.mark.parametrize("start", [(0.35, 1.81), (1.7, 0.41), (0.9, 0.95)])
def test_a_set_that_grows_and_is_looked_at_is_as_recorded(crooked, grid, as_recorded, start):
    walls, speed = build_edge_index(crooked), 0.21
    reach = empty_set(grid)
    disc = fill_disc(grid, reach, *start, 0.17, speed, 1.3, 4.0)
    as_recorded(disc, "disc")
    as_recorded(reach, "at first")
    spots = np.random.default_rng(0).uniform([0.1, 0.0], [2.9, 2.5], (60, 2))
    for time, spot in ((2.1, (2.5, 0.6)), (3.4, (0.5, 0.3)), (3.9, (1.4, 1.9))):
        seen = see_places(grid, view_depths(walls, *spot, BODIES[0]), *spot, 0.09, 0.3, 2.4)
        left = look_and_see_nothing(grid, reach, seen, disc, speed, time, time + 2.0)
        there = [may_be_at(grid, reach, speed, time, *each) for each in spots]
        as_recorded([left, np.flatnonzero(members(reach, time)), np.flatnonzero(there)], f"{time}")
        as_recorded(reach, f"reach at {time}")
    everywhere = np.ones(len(grid.usable), bool)
    kept = reach.copy()
    assert not look_and_see_nothing(grid, reach, everywhere, disc, speed, 4.0, 5.0)
    np.testing.assert_array_equal(reach, kept)
    fill_everywhere(grid, reach, speed, 4.2)
    as_recorded(reach, "everywhere")


def filmed(rng, time, stand, spots, share):
    """A picture in which each of some spots is measured, or only suspected, by chance."""
    chance = rng.random(len(spots))
    valid = chance < share
    spread = np.array([[4e-4, 1e-4], [1e-4, 9e-4]])
    positions = np.where(valid[:, None], spots + rng.normal(0.0, 0.02, spots.shape), np.nan)
    covariances = np.where(valid[:, None, None], spread, np.diag([np.inf, np.inf]))
    return Picture(time, stand, positions, covariances, valid, chance > 0.9)


@pytest.mark.parametrize("colours", [(0,), (0, 0), (0, 1)])
def test_what_is_believed_of_evaders_is_as_recorded(search, as_recorded, colours):
    hunt = search(*colours)
    known = no_knowledge(hunt)
    rng = np.random.default_rng(len(colours) + sum(colours))
    starts = np.array([[0.3, 1.6], [2.5, 0.6]])[: len(colours)]
    runs = np.array([[0.12, 0.1], [-0.1, 0.05]])[: len(colours)]
    stands = np.array([[1.5, 0.3, 0.0], [1.5, 2.3, 1.0]])
    told = []
    for k in range(45):
        now = 0.1 * k
        # Seen at first, gone for a while, back where they are or, at last, somewhere else.
        share = 0.0 if 15 <= k < 28 else 0.8
        shift = [0.6, -0.9] if k >= 38 else [0.0, 0.0]
        pictures = []
        for camera, late in ((0, 0.0), (1, 0.07)):
            if (k + camera) % 3 == 0:
                continue
            spots = starts + (now - late) * runs + shift
            pictures.append(filmed(rng, now - late, stands[camera], spots, share))
        take_in(hunt, known, pictures, now)
        places = positions_now(hunt, known, now)
        spreads = covariances_now(hunt, known, places, now)
        told.append((places, spreads[:, 0, 0], [members(each, now).sum() for each in known.sets]))
    as_recorded(np.array([each[0] for each in told]), "places", relative=1e-5)
    as_recorded(np.array([each[1] for each in told]), "spreads", relative=1e-5)
    as_recorded(np.array([each[2] for each in told]), "sizes")
    as_recorded(known.tracks, "tracks", relative=1e-5)
    as_recorded(known.hypotheses, "hypotheses", relative=1e-5)


def test_more_hypotheses_than_are_kept_make_room_as_recorded(search, as_recorded):
    hunt = search(0, 1)
    known = no_knowledge(hunt)
    spots = [(0.4, 1.7), (2.6, 0.5), (1.5, 0.4), (1.5, 2.3), (2.6, 1.9), (0.3, 0.4), (1.6, 1.3)]
    spread = np.array([4e-4 * np.eye(2), np.diag([np.inf, np.inf])])
    for k, spot in enumerate(spots):
        now = 0.13 * k
        positions = np.array([spot, (np.nan, np.nan)])
        valid = np.array([True, False])
        picture = Picture(now, np.array([1.5, 1.0, 0.0]), positions, spread, valid, ~valid & False)
        take_in(hunt, known, [picture], now)
    as_recorded([known.hypotheses[:, :5], known.tracks[:, :6]])


@pytest.mark.parametrize(
    ("colours", "cameras", "rate", "speed", "seeds"),
    [((0,), 1, 10.0, 0.3, 3), ((0,), 2, 5.0, 0.7, 4), ((0, 0), 3, 8.0, 0.3, 2)],
)
def test_trials_of_a_search_are_as_recorded(
    search, as_recorded, colours, cameras, rate, speed, seeds
):
    hunt = replace(search(*colours), speed=speed)
    trials = [
        run_occlusion_trial(
            hunt, cameras=cameras, rate=rate, seconds=30.0, camera_speed=0.3, seed=seed
        )
        for seed in range(seeds)
    ]
    assert sum(len(each.hidden) for each in trials) > 3
    as_recorded(trials, relative=1e-5)
