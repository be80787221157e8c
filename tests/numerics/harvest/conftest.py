"""Fields of many shapes, by name."""

import runpy
from pathlib import Path

import pytest
from shapely import affinity

from sightfield.systems.numerics.geometry.world import world_from_polygon
from sightfield.systems.numerics.harvest.field.field import Field


@pytest.fixture(scope="session")
def field_makers():
    return runpy.run_path(str(Path(__file__).with_name("field_makers.py")))["FIELDS"]


@pytest.fixture(scope="session")
def smaller(field_makers):
    """A function of a field's name: that shape, its lengths a part of what they were."""

    def scaled(name, part):
        polygon = affinity.scale(field_makers[name]().polygon, part, part, origin=(0, 0))
        return Field(world_from_polygon(polygon))

    return scaled
