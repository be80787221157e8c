"""Followers come two header widths nearer with every side."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.spacing import (
    gap_on_side,
    least_initial_gap,
    most_sides,
)


def test_the_gap_shrinks_by_two_headers_a_side():
    assert [gap_on_side(300.0, 25.0, side) for side in (1, 2, 5)] == [300.0, 250.0, 100.0]


@pytest.mark.parametrize("sides", [1, 2, 7, 20])
def test_the_least_initial_gap_lasts_for_just_as_many_sides(sides):
    initial = least_initial_gap(30.0, 12.5, sides)
    assert gap_on_side(initial, 12.5, sides) == pytest.approx(30.0)
    assert most_sides(initial, 30.0, 12.5) == sides
    assert most_sides(initial - 0.01, 30.0, 12.5) == sides - 1


def test_combines_on_a_planned_rectangle_keep_to_it():
    """Gaps measured on the first laps of two combines, amid the sides of the follower's ring."""
    header = 25.0
    plan = plan_coverage(Field.rectangle(400.0, 275.0), header, 10.0, 2, spacing=500.0)
    follower = plan.paths[1]
    rows = plan.gaps[1]
    rows = rows[follower.loop_at(rows[:, 0]) == 1]
    poses = follower.pose_at(rows[:, 0])
    gaps = []
    for side in ("y_low", "x_low", "y_high", "x_high"):
        axis, value = {"y": (1, (37.5, 237.5)), "x": (0, (37.5, 362.5))}[side[0]]
        wanted = value[side.endswith("high")]
        on_side = np.abs(poses[:, axis] - wanted) < 1e-6
        other = poses[on_side, 1 - axis]
        middle = np.abs(other - (200.0, 137.5)[axis == 0]) < 40.0
        gaps.append(float(np.median(rows[on_side, 1][middle])))
    np.testing.assert_allclose(-np.diff(gaps), 2 * header, atol=2.0)


@pytest.mark.parametrize(
    ("function", "arguments", "name"),
    [
        (gap_on_side, (-1.0, 5.0, 1), "initial_gap"),
        (gap_on_side, (1.0, 0.0, 1), "header_width"),
        (gap_on_side, (1.0, 5.0, 0), "side"),
        (least_initial_gap, (1.0, 5.0, 0), "sides"),
        (most_sides, (1.0, float("nan"), 5.0), "least_gap"),
    ],
)
def test_absurd_numbers_are_refused_by_name(function, arguments, name):
    with pytest.raises(InvalidInput, match=rf"^`{name}` must"):
        function(*arguments)
