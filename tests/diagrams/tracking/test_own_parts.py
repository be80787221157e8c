"""Parts of one's own in a game of ours: a rule, an assignment, a pursuit, an evasion."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.game import TrackingGame, set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import RobotTeam, TrackingScenario
from sightfield.diagrams.tracking.team_ports import AddTeam
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.assignment.rules import nearest
from sightfield.systems.tracking.pursuit_laws import PursuitFieldController

PURSUERS, EVADERS = 3, 4


@pytest.fixture(scope="module")
def game() -> TrackingGame:
    """A few seconds of three pursuers and four evaders."""
    path = find_scenario("thesis_3v4")
    settings = ("seconds=2", "pursuers.assignment=nearest")
    return set_up_game(load_scenario(TrackingScenario, path, settings))


@pytest.mark.parametrize("starts", [[[1.0, 1.0, 0.0]], [[1.0, 1.0], [2.0, 2.0]], [], [1, 2, 3]])
@pytest.mark.parametrize("model", ["point", "differential_drive"])
def test_a_team_has_a_pose_for_each_robot(game, model, starts):
    team = RobotTeam(model=model, top_speed=0.3, count=2)
    with pytest.raises(InvalidInput, match=r"`starts` must have shape \(2, 3\), a pose a robot"):
        AddTeam(DiagramBuilder(), "pursuer", team, starts, game.pursuer_regions, 0.05)


@pytest.mark.parametrize("start", [(-1.0, 1.0), (float("nan"), 1.0)])
def test_no_team_starts_where_it_cannot_be(game, start):
    team = RobotTeam(top_speed=0.3, count=2)
    starts = [[*game.pursuer_starts[0]], [*start, 0.0]]
    with pytest.raises(InvalidInput, match="`starts` must lie in the regions of the team"):
        AddTeam(DiagramBuilder(), "pursuer", team, starts, game.pursuer_regions, 0.05)


@pytest.mark.parametrize("count", [1.5, float("nan")])
def test_no_team_has_part_of_a_robot(count):
    with pytest.raises(InvalidInput, match="`count` must be a whole number"):
        RobotTeam(top_speed=0.3, count=count)


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


def positions_after(diagram, seconds):
    """Where both teams are after a while, and what the pursuers wish for at the end."""
    simulator = Simulator(diagram)
    simulator.AdvanceTo(seconds)
    names = ("pursuer_position", "evader_position", "pursuer_velocity")
    return [diagram.GetOutputPort(name).Eval(simulator.get_context()) for name in names]


def pursuit_like_ours(game):
    """The scenario's own pursuit, made by hand."""
    scenario = game.scenario
    return PursuitFieldController(
        game.world,
        pursuers=PURSUERS,
        evaders=EVADERS,
        top_speed=scenario.pursuers.top_speed,
        speed_ratio=scenario.speed_ratio,
        field=scenario.pursuers.field,
        risk_vectors=scenario.pursuers.risk_vectors,
        period=scenario.period,
    )


def test_a_pursuit_of_ones_own_plays_like_the_one_that_it_repeats(game):
    ours = positions_after(MakeTracking(game), 2.0)
    own = positions_after(MakeTracking(game, pursuit=pursuit_like_ours(game)), 2.0)
    for mine, other in zip(own, ours, strict=True):
        np.testing.assert_array_equal(mine, other)


def test_pursuers_of_ones_own_run_where_they_are_told(game):
    # Each straight at its evader, at half of its speed.
    def chase(pursuers, evaders, assignment):
        way = evaders.reshape(-1, 2)[assignment.astype(int)] - pursuers.reshape(-1, 2)
        way *= 0.15 / np.hypot(way[:, 0], way[:, 1])[:, None]
        return np.where(assignment[:, None] >= 0, way, 0.0).ravel()

    inputs = {**POSITIONS, "assignment": PURSUERS}
    part = Part(inputs, "velocity", 2 * PURSUERS, chase)
    steady = replace(game.scenario, pursuers=replace(game.scenario.pursuers, smoothing=0.0))
    diagram = MakeTracking(set_up_game(steady), pursuit=part)
    context = diagram.CreateDefaultContext()
    assignment = diagram.GetOutputPort("assignment").Eval(context)
    at = game.pursuer_starts[:, :2].ravel(), game.evader_starts[:, :2].ravel()
    wished = diagram.GetOutputPort("pursuer_velocity").Eval(context)
    np.testing.assert_allclose(wished, chase(*at, assignment), atol=1e-12)
    assert np.hypot(*wished.reshape(-1, 2).T).max() == pytest.approx(0.15)
    _, _, later = positions_after(diagram, 1.0)
    assert not np.allclose(later, wished)


@pytest.mark.parametrize(
    ("part", "message"),
    [
        (
            Part({"wind": 2}, "velocity", 6, lambda wind: np.zeros(6)),
            r"`pursuit: input port` must be one of pursuer_position, evader_position, sight, "
            r".*assignment.*; got wind",
        ),
        (
            # What the pursuers wish for is not known before they are asked.
            Part({"velocity": 6}, "velocity", 6, lambda velocity: velocity),
            r"`pursuit: input port` must be one of .*; got velocity",
        ),
        (
            Part(POSITIONS, "speed", 6, lambda *_: np.zeros(6)),
            r"`pursuit` must have an output port velocity; got none",
        ),
    ],
)
def test_a_pursuit_that_does_not_fit_is_refused_in_one_line(game, part, message):
    with pytest.raises(InvalidInput, match=message) as caught:
        MakeTracking(game, pursuit=part)
    assert "\n" not in str(caught.value)


def test_a_pursuit_of_another_size_is_refused(game):
    part = Part({"pursuer_position": 4}, "velocity", 6, lambda _: np.zeros(6))
    with pytest.raises(RuntimeError, match="Mismatched vector sizes"):
        MakeTracking(game, pursuit=part)


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
            r"`rule` must return an evader from 0 to 3, or -1, .*; got \[0, 1\]",
        ),
        (
            {"assignment": lambda view: np.array([0, 4, 1])},
            r"`rule` must return an evader from 0 to 3, or -1, .*; got \[0, 4, 1\]",
        ),
        (
            {"assignment": lambda view: np.array([0, np.nan, 1])},
            r"`rule` must return an evader from 0 to 3, or -1, .*; got \[0.0, nan, 1.0\]",
        ),
        (
            {"assignment": Part(POSITIONS, "assignment", 3, lambda *_: np.array([0, 1.9, 1]))},
            r"`assignment` must name evaders from 0 to 3, or -1; got \[0.0, 1.9, 1.0\]",
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
