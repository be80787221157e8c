"""What a study changes in a Context is what the law then computes with."""

import numpy as np
import pytest
from pydrake.autodiffutils import AutoDiffXd

from sightfield.systems.harvest.teams import AugerTransfer, GrainCartTeam
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.machines import Cart
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.standoff.loop import ErrorModel, StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid
from sightfield.systems.planning import TractorTrailer
from sightfield.systems.standoff import BiasedRangeEstimator, StandoffClosedLoop, StandoffPid
from sightfield.systems.station.gates import AgeLimit
from sightfield.systems.station.stand_in_devices import CommandTimeout
from sightfield.systems.tracking.agent_team import AgentTeam, DifferentialDriveTeam
from sightfield.systems.tracking.evaders import (
    AdversarialEvaders,
    RandomWalkEvaders,
    WaypointEvaders,
)
from sightfield.systems.tracking.heading_controller import HeadingController, TurnFirstController
from sightfield.systems.tracking.pursuit_laws import ModifiedField, PursuitFieldController

POINTS = np.array([[0.5, 1.0], [-1.0, 2.0]])
POSES = np.array([[0.5, 1.0, 0.3], [-1.0, 2.0, -2.0]])
# A square with a block in it, round whose corner the second evader may go.
WORLD = make_world(
    [[0, 0], [4, 0], [4, 4], [0, 4]], [[[1.5, 1.5], [2.5, 1.5], [2.5, 2.5], [1.5, 2.5]]]
)
PURSUERS, EVADERS = [0.7, 0.9, 3.3, 0.8], [1.4, 0.8, 3.2, 1.4]
SEEN = {"pursuer_position": PURSUERS, "evader_position": EVADERS}
TEAMS = {"pursuers": 2, "evaders": 2}
# All see all: pairs, then each pursuer and each evader and every corner of the block.
SIGHT = {"sight": np.ones(4 + 2 * 4 + 2 * 4)}


def _trailer(**numbers):
    return TractorTrailer(Trailer(**numbers, reverse=True), (0.4, -0.3, 0.7, 0.5))


def _closed_loop(**numbers):
    curve = {name: numbers.pop(name) for name in "abc"}
    loop = StandoffLoop(**numbers, error=ErrorModel(**curve))
    return StandoffClosedLoop(loop, 1.2, 0.05)


def _pid(**gains):
    return StandoffPid(StandoffLoop(**gains), SampledPid(limit=5.0))


