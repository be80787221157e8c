"""Every input of every system in a diagram is connected: one that is forgotten has a default."""

from collections.abc import Iterator

import pytest
from pydrake.systems.framework import Diagram

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.social import scenarios as mazes
from sightfield.diagrams.social.make_social_search import MakeSocialSearch
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.social.social_game import set_up_social_game
from sightfield.diagrams.standoff.make_standoff import MakeStandoff, StandoffScenario
from sightfield.diagrams.station import scenarios as laboratories
from sightfield.diagrams.station.hardware import Operator
from sightfield.diagrams.station.laboratory_files import load_station
from sightfield.diagrams.station.make_station import MakeStation
from sightfield.diagrams.station.session import open_laboratory
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.diagrams.tracking.make_tracking import MakeTracking


def unconnected(diagram: Diagram) -> Iterator[str]:
    """Paths of the inputs that nothing leads to, of systems at any depth."""
    led = {(system.get_name(), int(port)) for system, port in diagram.connection_map()}
    for number in range(diagram.num_input_ports()):
        index = diagram.get_input_port(number).get_index()
        led |= {(each.get_name(), int(port)) for each, port in diagram.GetInputPortLocators(index)}
    for system in diagram.GetSystems():
        for number in range(system.num_input_ports()):
            if (system.get_name(), number) not in led:
                yield f"{system.get_name()}.{system.get_input_port(number).get_name()}"
        if isinstance(system, Diagram):
            yield from (f"{system.get_name()}/{each}" for each in unconnected(system))


@pytest.fixture(scope="module")
def laboratory():
    scenario = load_station(find_scenario("thesis_3v3", laboratories), ("radio.kind=udp",))
    return scenario, set_up_game(scenario.tracking)


def test_in_the_laboratory(laboratory):
    scenario, game = laboratory
    operator = Operator()
    assert list(unconnected(MakeStation(scenario, game=game, operator=operator))) == []
    with open_laboratory(scenario, game, "emulate", operator) as devices:
        station = MakeStation(scenario, devices, game=game, operator=operator)
        assert list(unconnected(station)) == []


def test_in_a_game(laboratory):
    assert list(unconnected(MakeTracking(laboratory[1]))) == []


def test_at_a_stand_off():
    late = StandoffScenario(noise=0.01, evader_sway=0.1, delay_samples=2)
    assert list(unconnected(MakeStandoff(late))) == []


@pytest.mark.parametrize(
    ("name", "own"), [("thesis_maze", ["network_evolution.interest"]), ("choosy_crowd", [])]
)
def test_in_a_search(name, own):
    """Agents of the thesis answer whoever asks: nobody tells their interest."""
    path = find_scenario(name, mazes)
    game = set_up_social_game(load_scenario(SocialScenario, path, ()))
    assert list(unconnected(MakeSocialSearch(game))) == own
