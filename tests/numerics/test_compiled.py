"""What is compiled anew on a fresh installation is said once."""

import subprocess
import sys

# Functions that nothing keeps on disk: as many as a story that runs for the first time has.
SCRIPT = """
import logging
logging.basicConfig(level=logging.INFO, format="%(name)s: %(message)s")
logging.getLogger("numba").setLevel(logging.WARNING)
from numba import njit
from sightfield.systems.numerics import compiled
for number in range({count}):
    njit(lambda value: value + 1)(1.0)
"""


def said_of(count: int) -> str:
    words = [sys.executable, "-c", SCRIPT.format(count=count)]
    return subprocess.run(words, capture_output=True, text=True, check=True).stderr


def test_a_long_compilation_is_said_once():
    said = said_of(25)
    assert said.startswith("sightfield.systems.numerics.compiled: compiling for this machine")
    assert said.count("\n") == 1


def test_a_short_one_is_not():
    assert said_of(2) == ""
