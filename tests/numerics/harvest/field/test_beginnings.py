"""Loops are begun one behind the other, so that nobody waits a lap for the crop on the left."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.links import Passable, link_off
from sightfield.systems.numerics.harvest.field.stubble import Stubble
from sightfield.systems.numerics.harvest.field.swept_cells import bare_cells

HEADER, RADIUS, COMBINES = 6.0, 6.0, 4


@pytest.fixture(scope="module")
def plan():
    return plan_coverage(Field.rectangle(320.0, 260.0), HEADER, RADIUS, COMBINES)


def starts_of(plan):
    """Where each loop is begun, in turn, shape (loops, 2)."""
    found = {}
    for path in plan.paths:
        for number in np.unique(path.loops[path.loops >= 0]).tolist():
            found[number] = path.points[np.argmax(path.loops == number)]
    loops = sum(ring >= 0 for ring in plan.rings)
    return np.array([found[number] for number in range(loops)])


def test_each_loop_is_begun_just_behind_the_one_before(plan):
    steps = np.hypot(*np.diff(starts_of(plan), axis=0).T)
    # All but the first of the second lap, which comes from the corner where the field is entered.
    assert (np.delete(steps, COMBINES - 1) < 3.0 * HEADER).all()
    assert steps.max() < 8.0 * HEADER


def test_combines_wait_little_for_one_another():
    plan = plan_coverage(Field.rectangle(400.0, 400.0), HEADER, RADIUS, COMBINES)
    ways = np.array([path.length for path in plan.paths])
    assert plan.timeline.waits.sum() < 0.05 * ways.sum()
    assert plan.covered_fraction > 0.99


CIRCLE = np.linspace(0.0, -2.0 * np.pi, 600, endpoint=False)
# Clockwise round the origin, 40 m off, from the east on.
LINE = 40.0 * np.column_stack([np.cos(CIRCLE), np.sin(CIRCLE)]), CIRCLE - np.pi / 2


def passable_but(taboo):
    world = Field.rectangle(10.0, 10.0).world
    ground = shapely.Point(0.0, 0.0).buffer(100.0)
    return Passable(ground, taboo, Stubble(bare_cells(world, 1.0), HEADER))


def test_a_line_is_left_where_way_and_cost_are_least():
    inner = 0.5 * LINE[0][::50]
    ends = np.column_stack([inner, LINE[1][::50]])
    costs = 2.0 * 40.0 * np.abs(CIRCLE[::50])
    leaves = list(range(0, 600, 20))
    index, track = link_off(LINE, 0, leaves, ends, RADIUS, passable_but(shapely.Polygon()), costs)
    assert track.points[0] == pytest.approx(LINE[0][0], abs=1e-9)
    assert track.points[-1] == pytest.approx(inner[index], abs=1e-6)
    alone = [
        link_off(LINE, 0, [on], ends, RADIUS, passable_but(shapely.Polygon()), costs)
        for on in leaves
    ]
    best = min(way.length + costs[end] for end, way in alone)
    assert track.length + costs[index] == pytest.approx(best, rel=1e-6)


def test_a_line_is_not_driven_on_through_what_is_taboo():
    wall = shapely.box(-60.0, -22.0, 60.0, -18.0)
    ends = np.array([[0.0, -30.0, np.pi]])
    passable = passable_but(wall)
    assert link_off(LINE, 0, [0, 100, 200], ends, RADIUS, passable, np.zeros(1)) is None
    found = link_off(LINE, 80, [100, 120], ends, RADIUS, passable, np.zeros(1))
    assert found is not None
    assert not shapely.LineString(found[1].points).intersects(wall.buffer(-0.1))