# A system by its numbers, values away from neutral ones to make it with, others to set, and inputs.
CASES = {
    "TractorTrailer": (
        _trailer,
        {"speed": 1.3, "turn_rate": 0.8, "length": 1.7, "hitch_offset": -0.2},
        {"speed": 0.9, "turn_rate": 0.6, "length": 0.7, "hitch_offset": 0.3},
        {"control": [1.1, 0.7]},
    ),
    "StandoffClosedLoop": (
        _closed_loop,
        {"kp": 3.0, "ki": 0.7, "kd": 0.2, "reference": 0.3, "a": 1.1, "b": -0.7, "c": 0.13},
        {"kp": 2.0, "ki": 0.9, "kd": 0.4, "reference": 0.2, "a": 0.9, "b": -0.5, "c": 0.11},
        {},
    ),
    "BiasedRangeEstimator": (
        lambda **curve: BiasedRangeEstimator(ErrorModel(**curve)),
        {"a": 1.1, "b": -0.7, "c": 0.13},
        {"a": 0.9, "b": -0.5, "c": 0.11},
        {"evader_position": [1.3], "pursuer_position": [0.2], "noise": [0.01]},
    ),
    "StandoffPid": (
        _pid,
        {"kp": 3.0, "ki": 0.7, "kd": 0.2, "reference": 0.3},
        {"kp": 2.0, "ki": 0.9, "kd": 0.4, "reference": 0.2},
        {"estimate": [0.75], "feed_forward": [0.05]},
    ),
    "AgentTeam": (
        lambda **numbers: AgentTeam(POINTS, **numbers),
        {"top_speed": 0.5},
        {"top_speed": 0.2},
        {"velocity": [0.3, 0.1, -0.6, 0.4]},
    ),
    "DifferentialDriveTeam": (
        lambda **numbers: DifferentialDriveTeam(POSES, **numbers, time_step=0.1),
        {"top_speed": 0.5, "top_turn_rate": 2.0},
        {"top_speed": 0.2, "top_turn_rate": 1.5},
        {"command": [0.6, 2.5, -0.3, 0.4]},
    ),
    "HeadingController": (
        lambda **numbers: HeadingController(2, **numbers),
        {"gain": 3.0},
        {"gain": 5.0},
        {"pose": POSES.ravel(), "velocity": [0.3, 0.1, -0.6, 0.4]},
    ),
    "TurnFirstController": (
        lambda **numbers: TurnFirstController(2, **numbers, period=0.1),
        {"gain": 3.0, "top_speed": 0.3},
        {"gain": 5.0, "top_speed": 300.0},
        {
            "pose": POSES.ravel(),
            "velocity": [0.3, 0.1, -0.6, 0.4],
            # More than the hundred-thousandth of the first top speed, less than of the second.
            "deflection": [1e-4, 1e-4],
            "right_of_way": [1.0, 0.0],
        },
    ),
    "ModifiedField": (
        lambda **numbers: ModifiedField(**TEAMS, **numbers),
        {"weight": 0.4, "top_speed": 0.3, "stand_off": 0.45, "fade": 0.4},
        {"weight": 0.7, "top_speed": 0.2, "stand_off": 0.35, "fade": 0.5},
        {**SEEN, "assignment": [0.0, 1.0], "field_velocity": [0.1, 0.2, -0.1, 0.3]},
    ),
    "RandomWalkEvaders": (
        lambda **numbers: RandomWalkEvaders(3, **numbers),
        {"top_speed": 0.3},
        {"top_speed": 0.2},
        {},
    ),
    "WaypointEvaders": (
        lambda **numbers: WaypointEvaders([[[1, 1], [2, 3]], [[2, 2]]], **numbers, period=0.1),
        {"top_speed": 0.3},
        {"top_speed": 5.0},
        {"evader_position": [0.8, 0.9, 0.1, 0.2]},
    ),
    "AdversarialEvaders": (
        lambda **numbers: AdversarialEvaders(WORLD, **TEAMS, **numbers),
        {"top_speed": 0.09, "speed_ratio": 0.3},
        {"top_speed": 0.2, "speed_ratio": 0.9},
        # Which corner is best depends on how fast the pursuers are.
        {
            "pursuer_position": [2.2, 3.7, 3.2, 0.1],
            "evader_position": [3.4, 0.2, 2.9, 0.8],
            **SIGHT,
        },
    ),
    "PursuitFieldController": (
        lambda **numbers: PursuitFieldController(WORLD, **TEAMS, **numbers),
        {"top_speed": 0.3, "speed_ratio": 0.3},
        {"top_speed": 0.2, "speed_ratio": 0.9},
        {**SEEN, **SIGHT, "assignment": [0.0, 1.0]},
    ),
    "AgeLimit": (
        lambda **numbers: AgeLimit(3, **numbers),
        {"limit": 0.1},
        {"limit": 0.3},
        {"age": [0.05, 0.2, 0.4]},
    ),
    "CommandTimeout": (
        lambda **numbers: CommandTimeout(2, **numbers),
        {"limit": 0.1},
        {"limit": 0.3},
        {"command": [0.1, 0.2, 0.3, 0.4], "stamp": [-0.2, -0.05]},
    ),
    "AugerTransfer": (
        lambda **numbers: AugerTransfer(combines=1, carts=1, cart=Cart(), **numbers),
        {"reach": 8.0},
        {"reach": 4.0},
        {
            "pose": [0.0, 0.0, 0.0],
            "state": [Cart().length + Cart().hitch_offset, 4.0, 0.0, 0.0],
            "wanted": [0.0],
            "mode": [1.0],
        },
    ),
    "GrainCartTeam": (
        lambda **numbers: GrainCartTeam(Cart(), [[0.0, 0.0, 0.3, 0.1]], **numbers, period=0.25),
        {"truck_rate": 300.0},
        {"truck_rate": 200.0},
        {"control": [1.0, 0.1], "received": [5000.0], "emptying": [1.0]},
    ),
}
# Whose law has derivatives by its numbers, on Drake's scalars.
SMOOTH = [
    "TractorTrailer",
    "StandoffClosedLoop",
    "BiasedRangeEstimator",
    "StandoffPid",
    "AgentTeam",
    "DifferentialDriveTeam",
    "HeadingController",
]


