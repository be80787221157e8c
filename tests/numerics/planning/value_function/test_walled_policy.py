"""The policy of a table among walls: as quick as the programme beside it, and clear of them."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.planning.among_walls.planner import grid_within
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.arc_words.shortened import end_of
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.following import AT_REST, follow
from sightfield.systems.numerics.planning.value_function.obstacles import make_walls
from sightfield.systems.numerics.planning.value_function.rollout import roll_out
from sightfield.systems.numerics.planning.value_function.room import room_along, room_of
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.vehicle.footprint import covering_discs
from sightfield.systems.numerics.planning.vehicle.overlap import deepest_overlap

CART = Trailer()


@pytest.fixture(scope="module")
def rows(standing_rows):
    """A coarse table behind a wall of crop, and where it stands."""
    world, start, goal = standing_rows
    grid = grid_within(world, CART, goal, 0.3)
    return solve_value_function(CART, goal, grid, obstacles=world), world, start


def test_room_is_what_the_polygons_leave(standing_rows):
    world, _, goal = standing_rows
    cart = Trailer(length=1.2, hitch_offset=0.15, speed=1.5, turn_rate=1.25)
    discs = covering_discs(cart)
    walls = make_walls(world, discs, grid_within(world, cart, goal, 0.2), 4)
    start = (2.0, 1.7, 0.6, -0.4)
    turns = np.array([[1.5, 1.25], [1.5, -1.25], [1.5, 0.0]])
    word = ArcWord(turns, np.array([0.5, 0.9, 1.4]))
    room = room_along(walls, cart, start, word)
    rooms, slopes = room(word.durations)
    path = word_path(cart, start, word)
    # A corner, or the middle between walls, is off by less than the raster.
    assert rooms.min() == pytest.approx(-deepest_overlap(world, discs, path.states), abs=0.01)
    last = end_of(cart, start, word)
    assert rooms[-1] == pytest.approx(room_of(walls, last), abs=1e-12)
    for k in range(3):
        nudge = 1e-5 * np.eye(3)[k]
        rise = (room(word.durations + nudge)[0] - room(word.durations - nudge)[0]) / 2e-5
        # But where the nearest wall is another, or another disc is the nearest.
        assert np.quantile(np.abs(slopes[:, k] - rise), 0.9) < 1e-4
        assert np.abs(rise).max() > 0.1


@pytest.mark.parametrize("start", [(6.0, 2.6, 0.0, 0.0), (9.0, 4.0, 1.5, 0.3)])
def test_it_drives_as_quickly_as_the_programme_beside_it(rows, depth_in_walls, start):
    value, world, _ = rows
    driven = roll_out(value, start)
    assert driven.arrived
    assert value.goal.contains(driven.path.states[-1])
    assert depth_in_walls(world, driven.path) < 1e-3
    beside = plan_by_casadi(CART, start, value.goal, seeds=[driven.path], obstacles=world)
    assert driven.path.times[-1] <= beside.time * 1.005


def test_it_arrives_by_late_and_noisy_measurements_without_touching(rows):
    value, world, start = rows
    rng, period = np.random.default_rng(5), 0.05
    noise = [0.005, 0.005, math.radians(0.5), math.radians(0.5)]
    states, following = [np.array(start)] * 2, AT_REST
    for _ in range(400):
        measured = states[-2] + noise * rng.normal(size=4)
        options = {"period": period, "delay": period, "margin": 0.1, "trust": 0.3}
        following = follow(value, following, measured, **options)
        if not following.control.any() and value.goal.contains(states[-1]):
            break
        held = ArcWord(following.given[-2:][:1], np.array([period]))
        states.append(end_of(CART, states[-1], held))
    assert value.goal.contains(states[-1])
    assert deepest_overlap(world, covering_discs(CART), np.array(states)) < 0.0
    assert period * len(states) < 1.05 * roll_out(value, start).path.times[-1] + 0.2
