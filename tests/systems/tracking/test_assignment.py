"""The assignment as a system in a diagram: who knows what."""

import re

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.tracking.assignment import Assignment
from sightfield.systems.tracking.line_of_sight import LineOfSight

WORLD = make_world([[0, 0], [4, 0], [4, 4], [0, 4]], [[[1, 1.5], [3, 1.5], [3, 2.5], [1, 2.5]]])
SIZES = {"pursuers": 2, "evaders": 2}
PURSUERS, EVADERS = [0.5, 0.5, 3.5, 0.5], [2.0, 0.1, 1.1, 1.4]


def assigned(**options):
    """What the system says where both pursuers see both evaders."""
    sight, system = LineOfSight(WORLD, **SIZES), Assignment(WORLD, **SIZES, **options)
    seen, context = sight.CreateDefaultContext(), system.CreateDefaultContext()
    for each, where in ((sight, seen), (system, context)):
        each.GetInputPort("pursuer_position").FixValue(where, PURSUERS)
        each.GetInputPort("evader_position").FixValue(where, EVADERS)
    system.GetInputPort("sight").FixValue(context, sight.GetOutputPort("sight").Eval(seen))
    return np.asarray(system.GetOutputPort("assignment").Eval(context)).tolist()


@pytest.mark.parametrize("rule", ["borda_min", "borda_max", "kemeny_max", "hungarian"])
def test_with_a_radio_that_reaches_all_each_evader_has_its_pursuer(rule):
    together = assigned(rule=rule)
    assert sorted(together) == [0, 1]
    assert assigned(rule=rule, radio_range=3.0) == together


@pytest.mark.parametrize("rule", ["borda_max", "copeland_max", "kemeny_max", "dowdall_max"])
def test_out_of_earshot_both_go_for_the_riskiest(rule):
    assert assigned(rule=rule, radio_range=2.9) == assigned(rule="own_riskiest")
    assert len(set(assigned(rule=rule, radio_range=2.9))) == 1


@pytest.mark.parametrize("radio_range", [np.inf, 5.0])
@pytest.mark.parametrize("hold", ["none", "until_lost", "cost"])
@pytest.mark.parametrize(
    "answer",
    [[0.5, 1], [1.9, 1.0], [-0.5, 0], [np.nan, 0], [True, False], ["0", "1"], [None, 0], 0, [0]],
    ids=str,
)
def test_a_rule_that_names_no_evader_is_refused(answer, hold, radio_range):
    message = r"`rule` must return an evader from 0 to 1, or -1, for each of 2 pursuers; got "
    with pytest.raises(InvalidInput, match=message + re.escape(str(np.asarray(answer).tolist()))):
        assigned(rule=lambda _: answer, hold=hold, period=0.1, radio_range=radio_range)


def test_a_rule_may_answer_with_floats_that_are_whole():
    assert assigned(rule=lambda _: [1.0, -1.0]) == [1, -1]


def test_a_range_below_nothing_is_refused():
    with pytest.raises(InvalidInput, match="`radio_range` must be zero or positive; got -1"):
        Assignment(WORLD, **SIZES, radio_range=-1.0)
