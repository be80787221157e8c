"""Scenarios, with all that they leave to defaults, are as they were recorded."""

import pytest

from sightfield.diagrams import scenarios as tracking
from sightfield.diagrams.harvest import scenarios as harvest
from sightfield.diagrams.harvest.scenario import HarvestScenario
from sightfield.diagrams.scenario_files import builtin_scenarios, find_scenario, load_scenario
from sightfield.diagrams.social import scenarios as social
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.standoff.make_standoff import StandoffScenario
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.systems.numerics.errors import InvalidInput

KINDS = ((tracking, TrackingScenario), (harvest, HarvestScenario), (social, SocialScenario))
SCENARIOS = [
    pytest.param(place, kind, name, id=name)
    for place, kind in KINDS
    for name in builtin_scenarios(place)
]
GAME, FIELD, SEARCH = (
    lambda *settings, kind=kind, name=name, place=place: load_scenario(
        kind, find_scenario(name, place), settings
    )
    for (place, kind), name in zip(KINDS, ("corner_1v1", "thesis_2", "thesis_maze"), strict=True)
)


@pytest.mark.parametrize(("place", "kind", "name"), SCENARIOS)
def test_a_scenario_is_as_recorded(place, kind, name, as_recorded):
    as_recorded(load_scenario(kind, find_scenario(name, place)))


def test_a_loop_of_defaults_is_as_recorded(as_recorded):
    as_recorded(StandoffScenario())


# A setting that is just allowed, and one just beyond it.
LIMITS = [
    (GAME, "period=0.001", "period=0.00099"),
    (GAME, "seconds=0.05", "seconds=0.0499"),
    (GAME, "evaders.top_speed=0.2999", "evaders.top_speed=0.3"),
    (GAME, "pursuers.radio_range=0", "pursuers.radio_range=-0.01"),
    (GAME, "seed=0", "seed=-1"),
    (FIELD, "field.margin=200", "field.margin=200.01"),
    (FIELD, "combines.speed=0.1", "combines.speed=0.0999"),
    (FIELD, "carts.acceleration=0.05", "carts.acceleration=0.0499"),
    (FIELD, "carts.turning_radius=0.5", "carts.turning_radius=0.499"),
    (FIELD, "combines.count=100", "combines.count=101"),
    (FIELD, "combines.count=1", "combines.count=0"),
    (FIELD, "carts.count=100", "carts.count=101"),
    (FIELD, "trucks.count=100", "trucks.count=101"),
    (FIELD, "reserve=0", "reserve=-0.01"),
    (FIELD, "reserve=0.9", "reserve=0.901"),
    (FIELD, "threshold=1", "threshold=1.001"),
    (FIELD, "threshold=0.001", "threshold=0"),
    (FIELD, "fill=1", "fill=1.001"),
    (FIELD, "fill=0.001", "fill=0"),
    (FIELD, "period=0.01", "period=0.0099"),
    (FIELD, "period=0.5", "period=0.501"),
    (FIELD, "travel_time=0", "travel_time=-0.1"),
    (FIELD, "combines.each=[{}, {speed: 0.1}]", "combines.each=[{}, {}, {speed: 0.1}]"),
    (SEARCH, "camera.width=64", "camera.width=63"),
    (SEARCH, "camera.height=64", "camera.height=63"),
    (SEARCH, "camera.view_angle=149.9", "camera.view_angle=150"),
    (SEARCH, "camera.view_angle=0.1", "camera.view_angle=0"),
    (SEARCH, "agents.persuasion=1", "agents.persuasion=1.001"),
    (SEARCH, "agents.persuasion=0", "agents.persuasion=-0.001"),
    (SEARCH, "agents.friending=[0, 1, 1]", "agents.friending=[0, 1, 1.001]"),
    (SEARCH, "agents.unfriending=[0, 1, 0]", "agents.unfriending=[0, 1, -0.001]"),
    (SEARCH, "agents.rejection=[0, 1, 0]", "agents.rejection=[0, 1]"),
    (SEARCH, "agents.acquaintances=[[0, 2]]", "agents.acquaintances=[[0, 3]]"),
    (SEARCH, "agents.acquaintances=[[2, 1]]", "agents.acquaintances=[[1, 1]]"),
    (SEARCH, "maze.landmarks=1", "maze.landmarks=0"),
    (SEARCH, "search.requests=1", "search.requests=0"),
    (SEARCH, "search.patience=0", "search.patience=-1"),
    (SEARCH, "search.pictures=1", "search.pictures=0"),
    (SEARCH, "search.period=0.05", "search.period=0.06"),
    (SEARCH, "camera.period=0.15", "camera.period=0.14"),
    (SEARCH, "pursuer.pose=[0.5, 0.5, 1]", "pursuer.pose=[0.5, 0.5]"),
    (SEARCH, "evader.pose=[0.5, 0.5, 1]", "evader.pose=[0.5, 0.5, .inf]"),
]


@pytest.mark.parametrize(("load", "allowed", "refused"), LIMITS, ids=[each[2] for each in LIMITS])
def test_a_limit_belongs_to_what_is_allowed(load, allowed, refused):
    load(allowed)
    with pytest.raises(InvalidInput):
        load(refused)
