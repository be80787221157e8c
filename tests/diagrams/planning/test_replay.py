"""Carts on their ways in Meshcat: where they are, what they sweep, and the page."""

import math

import numpy as np
import pytest
import shapely
from pydrake.geometry import Meshcat

from sightfield.diagrams.planning.methods import PlanningQuestion
from sightfield.diagrams.planning.pictures import (
    drawbar_shape,
    swept_area,
    tractor_shape,
    trailer_shape,
)
from sightfield.diagrams.planning.replay import PlanningScene, write_planning_replay
from sightfield.diagrams.planning.verdict import ask_methods
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.plan import TrailerPath
from sightfield.systems.numerics.planning.trailer import Trailer


@pytest.fixture(scope="module")
def verdict():
    """The arcs of the thesis from (1, 1) to (4, 4), the trailer within one cell of its grid."""
    goal = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=(0.0, 0.0, 0.0, 0.251))
    return ask_methods(PlanningQuestion(start=(1.0, 1.0, 0.0, 0.0), goal=goal), ["primitive"])


def test_a_straight_cart_sweeps_a_straight_strip():
    cart = Trailer()
    path = TrailerPath(
        np.array([0.0, 3.0]),
        np.array([[0.0, 0.0, 0.0, 0.0], [3.0, 0.0, 0.0, 0.0]]),
        np.array([[1.0, 0.0]]),
    )
    x_low, y_low, x_high, y_high = swept_area(path, cart).bounds
    assert (x_low, x_high) == pytest.approx((-1.28, 3.5))
    assert (y_low, y_high) == pytest.approx((-0.21, 0.21))


def test_a_turned_cart_is_inside_what_it_sweeps(verdict):
    path = verdict.rows[0].plan.path
    area = swept_area(path, Trailer()).buffer(0.01)
    x, y, theta, beta = path.states[len(path.states) // 2]
    for shape, at, angle in (
        (tractor_shape(Trailer()), (x, y), theta),
        (
            trailer_shape(Trailer()),
            (x - math.cos(theta - beta), y - math.sin(theta - beta)),
            theta - beta,
        ),
    ):
        c, s = math.cos(angle), math.sin(angle)
        corners = shapely.get_coordinates(shape) @ np.array([[c, s], [-s, c]]) + at
        assert area.covers(shapely.Polygon(corners))


def test_the_cart_starts_and_ends_where_the_plan_does(verdict, meshcat_log):
    scene = PlanningScene(meshcat_log, verdict)
    scene.play()
    scene.finish_recording()
    frames = meshcat_log.keys["/planning/carts/primitive/tractor", "pose"]
    first, last = frames[min(frames)], frames[max(frames)]
    assert first.translation()[:2] == pytest.approx([1.0, 1.0])
    assert last.translation()[:2] == pytest.approx([4.0, 4.0], abs=1e-3)
    towed = meshcat_log.keys["/planning/carts/primitive/trailer", "pose"]
    assert towed[min(towed)].translation()[:2] == pytest.approx([0.0, 1.0])
    assert max(frames) / 30 == pytest.approx(verdict.rows[0].plan.time + 1, abs=0.1)


@pytest.mark.parametrize(
    ("methods", "options"),
    [
        (["casadi", "extremal", "value-function", "polished"], {}),
        (["primitive", "casadi"], {"walled": True, "tolerance": (0.0, 0.2, 0.1, 0.1)}),
        (["extremal"], {"tolerance": (0.2, math.inf, 0.1, 0.1)}),
    ],
    ids=["table", "walled", "none"],
)
def test_a_scene_is_as_recorded(methods, options, by_hand, as_recorded, meshcat_calls):
    scene = PlanningScene(Meshcat(), by_hand(*methods, **options))
    scene.play()
    scene.finish_recording()
    as_recorded(meshcat_calls, relative=1e-5, absolute=1e-7)


def test_shapes_are_as_recorded(by_hand, as_recorded):
    cart = Trailer(speed=1.3, length=1.7, hitch_offset=0.4)
    shapes = [make(cart) for make in (tractor_shape, trailer_shape, drawbar_shape)]
    as_recorded([shapely.get_coordinates(each) for each in shapes])
    path = by_hand("casadi").rows[0].plan.path
    area = swept_area(path, cart)
    as_recorded([area.area, area.length, area.bounds], "swept", relative=1e-5)


@pytest.mark.browser
def test_the_page_plays_without_complaints(verdict, tmp_path, new_page):
    file = write_planning_replay(tmp_path / "replay.html", verdict)
    watched = new_page()
    watched.page.goto(file.as_uri())
    watched.page.wait_for_function("typeof viewer !== 'undefined'")
    assert watched.page.title() == "Sightfield: plans"
    assert watched.complaints == []
