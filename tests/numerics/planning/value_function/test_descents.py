"""Paths that look far ahead, and promises that they do not keep."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.planners.from_table import plan_by_value_function
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.descents import descents
from sightfield.systems.numerics.planning.value_function.policy import inside, is_late

GOAL = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)


def random_starts(count, seed):
    rng = np.random.default_rng(seed)
    low, high = [-3, -3, -np.pi, -np.pi / 2], [3, 3, np.pi, np.pi / 2]
    return rng.uniform(low, high, (count, 4))


def pieces(path):
    return [(*control, t) for control, t in zip(path.controls, np.diff(path.times), strict=True)]


def test_the_controls_lead_into_the_box(solved):
    value = solved().moved(1.0, -2.0, 0.7)
    for start in random_starts(8, 1):
        for found in descents(value, start):
            driven = driven_path(Trailer(), start, pieces(found.path))
            np.testing.assert_allclose(driven.states[-1], found.path.states[-1], atol=1e-6)
            assert inside(value, found.path.states[-1])
            assert not inside(value, found.path.states[:-1]).any()


def test_ways_differ_in_kind_and_the_quickest_is_first(solved):
    seen = 0
    for start in random_starts(8, 2):
        found = descents(solved(), start)
        seen = max(seen, len(found))
        times = [each.time for each in found]
        assert times == sorted(times)
        assert len({(each.first_turn, each.winding) for each in found}) == len(found)
        for each in found:
            turns = each.path.controls[:, 1]
            assert each.first_turn == (turns[turns != 0][0] if turns.any() else 0)
            assert each.winding == round(each.path.states[-1, 2] / (2 * np.pi))
    assert seen >= 2


def test_a_mirrored_start_is_driven_as_quickly(solved):
    for start in random_starts(4, 3):
        one, other = (descents(solved(), side * start)[0].time for side in (1, [1, -1, -1, -1]))
        assert one == pytest.approx(other, rel=0.02)


def test_straight_ahead_it_drives_straight(solved):
    (found, *_) = descents(solved(), (-3.0, 0.0, 0.0, 0.0))
    # The box begins at 0.2, and is looked for LOOKS times a step.
    assert found.time == pytest.approx(2.8, abs=0.04)
    assert found.first_turn == 0


def test_backwards_too(solved):
    (found, *_) = descents(solved(reverse=True, polish=0), (1.0, 0.0, 0.0, 0.0))
    assert found.time == pytest.approx(0.8, abs=0.04)
    assert (found.path.controls[:, 0] == -1).all()


def test_off_the_table_there_is_no_way(solved):
    assert descents(solved(), (9.0, 0.0, 0.0, 0.0)) == []


def test_only_paths_that_keep_the_promise_have_converged(solved):
    plans = [
        plan_by_value_function(Trailer(), start, GOAL, value=solved())
        for start in random_starts(24, 5)
    ]
    for plan in plans:
        late = is_late(solved(), plan.notes["time_to_go"], plan.time)
        assert (plan.status, plan.converged) == (
            ("arrived later than promised", False) if late else ("arrived", True)
        )
        assert GOAL.miss(plan.path.states[-1]) == (0, 0, 0, 0)
    # Where the table is wrong beside a barrier, it promises too much.
    assert sum(plan.converged for plan in plans) >= 23


def test_a_path_later_than_promised_has_not_converged(solved):
    """A table that promises half the time makes every path one that cannot be believed."""
    value = solved()
    # Words are paths, and promise what they keep: without them the table is interpolated.
    halved = replace(value, table=value.table / 2, words=None)
    plan = plan_by_value_function(Trailer(), (-3.0, 1.0, 0.5, 0.0), GOAL, value=halved)
    assert plan.status == "arrived later than promised"
    assert not plan.converged
    assert plan.path is not None
