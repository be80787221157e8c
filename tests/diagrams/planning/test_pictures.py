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
    save_paths_picture,
    save_states_picture,
    save_sweep_picture,
    save_value_picture,
    slices_along,
    time_colours,
)
from sightfield.diagrams.planning.replay import PlanningScene
from sightfield.diagrams.planning.sweep import DirectionSweep
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


@pytest.mark.parametrize(
    ("methods", "options"),
    [
        (["casadi", "extremal", "value-function", "polished", "primitive"], {}),
        (["casadi", "value-function"], {"walled": True}),
        (["extremal"], {"tolerance": (0.0, 0.2, 0.1, 0.1)}),
        (["polished"], {"tolerance": (math.inf, 0.2, 0.1, 0.1)}),
    ],
    ids=["five", "walled", "none", "there"],
)
def test_pictures_are_as_recorded(methods, options, by_hand, tmp_path, as_recorded, saved_pictures):
    verdict = by_hand(*methods, **options)
    save_paths_picture(tmp_path / "paths.png", verdict)
    if "casadi" not in methods or "extremal" in methods:
        save_states_picture(tmp_path / "states.png", verdict)
    as_recorded(saved_pictures)


def test_times_to_go_among_walls_are_drawn_as_recorded(
    by_hand, tmp_path, as_recorded, saved_pictures
):
    verdict = by_hand("casadi", "value-function", walled=True)
    assert save_value_picture(tmp_path / "value.png", verdict)
    told = saved_pictures["value.png"].plain()
    as_recorded([told["size"], told["texts"], told["axes"][1], told["axes"][5:]])


def test_a_picture_of_a_sweep_is_as_recorded(tmp_path, as_recorded, saved_pictures):
    sweep = DirectionSweep(
        ratios=np.array([0.5, 1.3, 2.1]),
        times={"casadi": np.array([5.1, 6.2, 7.4]), "primitive": np.array([5.3, np.nan, 8.0])},
        lower_bounds=np.array([4.6, 5.9, 7.1]),
        tolerance=(0.2, 0.3, 0.0, math.inf),
    )
    save_sweep_picture(tmp_path / "sweep.png", sweep)
    as_recorded(saved_pictures)


def test_without_a_path_the_slice_is_as_recorded(by_hand, as_recorded):
    verdict = by_hand("value-function")
    value = verdict.value_function
    (piece,) = slices_along(
        value, None, verdict.question.start, np.array([-1.0, -0.5, 0.2, 2.1]), 4
    )
    as_recorded(piece)
    pieces = slices_along(
        value, verdict.shown["value-function"], (0, 0, 0, 0), np.array([0.0, 0.0, 0.1, 3.0]), 4
    )
    as_recorded(pieces, "along a way")
    levels = band_levels(pieces)
    as_recorded([levels, [area.area for area in bands(pieces[1], levels)]], "bands")
    as_recorded(extent(value), "extent")
    assert band_levels([])[-1] >= 1.0
    assert followed_row(by_hand("extremal")) is None
    assert followed_row(by_hand("primitive", "casadi", "value-function")).method == "value-function"
    assert followed_row(by_hand("casadi", "primitive", tabled=False)).method == "primitive"
