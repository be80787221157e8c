"""Games of pursuers that play by the solved visibility game."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.guarantee_picture import draw_guarantee
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import Evaders, Pursuers, TrackingScenario
from sightfield.diagrams.tracking.solved_game import solved_game
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders
from sightfield.systems.tracking import Assignment, GuaranteePursuit

ARENA = WorldSource(
    boundary=[[0, 0], [4, 0], [4, 4], [0, 4]],
    obstacles=[[[1.53, 1.41], [2.71, 1.41], [2.71, 2.57], [1.53, 2.57]]],
)


def make_scenario(pursuer, evader, radius=0.0, policy="adversarial", **pursuing):
    team = {"top_speed": 0.3, "positions": [pursuer], "radius": radius, "smoothing": 0.0}
    return TrackingScenario(
        world=ARENA,
        pursuers=Pursuers(**(team | {"field": "guarantee", "grid": 0.15} | pursuing)),
        evaders=Evaders(top_speed=0.09, positions=[evader], radius=radius, policies=[policy]),
        seconds=40.0,
    )


@pytest.mark.parametrize("radius", [0.0, 0.12])
@pytest.mark.parametrize("policy", ["adversarial", "best_response"])
def test_what_can_be_kept_is_kept(radius, policy):
    scenario = make_scenario([0.9, 0.7], [1.9, 1.1], radius, policy)
    game = set_up_game(scenario)
    table = solve_visibility_game(
        game.world,
        pursuer_speed=0.3,
        evader_speed=0.09,
        grid=0.15,
        pursuer_regions=game.pursuer_regions,
        evader_regions=game.evader_regions,
    )
    assert table.time(game.pursuer_starts[0, :2], game.evader_starts[0, :2]) == np.inf
    run = run_tracking(game)
    assert run.lost_evader is None
    assert run.tracking_time == 40.0


def test_what_is_lost_is_held_about_as_long_as_the_table_says():
    scenario = make_scenario([0.5, 1.2], [3.0, 1.3])
    game = set_up_game(scenario)
    table = solve_visibility_game(game.world, pursuer_speed=0.3, evader_speed=0.09, grid=0.08)
    promised = table.time([0.5, 1.2], [3.0, 1.3])
    assert 0.5 < promised < 20.0
    assert run_tracking(game).tracking_time > promised - 1.0


def test_a_grid_has_to_be_positive():
    with pytest.raises(InvalidInput, match="`grid` must be positive"):
        make_scenario([0.5, 0.5], [1.0, 0.5], grid=0.0)


def make_teams(**pursuing):
    return replace(
        make_scenario([0.9, 0.7], [1.9, 1.1]),
        pursuers=Pursuers(
            top_speed=0.3,
            positions=[[0.9, 0.7], [3.2, 3.3], [0.6, 3.2]],
            assignment="guarantee",
            grid=0.15,
            smoothing=0.0,
            **({"field": "guarantee"} | pursuing),
        ),
        evaders=Evaders(top_speed=0.09, positions=[[1.9, 1.1], [3.2, 2.0], [1.0, 2.4]]),
    )


@pytest.mark.parametrize("policy", ["adversarial", "best_response"])
def test_a_team_keeps_what_its_certificate_says_for_ever(policy):
    scenario = make_teams()
    game = set_up_game(replace(scenario, evaders=replace(scenario.evaders, policies=[policy])))
    run = run_tracking(game)
    first = run.log["assignment"][0].astype(int)
    table = solved_game(game)
    times = [
        table.time(game.pursuer_starts[i, :2], game.evader_starts[j, :2])
        for i, j in enumerate(first)
    ]
    assert min(times) == np.inf
    assert run.lost_evader is None
    assert (run.log["assignment"] == first).all()


def test_the_hold_is_the_certificate_unless_told_otherwise():
    assert make_teams().pursuers.switch == "certificate"
    assert make_teams(hold="none").pursuers.switch == "none"
    assert make_scenario([0.9, 0.7], [1.9, 1.1]).pursuers.switch == "until_lost"


@pytest.mark.parametrize(
    ("pursuing", "message"),
    [
        ({"hold": "cost"}, "`hold` must be one of none, until_lost, certificate; got cost"),
        ({"radio_range": 2.0}, "`radio_range` must be .inf with the assignment guarantee"),
    ],
)
def test_what_does_not_go_with_the_assignment_is_refused(pursuing, message):
    with pytest.raises(InvalidInput, match=message):
        make_teams(**pursuing)


def test_the_certificate_is_no_hold_of_another_rule():
    with pytest.raises(InvalidInput, match="`hold` must be one of none, until_lost, cost"):
        make_scenario([0.9, 0.7], [1.9, 1.1], hold="certificate")


def make_team_scenario(pursuers, evaders, policy="adversarial", seconds=30.0, world=ARENA, **more):
    team = {"top_speed": 0.3, "positions": pursuers, "smoothing": 0.0, "field": "guarantee"}
    team["assignment"] = "guarantee"
    return TrackingScenario(
        world=world,
        pursuers=Pursuers(**(team | {"grid": 0.15, "grid_of_two": 0.3} | more)),
        evaders=Evaders(top_speed=0.09, positions=evaders, policies=[policy]),
        seconds=seconds,
    )


def responsible_of(diagram, context):
    pursuit = diagram.GetSubsystemByName("pursuit")
    port = pursuit.GetOutputPort("responsible")
    return port.Eval(pursuit.GetMyContextFromRoot(context)).astype(int)


@pytest.fixture(scope="module")
def tables():
    """The arena's games of two evaders and of one."""
    world, speeds = ARENA.load(), {"pursuer_speed": 0.3, "evader_speed": 0.09}
    of_two = solve_two_evaders(world, grid=0.25, **speeds)
    return of_two, solve_visibility_game(world, grid=0.15, **speeds)


