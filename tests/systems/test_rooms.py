"""A room of systems offers each of them by its own name."""

import inspect
import pkgutil
from importlib import import_module

import pytest
from pydrake.systems.framework import LeafSystem

from sightfield import systems

ROOMS = [each.name for each in pkgutil.iter_modules(systems.__path__) if each.ispkg]
ROOMS.remove("numerics")


def own_systems(room):
    """Names of the LeafSystems that the room's modules define, and of their templates."""
    for found in pkgutil.iter_modules(import_module(f"sightfield.systems.{room}").__path__):
        module = import_module(f"sightfield.systems.{room}.{found.name}")
        for name, thing in vars(module).items():
            # A template leaves each of its instances in the module too, under a name not in ASCII.
            if (
                not name.isascii()
                or not inspect.isclass(thing)
                or not issubclass(thing, LeafSystem)
            ):
                continue
            if not thing.__module__.startswith("pydrake"):
                yield name
                if hasattr(module, f"{name}_"):
                    yield f"{name}_"


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_offers_all_its_systems(room):
    names = list(own_systems(room))
    assert names
    module = import_module(f"sightfield.systems.{room}")
    assert sorted(module.__all__) == sorted(names)
    assert all(hasattr(module, name) for name in names)
