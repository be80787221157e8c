"""Every planner has a colour of its own, and near the goal is darker than far away."""

from itertools import combinations

import numpy as np

from sightfield.diagrams.planning.methods import METHODS
from sightfield.diagrams.planning.pictures.colours import (
    METHOD_COLOURS,
    line_width,
    time_colours,
)


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
