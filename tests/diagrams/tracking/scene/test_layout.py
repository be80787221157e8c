"""Map and panel share the view, whatever the shape and the scale of the world."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.diagrams.tracking.scene.layout import make_layout

ASPECT = 16 / 9


@given(
    x=st.floats(-100, 100),
    y=st.floats(-100, 100),
    width=st.floats(0.5, 200),
    height=st.floats(0.5, 200),
)
def test_the_panel_stands_left_of_the_map_and_both_fit_the_view(x, y, width, height):
    layout = make_layout((x, y, x + width, y + height), 0.1)
    left, bottom, right, top = layout.panel_bounds
    assert right < x - layout.wall
    assert top - bottom <= layout.span
    assert height + 2 * layout.wall <= layout.span
    assert (x + width + layout.wall) - left <= ASPECT * layout.span
    assert bottom + top == pytest.approx(2 * y + height)


@given(scale=st.floats(0.01, 100))
def test_everything_scales_with_the_world(scale):
    bounds = np.array([1.0, 2.0, 5.0, 5.0])
    one, many = make_layout(bounds, 0.12), make_layout(scale * bounds, scale * 0.12)
    for name in ("span", "robot_radius", "line", "wall"):
        assert getattr(many, name) == pytest.approx(scale * getattr(one, name))
    assert many.panel_bounds == pytest.approx(scale * np.array(one.panel_bounds))


def test_robots_have_their_own_size_where_it_can_be_seen():
    assert make_layout((0, 0, 4, 4), 0.16).robot_radius == 0.16
    layout = make_layout((0, 0, 80, 60), 0.16)
    assert layout.robot_radius > 0.16
    # At least 7 pixels of 720.
    assert layout.robot_radius / layout.span * 720 > 7


@pytest.mark.parametrize("width", [2.0, 4.0, 100.0])
def test_floor_obstacles_lines_and_robots_rise_above_one_another(width):
    layout = make_layout((0, 0, width, 4), 0.1)
    floor = [layout.level(k) for k in ("paper", "polygon", "field", "trails", "boundaries", "ink")]
    lines = [layout.level(k) for k in ("sight", "chases")]
    heights = [*floor, layout.obstacle_height, *lines, layout.robot_height]
    assert heights == sorted(set(heights))
    assert heights[0] == 0
