"""Fields of many shapes, by name."""

import runpy
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def field_makers():
    return runpy.run_path(str(Path(__file__).with_name("field_makers.py")))["FIELDS"]