@pytest.mark.parametrize("policy", ["adversarial", "best_response"])
def test_one_pursuer_keeps_two_evaders_about_as_long_as_the_table_says(policy, tables):
    # Alone each could be kept for ever.
    scenario = make_team_scenario([[0.9, 0.6]], [[2.9, 0.7], [0.7, 2.7]], policy, seconds=60.0)
    game = set_up_game(scenario)
    table, alone = tables
    p, evaders = scenario.pursuers.positions[0], scenario.evaders.positions
    promised = table.time(p, *evaders)
    assert all(alone.time(p, e) == np.inf for e in evaders)
    assert 3.0 < promised < 60.0
    run = run_tracking(game)
    assert run.tracking_time > promised - 2.5


def test_every_evader_is_somebodys():
    scenario = make_team_scenario([[0.9, 0.6], [3.2, 3.3]], [[1.9, 0.7], [0.7, 2.2], [3.3, 2.1]])
    diagram = MakeTracking(scenario)
    simulator = Simulator(diagram)
    context, loss = simulator.get_context(), diagram.GetOutputPort("loss")
    changes, before = 0, None
    while context.get_time() < 20.0 and np.isinf(loss.Eval(context)[0]):
        simulator.AdvanceTo(context.get_time() + 0.5)
        owners = responsible_of(diagram, context)
        sight = diagram.GetOutputPort("visibility").Eval(context).reshape(2, 3)
        assignment = diagram.GetOutputPort("assignment").Eval(context).astype(int)
        assert all(0 <= owner < 2 for owner in owners)
        for i in range(2):
            # It watches its own that it sees, and those that their own pursuer does not see.
            watched = [j for j in range(3) if sight[i, j] and owners[j] == i]
            stood_in = [j for j in range(3) if sight[i, j] and not sight[owners[j], j]]
            assert assignment[i] in (watched + stood_in or [-1])
        changes += before is not None and (owners != before).any()
        before = owners
    assert context.get_time() > 5.0
    assert changes <= 4


def test_a_rule_of_ones_own_gives_each_pursuer_one_evader():
    scenario = make_team_scenario([[0.9, 0.6]], [[2.9, 0.7], [0.7, 2.7]])
    diagram = MakeTracking(scenario, assignment="nearest")
    assert isinstance(diagram.GetSubsystemByName("pursuit"), GuaranteePursuit)
    assert isinstance(diagram.GetSubsystemByName("assignment"), Assignment)
    assert not MakeTracking(scenario).HasSubsystemNamed("assignment")


def test_the_grid_of_two_has_to_be_positive_and_coarse_enough():
    with pytest.raises(InvalidInput, match="`grid_of_two` must be positive"):
        make_team_scenario([[0.5, 0.5]], [[1.0, 0.5], [0.6, 0.9]], grid_of_two=-1.0)
    scenario = make_team_scenario([[0.5, 0.5]], [[1.0, 0.5], [0.6, 0.9]], grid_of_two=0.1)
    with pytest.raises(InvalidInput, match="the table of two evaders takes at most"):
        MakeTracking(scenario)


def test_the_legend_of_the_picture_has_the_barrier_and_what_is_outside():
    bend = make_world([(0, 0), (8, 0), (8, 2), (2, 2), (2, 6), (8, 6), (8, 8), (0, 8)])
    table = solve_visibility_game(bend, pursuer_speed=0.3, evader_speed=0.09, grid=0.4)
    figure = draw_guarantee(table, bend, np.array([0.4, 2.0]))
    labels = [each.get_text() for each in figure.legends[0].get_texts()]
    assert {"pursuer", "barrier", "obstacle, or outside"} <= {*labels}
    # The bay between the arms is no floor.
    bay = [patch.get_path().get_extents().bounds for patch in figure.axes[0].patches]
    assert (2.0, 2.0, 6.0, 4.0) in bay