def law(system, context):
    """All that the numbers can act on: derivatives, what updates make of the state, outputs."""
    found = []
    if context.num_continuous_states():
        found.append(system.EvalTimeDerivatives(context).CopyToVector())
    if context.num_discrete_state_groups() and system.GetUniquePeriodicDiscreteUpdateAttribute():
        after = system.EvalUniquePeriodicDiscreteUpdate(context)
        found += [after.get_vector(i).CopyToVector() for i in range(after.num_groups())]
    for i in range(system.num_output_ports()):
        found.append(system.get_output_port(i).Eval(context))
    return np.concatenate([np.atleast_1d(each) for each in found])


def context_of(system, inputs):
    context = system.CreateDefaultContext()
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, np.asarray(value, dtype=float))
    if context.num_continuous_states() and hasattr(system, "loop"):
        context.SetContinuousState([0.9, 0.05])
    if hasattr(system, "sampled"):
        # Started, with an integral and a filtered miss.
        context.SetDiscreteState([0.3, 0.1, 1.0, 0.0])
    return context


def test_every_system_with_numbers_has_a_case(system_examples):
    has = {name for name, make in system_examples.items() if hasattr(make(), "parameters")}
    # These need tables or graphs to be made; they read one number, as the others do.
    assert has - set(CASES) == {
        "AgentInterest",
        "CrowdGuard",
        "LookaheadPursuit",
        "StandingCertificate",
        "ValueFunctionFeedback",
    }


@pytest.mark.parametrize("name", CASES)
def test_what_a_context_is_told_is_what_a_system_is_made_with(name):
    make, first, second, inputs = CASES[name]
    system, other = make(**first), make(**second)
    context = context_of(system, inputs)
    assert system.parameters(context)._asdict() == first
    before = law(system, context)
    system.parameters.set(context, **second)
    assert system.parameters(context)._asdict() == second
    np.testing.assert_array_equal(law(system, context), law(other, context_of(other, inputs)))
    # Back again, one number after another: each is looked at.
    for parameter, value in first.items():
        there = law(system, context)
        system.parameters.set(context, **{parameter: value})
        assert not np.array_equal(there, law(system, context)), parameter
    np.testing.assert_array_equal(law(system, context), before)


@pytest.mark.parametrize("name", SMOOTH)
def test_derivatives_by_the_numbers_are_those_of_finite_differences(name):
    make, values, _, inputs = CASES[name]
    system = make(**values)
    on_autodiff = system.ToAutoDiffXd()
    context = on_autodiff.CreateDefaultContext()
    plain = context_of(system, inputs)
    context.SetTimeStateAndParametersFrom(plain)
    for each, value in inputs.items():
        port = on_autodiff.GetInputPort(each)
        port.FixValue(context, [AutoDiffXd(number) for number in value])
    for i, (parameter, value) in enumerate(values.items()):
        unit = np.eye(len(values))[i]
        on_autodiff.parameters.set(context, **{parameter: AutoDiffXd(value, unit)})
    slopes = np.array([_derivatives(entry, len(values)) for entry in law(on_autodiff, context)])
    assert np.abs(slopes).max() > 0.01
    for i, (parameter, value) in enumerate(values.items()):
        there, step = [], 1e-6 * max(abs(value), 0.1)
        for sign in (1.0, -1.0):
            system.parameters.set(plain, **{parameter: value + sign * step})
            there.append(law(system, plain))
        system.parameters.set(plain, **{parameter: value})
        expected = (there[0] - there[1]) / (2 * step)
        np.testing.assert_allclose(slopes[:, i], expected, rtol=1e-6, atol=1e-8)


def _derivatives(entry, count):
    found = entry.derivatives()
    return found if len(found) else np.zeros(count)


def test_a_number_that_the_system_has_not_is_refused():
    system = AgentTeam(POINTS, top_speed=0.5)
    context = system.CreateDefaultContext()
    with pytest.raises(InvalidInput, match="`parameter` must be one of top_speed"):
        system.parameters.set(context, speed=0.2)


def test_a_clone_of_a_context_has_numbers_of_its_own():
    system = _trailer(length=1.7)
    context = system.CreateDefaultContext()
    clone = context.Clone()
    system.parameters.set(clone, length=0.5)
    assert system.parameters(context).length == 1.7
    assert system.parameters(clone).length == 0.5


def test_port_values_are_cached_until_a_number_changes():
    system = _trailer(length=1.7)
    context = context_of(system, {"control": [1.0, 0.2]})
    port = system.GetOutputPort("trailer_pose")
    before = port.Eval(context).copy()
    system.parameters.set(context, length=0.5)
    assert not np.array_equal(before, port.Eval(context))
