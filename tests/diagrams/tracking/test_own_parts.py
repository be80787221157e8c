"""Parts of one's own in a game of ours: a rule, an assignment, an evasion."""

import numpy as np
import pytest
from pydrake.systems.framework import LeafSystem

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import TrackingGame, set_up_game
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.assignment.baselines import nearest

PURSUERS, EVADERS = 3, 4


@pytest.fixture(scope="module")
def game() -> TrackingGame:
    """A few seconds of three pursuers and four evaders."""
    path = find_scenario("thesis_3v4")
    settings = ("seconds=2", "pursuers.assignment=nearest")
    return set_up_game(load_scenario(TrackingScenario, path, settings))


class Part(LeafSystem):
    """A part with inputs by name, and one output that a function of them gives."""

    def __init__(self, inputs, output, size, law):
        super().__init__()
        ports = [self.DeclareVectorInputPort(name, count) for name, count in inputs.items()]

        def calc(context, result):
            result.set_value(law(*(port.Eval(context) for port in ports)))

        self.DeclareVectorOutputPort(output, size, calc)


POSITIONS = {"pursuer_position": 2 * PURSUERS, "evader_position": 2 * EVADERS}


def nearest_in_sight(pursuers, evaders, sight):
    offsets = pursuers.reshape(-1, 1, 2) - evaders.reshape(1, -1, 2)
    seen = sight[: PURSUERS * EVADERS].reshape(PURSUERS, EVADERS) > 0.5
    distances = np.where(seen, np.hypot(offsets[..., 0], offsets[..., 1]), np.inf)
    return np.where(seen.any(axis=1), distances.argmin(axis=1), -1)


def test_a_function_of_ones_own_assigns_like_the_rule_that_it_repeats(game):
    ours, own = run_tracking(game), run_tracking(game, assignment=lambda view: nearest(view))
    np.testing.assert_array_equal(own.log["assignment"], ours.log["assignment"])


def test_a_system_of_ones_own_assigns_like_the_rule_that_it_repeats(game):
    ours = run_tracking(game)
    corners = len(game.world.corners)
    sight = PURSUERS * EVADERS + (PURSUERS + EVADERS) * corners
    part = Part({**POSITIONS, "sight": sight}, "assignment", PURSUERS, nearest_in_sight)
    own = run_tracking(game, assignment=part)
    np.testing.assert_array_equal(own.log["pursuer_position"], ours.log["pursuer_position"])


def test_evaders_of_ones_own_run_where_they_are_told_and_may_know_who_chases_them(game):
    def flee(assignment):
        chased = np.isin(np.arange(EVADERS), assignment)
        return np.column_stack([0.05 * chased, np.zeros(EVADERS)]).ravel()

    run = run_tracking(game, evasion=Part({"assignment": PURSUERS}, "velocity", 2 * EVADERS, flee))
    chased = np.isin(np.arange(EVADERS), run.log["assignment"][0])
    assert chased.any()
    assert not chased.all()
    np.testing.assert_allclose(run.log["evader_velocity"][0, :, 0], 0.05 * chased)


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (
            {"assignment": Part({"wind": 2}, "assignment", 3, lambda wind: wind)},
            r"`assignment: input port` must be one of pursuer_position, evader_position, sight; "
            r"got wind",
        ),
        (
            {"assignment": Part(POSITIONS, "targets", 3, lambda *_: np.zeros(3))},
            r"`assignment` must have an output port assignment; got none",
        ),
        (
            {"evasion": Part(POSITIONS, "speed", 8, lambda *_: np.zeros(8))},
            r"`evasion` must have an output port velocity; got none",
        ),
        (
            {"assignment": lambda view: [0, 1]},
            r"`rule` must return an evader, or -1, for each of 3 pursuers; got \[0, 1\]",
        ),
        (
            {"assignment": lambda view: np.array([0, 4, 1])},
            r"`assignment` must name evaders from 0 to 3, or -1; got \[0.0, 4.0, 1.0\]",
        ),
        (
            {"assignment": lambda view: np.array([0, np.nan, 1])},
            r"`assignment` must name evaders from 0 to 3, or -1; got \[0.0, nan, 1.0\]",
        ),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(game, parts, message):
    with pytest.raises(InvalidInput, match=message):
        run_tracking(game, **parts)


def test_a_port_of_another_size_is_refused(game):
    part = Part({"evader_position": 6}, "velocity", 2 * EVADERS, lambda _: np.zeros(8))
    with pytest.raises(RuntimeError, match="Mismatched vector sizes"):
        run_tracking(game, evasion=part)
