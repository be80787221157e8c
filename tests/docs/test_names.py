"""Ports and names that the pages mention exist in the package, not in its sources alone."""

import importlib
import re

import pytest
from drake_systems import fault_of, fault_of_port
from names import full_names
from sources import read_modules


def marked(page, role: str) -> list[str]:
    """What a page has in a role, as {port}`AgentTeam.velocity`."""
    return re.findall(rf"\{{{role}\}}`([^`]+)`", page.text)


def test_the_pages_name_ports_and_things(pages):
    assert sum(len(marked(page, "port")) for page in pages) > 20
    assert sum(len(marked(page, "api")) for page in pages) > 80


def test_every_port_named_is_one(page):
    assert [fault for fault in map(fault_of_port, marked(page, "port")) if fault] == []


def test_every_name_leads_to_something_that_can_be_imported(page):
    for name in marked(page, "api"):
        assert fault_of(name) == ""
        (place,) = full_names(name.partition(":")[0])
        assert imported(place) is not None


def imported(place: str) -> object:
    """What a full name means to Python."""
    module, names = place, []
    while module not in {each.name for each in read_modules()}:
        module, _, last = module.rpartition(".")
        names.insert(0, last)
    thing = importlib.import_module(module)
    for name in names:
        thing = getattr(thing, name)
    return thing


@pytest.mark.parametrize("name", ["no_such_function", "LineOfSight:listeners", "read.write"])
def test_a_name_that_is_none_is_seen(name):
    assert fault_of(name)


@pytest.mark.parametrize("name", ["LineOfSight.sound", "LineOfSight", "World.boundary"])
def test_a_port_that_is_none_is_seen(name):
    assert fault_of_port(name)
