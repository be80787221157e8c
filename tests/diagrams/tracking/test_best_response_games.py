"""Games with evaders that answer the pursuers' rule: worth it, repeatable, resumed from a copy."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.studies.team_studies import tracking_study
from sightfield.diagrams.tracking.game import set_up_game, with_random_starts
from sightfield.diagrams.tracking.make_tracking import MakeTracking
from sightfield.diagrams.tracking.run import run_tracking
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.diagrams.world_source import WorldSource
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.tracking import BestResponseEvaders
from sightfield.systems.tracking.best_response_evaders import IN_TEAMS


def load(*settings):
    path = find_scenario("thesis_3v3")
    points = ("pursuers.model=point", "evaders.model=point")
    return with_random_starts(load_scenario(TrackingScenario, path, (*points, *settings)))


def in_arena(scenario, seed):
    """The scenario in a world and from starts of a seed."""
    world = draw_arena(Arena(), seed)
    rings = [ring.tolist() for ring in world.obstacles]
    source = WorldSource(boundary=world.boundary.tolist(), obstacles=rings)
    return set_up_game(replace(scenario, world=source, seed=seed), world)


def test_they_break_away_sooner_than_those_that_play_by_the_corner_game():
    def times(policy):
        scenario = load("seconds=30", "pursuers.field=table", f"evaders.policies=[{policy}]")
        alone = replace(
            scenario,
            pursuers=replace(scenario.pursuers, count=1),
            evaders=replace(scenario.evaders, count=1),
        )
        return np.array([run_tracking(in_arena(alone, k)).tracking_time for k in range(12)])

    answering, playing = times("best_response"), times("adversarial")
    assert answering.mean() < playing.mean() - 0.5


def test_evaders_that_do_not_get_away_look_farther_ahead():
    """Where nothing breaks sight within 8 s they stood for ever, where the margin was least."""
    study = tracking_study(opponents=("best_response",))
    (cell,) = (each for each in study.cells if each.name == "2v2-uniform-best_response")
    game = set_up_game(study.scenario(cell, 25))
    scenario = game.scenario
    for foresight, kept in ((IN_TEAMS._replace(beyond=None), True), (IN_TEAMS, False)):
        evaders = BestResponseEvaders(
            game.world,
            game.pursuer_regions,
            game.evader_regions,
            pursuers=2,
            evaders=2,
            pursuer_speed=scenario.pursuers.top_speed,
            evader_speed=scenario.evaders.top_speed,
            pursuit=scenario.pursuers.field,
            risk_vectors=scenario.pursuers.risk_vectors,
            hold=scenario.pursuers.switch,
            foresight=foresight,
        )
        diagram = MakeTracking(game, evasion=evaders)
        simulator = Simulator(diagram)
        simulator.AdvanceTo(40.0)
        loss = diagram.GetOutputPort("loss").Eval(simulator.get_context())[0]
        assert (loss > 40.0) == kept


@pytest.mark.parametrize("field", ["margin", "lookahead"])
def test_a_game_repeats(field):
    game = in_arena(
        load("seconds=3", "evaders.policies=[best_response]", f"pursuers.field={field}"), 5
    )
    first, again = run_tracking(game), run_tracking(game)
    for name, samples in first.log.items():
        np.testing.assert_array_equal(again.log[name], samples)


@pytest.mark.parametrize(
    "settings", [("pursuers.hold=until_lost",), ("pursuers.hold=cost", "pursuers.field=lookahead")]
)
def test_a_game_goes_on_from_a_copy_of_its_context_as_it_would_have_gone_on(settings):
    game = in_arena(load("seconds=20", "evaders.policies=[best_response]", *settings), 2)
    diagram = MakeTracking(game)
    simulator = Simulator(diagram)
    # Between two decisions: the copies decide when they would have decided.
    simulator.AdvanceTo(3.1)
    copies = [simulator.get_context().Clone() for _ in range(2)]
    futures = []
    for context in (simulator.get_context(), *copies):
        resumed = simulator if context is simulator.get_context() else Simulator(diagram, context)
        resumed.AdvanceTo(8.0)
        names = ("pursuer_position", "evader_position", "assignment", "loss")
        futures.append([diagram.GetOutputPort(each).Eval(context) for each in names])
    for other in futures[1:]:
        for now, same in zip(futures[0], other, strict=True):
            np.testing.assert_array_equal(now, same)


@pytest.mark.parametrize("seed", range(6))
def test_to_resume_is_no_reason_to_decide_anew(seed):
    diagram = MakeTracking(in_arena(load("evaders.policies=[best_response]"), seed))
    simulator = Simulator(diagram)
    # Between two decisions.
    simulator.AdvanceTo(3.0)
    copy = simulator.get_context().Clone()
    evaders = diagram.GetSubsystemByName("best_response_evaders")
    plans = evaders.GetMyContextFromRoot(copy).get_discrete_state(0).CopyToVector()
    Simulator(diagram, copy).Initialize()
    after = evaders.GetMyContextFromRoot(copy).get_discrete_state(0).CopyToVector()
    np.testing.assert_array_equal(after, plans)
