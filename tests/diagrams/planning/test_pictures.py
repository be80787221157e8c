"""Colours of planners and times, and slices of a value function."""

import math
from itertools import combinations

import numpy as np
import pytest
import shapely
from matplotlib.image import imread

from sightfield.diagrams.planning.methods import METHODS, PlanningQuestion
from sightfield.diagrams.planning.pictures import (
    METHOD_COLOURS,
    ValueSlice,
    band_levels,
    bands,
    extent,
    followed_row,
    line_width,
    save_value_picture,
    slices_along,
    time_colours,
)
from sightfield.diagrams.planning.replay import PlanningScene
from sightfield.diagrams.planning.verdict import PlanningVerdict, ask_methods
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function


def test_every_planner_has_a_colour_unlike_the_others():
    assert set(METHODS) <= set(METHOD_COLOURS)
    for one, other in combinations(METHOD_COLOURS.values(), 2):
        assert np.linalg.norm(np.subtract(one, other)) > 0.3


def test_the_farther_the_brighter():
    tints = time_colours(9)
    light = [sum(tints(k)[:3]) for k in range(9)]
    assert light[-1] > light[0]
    assert len(set(light)) == 9


def test_later_lines_are_thinner_and_still_lines():
    for count in (1, 2, 5, 9):
        widths = [line_width(k, count) for k in range(count)]
        assert widths == sorted(set(widths), reverse=True)
        assert min(widths) > 0.5


GOAL = Goal(state=(2.0, 1.5, 0.0, 0.0), tolerance=(0.5, 0.5, 0.63, 0.63))


@pytest.fixture(scope="module")
def verdict():
    """A coarse table, and the way down it."""
    question = PlanningQuestion(start=(0.0, 0.0, 0.0, 0.0), goal=GOAL, grid_step=0.5)
    return ask_methods(question, ["value-function"])


@pytest.fixture
def cone():
    """Distance from a place outside a disc of radius 3 that is unreachable beyond."""
    x = y = np.linspace(-4.0, 4.0, 161)
    times = np.hypot(*np.meshgrid(x, y))
    return ValueSlice(0.0, (0.0, 0.0, 0.0, 0.0), x, y, np.where(times > 3.0, np.inf, times))


def test_a_slice_has_the_carts_angles_and_says_what_is_left(verdict):
    value, row = verdict.value_function, followed_row(verdict)
    pieces = slices_along(
        value, verdict.shown[row.method], verdict.question.start, extent(value), 5
    )
    assert [piece.moment for piece in pieces] == pytest.approx(
        np.linspace(0.0, row.plan.time, 5).tolist()
    )
    assert pieces[0].state == verdict.question.start
    assert pieces[-1].state == pytest.approx(tuple(row.plan.path.states[-1]))
    for piece in pieces:
        i, j = 11, 9
        state = (piece.x[j], piece.y[i], *piece.state[2:])
        assert piece.times[i, j] == value.interpolated(np.array(state))


def test_without_a_way_the_slice_is_the_starts(verdict):
    start = (0.0, 0.0, 0.4, -0.2)
    (piece,) = slices_along(verdict.value_function, None, start, np.array([0, 0, 2, 2.0]), 5)
    assert piece.state == start


def test_the_extent_turns_with_the_table():
    grid = StateGrid.covering((-2.0, -4.0, 2.0, 4.0), 1.0)
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(1.0, 1.0, 1.3, 1.3))
    value = solve_value_function(Trailer(), goal, grid, polish=0)
    x_low, y_low, x_high, y_high = value.grid.bounds
    assert extent(value) == pytest.approx([x_low, y_low, x_high, y_high])
    turned = extent(value.moved(10.0, 0.0, math.pi / 2))
    assert turned == pytest.approx([10 - y_high, x_low, 10 - y_low, x_high])


def test_bands_are_rings_between_their_times(cone):
    areas = bands(cone, np.array([0.0, 1.0, 2.0, 3.0, 4.0]))
    for inner, area in enumerate(areas[:2]):
        assert area.area == pytest.approx(math.pi * ((inner + 1) ** 2 - inner**2), rel=0.01)
        assert area.covers(shapely.Point(inner + 0.5, 0.0))
    assert not areas[1].covers(shapely.Point(0.5, 0.0))


def test_what_is_unreachable_has_no_colour(cone):
    whole = shapely.union_all(bands(cone, np.array([0.0, 1.0, 2.0, 3.0, 4.0])))
    assert whole.area == pytest.approx(math.pi * 9, rel=0.05)
    assert not whole.intersects(shapely.Point(3.5, 0.0))
    nowhere = ValueSlice(0.0, cone.state, cone.x, cone.y, np.full_like(cone.times, np.inf))
    assert all(area.is_empty for area in bands(nowhere, band_levels([nowhere])))


def test_levels_hold_every_finite_time(cone):
    levels = band_levels([cone])
    assert levels[0] == 0.0
    assert levels[-1] >= 3.0
    assert np.ptp(np.diff(levels)) == pytest.approx(0.0, abs=1e-12)


def test_one_slice_after_the_other_is_shown(verdict, meshcat_log):
    scene = PlanningScene(meshcat_log, verdict)
    scene.play()
    scene.finish_recording()
    shown = []
    for k in range(12):
        keys = meshcat_log.keys[f"/planning/value/{k}", "visible"]
        shown.append(min(frame for frame, visible in keys.items() if visible))
    assert shown[0] == 0
    assert (np.diff(shown) > 0).all()


def test_the_picture_is_there_if_there_is_a_table(verdict, tmp_path):
    assert save_value_picture(tmp_path / "value.png", verdict)
    picture = imread(tmp_path / "value.png")[..., :3]
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    without = PlanningVerdict(verdict.question, verdict.lower_bound, ())
    assert not save_value_picture(tmp_path / "none.png", without)
    assert not (tmp_path / "none.png").exists()
