"""A goal's box turns with the goal, and all that reach for it mean the same box."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.arc_words.quickest import quickest_word, word_path
from sightfield.systems.numerics.planning.footprint import covering_discs, walls_part
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.lower_bound import lower_bound
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.planners.from_table import grid_within
from sightfield.systems.numerics.planning.planners.thesis_scheme import solve_by_averaging
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function

# Longer than wide, so that it matters how it lies.
WIDTHS = (0.9, 0.25, 0.6, 0.6)
LYING = Goal(state=(3.0, 2.0, 0.0, 0.1), tolerance=WIDTHS)
TURNED = Goal(state=(-1.0, 4.0, 0.7, 0.1), tolerance=WIDTHS)
CART = Trailer()


def turned(states):
    """States that are to the turned goal what they were to the lying one."""
    return TURNED.from_frame(LYING.to_frame(states))


def random_states(count, seed=3):
    rng = np.random.default_rng(seed)
    return rng.uniform([-1, -2, -3, -1], [7, 6, 3, 1], (count, 4))


def test_the_box_lies_along_the_goals_heading():
    ahead = [-1.0 + 0.8 * math.cos(0.7), 4.0 + 0.8 * math.sin(0.7), 0.7, 0.1]
    aside = [-1.0 - 0.3 * math.sin(0.7), 4.0 + 0.3 * math.cos(0.7), 0.7 + math.tau, 0.1]
    assert TURNED.contains(ahead)
    assert not TURNED.contains(aside)
    assert TURNED.miss(aside) == pytest.approx((0, 0.05, 0, 0), abs=1e-12)


def test_frames_are_there_and_back():
    states = random_states(50)
    np.testing.assert_allclose(TURNED.from_frame(TURNED.to_frame(states)), states, atol=1e-12)
    np.testing.assert_allclose(TURNED.gaps(turned(states)), LYING.gaps(states), atol=1e-12)


def test_the_corners_are_those_of_what_it_contains():
    box = shapely.Polygon(TURNED.corners())
    assert box.exterior.is_ccw
    assert box.area == pytest.approx(4 * 0.9 * 0.25)
    places = np.random.default_rng(0).uniform([-2.5, 2.5], [0.5, 5.5], (500, 2))
    states = np.column_stack([places, np.full((500, 2), TURNED.state[2:])])
    inside = shapely.covers(box, shapely.points(places))
    np.testing.assert_array_equal(inside, TURNED.contains(states))


@pytest.mark.parametrize("reverse", [False, True])
def test_turning_the_question_changes_no_bound(reverse):
    trailer = Trailer(reverse=reverse)
    for start in random_states(4):
        one = lower_bound(trailer, start, LYING)
        assert lower_bound(trailer, turned(start), TURNED) == pytest.approx(one, abs=2e-3)


def test_the_programme_ends_in_the_turned_box_as_soon():
    for start in random_states(3):
        one = plan_by_casadi(CART, start, LYING)
        other = plan_by_casadi(CART, turned(start), TURNED)
        assert one.converged
        assert other.time == pytest.approx(one.time, abs=1e-6)
        assert max(TURNED.miss(other.path.states[-1])) < 1e-8
        np.testing.assert_array_equal(other.path.states[0], turned(start))


def test_words_enter_the_turned_box():
    for start in random_states(20):
        one = quickest_word(CART, start, LYING)
        other = quickest_word(CART, turned(start), TURNED)
        assert (one is None) == (other is None)
        if one is not None:
            assert other.time == pytest.approx(one.time, abs=1e-5)
            end = word_path(CART, turned(start), other).states[-1]
            assert max(TURNED.miss(end)) < 2e-3


def test_a_table_on_a_grid_of_the_world_means_the_box_that_a_turned_table_means():
    goal = Goal(state=(0.3, 0.0, 0.7, 0.0), tolerance=(1.3, 0.45, 0.9, 0.9))
    grid = StateGrid.covering((-2.0, -2.0, 2.0, 2.0), 0.4)
    nodes = np.stack(np.meshgrid(*grid.axes(), indexing="ij"), axis=-1).transpose(2, 3, 1, 0, 4)
    inside = goal.contains(nodes)
    for solved in (solve_value_function(CART, goal, grid), solve_by_averaging(CART, goal, grid)):
        np.testing.assert_array_equal(solved.table == 0.0, inside)


def test_walls_part_the_start_from_the_turned_box():
    """Two rooms: a long box across the wall between them reaches into both."""
    rooms = [(-4, -4), (1, -4), (1, 3.9), (1.2, 3.9), (1.2, -4), (4, -4), (4, 4), (-4, 4)]
    world = make_world(rooms)
    discs = covering_discs(CART)
    start = (-2.0, 0.0, 0.0, 0.0)
    long = (1.7, 0.2, 0.5, 0.5)
    along = Goal(state=(2.2, 0.0, 0.0, 0.0), tolerance=long)
    across = Goal(state=(2.2, 0.0, math.pi / 2, 0.0), tolerance=long)
    assert not walls_part(world, discs, start, along)
    assert walls_part(world, discs, start, across)


def test_among_walls_turning_the_world_turns_the_answer():
    corners = np.array([(-3.0, -3.0), (8.0, -3.0), (8.0, 6.0), (-3.0, 6.0)])
    wall = np.array([(1.0, -3.0), (1.4, -3.0), (1.4, 2.2), (1.0, 2.2)])
    start = np.array([-1.0, 0.0, 0.3, 0.2])

    def moved(points):
        states = np.column_stack([points, np.zeros((len(points), 2))])
        return [tuple(place) for place in turned(states)[:, :2].tolist()]

    field = make_world(corners.tolist(), [wall])
    one = plan_by_casadi(CART, start, LYING, intervals=40, obstacles=field)
    world = make_world(moved(corners), [moved(wall)])
    other = plan_by_casadi(CART, turned(start), TURNED, intervals=40, obstacles=world)
    assert one.converged
    assert other.converged
    assert other.time == pytest.approx(one.time, rel=3e-3)
    assert max(TURNED.miss(other.path.states[-1])) < 1e-8
    grid = grid_within(world, CART, TURNED, 0.4)
    assert grid.holds(*TURNED.corners()[0])
