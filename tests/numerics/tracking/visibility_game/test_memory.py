"""The solver takes hardly more memory than its table, and none for a table that is refused."""

import json
import sys

import pytest

# Peak memory only grows, so each case has a process of its own.
SCRIPT = """
import json, resource, sys
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)

def solve(**options):
    speeds = {"pursuer_speed": 1.0, "evader_speed": 0.3, "bound": sys.argv[1]}
    # The table is as large for a near horizon, and soon settled.
    return solve_visibility_game(draw_arena(Arena(), 1), horizon=0.5, **speeds, **options)

def peak():
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

# What is compiled is no part of it; the sample alone is asked for too.
for grid in (0.8, 0.5):
    solve(grid=grid)
before, size = peak(), 0
try:
    size = solve(grid=float(sys.argv[2]), memory=float(sys.argv[3])).nbytes
except InvalidInput as error:
    assert "so that the table takes at most" in str(error)
print(json.dumps({"bytes": size, "more": peak() - before}))
"""


@pytest.mark.parametrize(
    ("bound", "grid", "memory"),
    [("middle", 0.06, 4e9), ("lower", 0.13, 4e9), ("middle", 0.03, 5e8), ("lower", 0.06, 5e8)],
)
def test_little_more_than_the_table(bound, grid, memory, run_program):
    found = json.loads(run_program(sys.executable, "-c", SCRIPT, bound, grid, memory))
    # The first cases are solved, the others would take more than a gigabyte.
    assert (found["bytes"] > 5e7) == (memory > 1e9)
    assert found["more"] < 1.5 * found["bytes"] + 8e7
