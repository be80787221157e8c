"""Machines of makers: their figures by hand, and which of several sayings of one thing holds."""

from dataclasses import replace

import pytest

from sightfield.diagrams.commands.harvest_run import asked_scenario
from sightfield.diagrams.harvest.makers import figures_of, machines_of_makers
from sightfield.diagrams.harvest.scenario import Carts, Combines, HarvestScenario
from sightfield.diagrams.scenario_files import build
from sightfield.systems.numerics.errors import InvalidInput

BUSHEL = 2150.42 * 0.0254**3
POUND = 0.45359237
# A litre of wheat, of 60 lb a bushel, and of corn, of 56 lb [kg].
WHEAT, CORN = (pounds * POUND / BUSHEL / 1000 for pounds in (60, 56))


def harvest(**combines):
    return build(HarvestScenario, {"field": {"width": 300, "height": 200}, "combines": combines})


def test_tanks_and_augers_are_volumes_of_a_crop():
    lexion = Combines(machine="claas-lexion-8900")
    assert lexion.header_width == 13.8
    assert lexion.capacity == pytest.approx(18000 * WHEAT)
    assert lexion.unload_rate == pytest.approx(180 * WHEAT)
    # A full tank is empty after 100 s, as its maker says.
    assert lexion.capacity / lexion.unload_rate == pytest.approx(100.0)
    assert Combines(machine="claas-lexion-8900 corn").capacity == pytest.approx(18000 * CORN)
    kinze = Carts(machine="kinze-1500 soybeans")
    assert kinze.capacity == pytest.approx(1500 * 60 * POUND)
    # And a full cart within two minutes.
    assert kinze.capacity / kinze.truck_rate == pytest.approx(120.0)


def test_what_is_said_besides_holds_in_python_and_in_files():
    made = Combines(machine="new-holland-cr10.90", capacity=7000.0, count=3)
    read = harvest(machine="new-holland-cr10.90", capacity="7 t", count=3)
    assert read.combines == made
    assert made.capacity == 7000.0
    assert made.unload_rate == pytest.approx(4 * 60 * POUND)
    # What a machine says nothing of is as usual, and all of it can be changed later.
    assert made.header_width == Combines().header_width
    assert replace(made, unload_rate=90.0).unload_rate == 90.0
    assert made.machines()[2].capacity == 7000.0


def test_set_for_a_run_a_machine_takes_the_place_of_the_scenarios():
    usual, _ = asked_scenario("thesis_2", [])
    asked, _ = asked_scenario(
        "thesis_2", ["combines.header_width=9 m", "combines.machine=claas-lexion-8900"]
    )
    assert usual.combines.capacity != asked.combines.capacity
    assert asked.combines.capacity == pytest.approx(18000 * WHEAT)
    assert asked.combines.header_width == 9.0
    assert asked.combines.turning_radius == usual.combines.turning_radius


def test_machines_that_nobody_knows_are_refused_in_one_line():
    with pytest.raises(InvalidInput, match=r"`combines\.machine` must be one of claas.*got fendt"):
        harvest(machine="fendt")
    with pytest.raises(InvalidInput, match=r"`combines\.machine` must be one of barley.*got hay"):
        asked_scenario("thesis_2", ["combines.machine=claas-lexion-8900 hay"])
    with pytest.raises(InvalidInput, match="`machine` must be one of kinze"):
        Carts(machine="claas-lexion-8900")


@pytest.mark.parametrize("kind", ["combines", "carts"])
def test_all_of_the_catalogue_is_read_and_says_where_it_is_from(kind):
    made = {"combines": Combines, "carts": Carts}[kind]
    for name, machine in machines_of_makers(kind).items():
        assert machine.maker
        assert machine.model
        assert all(source.startswith("http") for source in machine.sources)
        assert machine.sources
        known = made(machine=name)
        assert 5e3 < known.capacity < 6e4
        for key, value in figures_of(kind, name).items():
            assert getattr(known, key) == value
