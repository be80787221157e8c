"""What the solved visibility game costs, and how near it comes to the closed form of one corner."""

import math
import os
import time

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.arenas.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.geometry.world_files import load_world
from sightfield.systems.numerics.tracking.corner_frame import to_corner_frame
from sightfield.systems.numerics.tracking.corner_game import escape_time, margins
from sightfield.systems.numerics.tracking.corner_table import corner_table
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    GuaranteedTimes,
    solve_visibility_game,
)

pytestmark = pytest.mark.benchmarks

RATIO = 0.3


def solve(world, grid: float, bound: str) -> tuple[GuaranteedTimes, float]:
    """The game of speeds 1 and RATIO, and the CPU time that it took [s]."""
    start = time.process_time()
    table = solve_visibility_game(
        world, pursuer_speed=1.0, evader_speed=RATIO, grid=grid, bound=bound
    )
    return table, time.process_time() - start


def test_one_corner():
    world = make_world([(0, 0), (4, 0), (4, 4), (2.0317, 4), (2.0317, 2.0243), (0, 2.0243)])
    (corner,) = corner_table(world)
    solve(world, 0.8, "middle")
    solve(world, 0.8, "lower")
    for bound, grids in (("middle", (0.2, 0.1, 0.05)), ("lower", (0.4, 0.2, 0.1))):
        for grid in grids:
            table, seconds = solve(world, grid, bound)
            errors, offsets, wrong, count = [], [], 0, 0
            points = table.evader_grid.points
            for p in table.places[:: max(1, len(table.places) // 150)]:
                times = table.times_from(p)
                for j, i in np.argwhere(~np.isnan(times))[::7]:
                    if not segment_is_clear(table.sight, *p, *points[j, i]):
                        continue
                    *state, _ = to_corner_frame(*p, *points[j, i], *corner[:4])
                    theory = escape_time(*state, corner[3], RATIO, 1.0)
                    count += 1
                    if math.isinf(times[j, i]) != math.isinf(theory):
                        wrong += math.isinf(times[j, i])
                        if state[1] < 0:
                            offsets.append(abs(margins(*state, corner[3], RATIO)[0]))
                    elif math.isfinite(theory):
                        errors.append(times[j, i] - theory)
            print(
                f"\none corner, {bound}, grid {grid} m: kept though lost {wrong / count:.4f} of "
                f"{count}, |M1| where the two differ {np.mean(offsets):.3f} m, V - T* "
                f"{np.mean(errors):+.3f} s ({np.min(errors):+.2f} to {np.max(errors):+.2f}), "
                f"{seconds:.1f} CPU-s"
            )


def test_arenas():
    found = []
    for seed in range(6):
        world = draw_arena(Arena(), seed)
        solve(world, 0.4, "middle")
        middle, quick = solve(world, 0.1, "middle")
        lower, slow = solve(world, 0.1, "lower")
        shares = middle.share_for_ever, lower.share_for_ever
        found.append((quick, slow, *shares, shares[1] / shares[0], middle.bytes, lower.bytes))
    quick, slow, middle, lower, ratio, small, large = np.mean(found, axis=0)
    print(
        f"\n6 random arenas, grid 0.1 m: middle {quick:.1f} CPU-s, {small / 1e6:.0f} MB, keeps "
        f"{middle:.2f} for ever; lower {slow:.1f} CPU-s, {large / 1e6:.0f} MB, keeps {lower:.2f}, "
        f"{ratio:.2f} of that"
    )


def test_a_map():
    if "SIGHTFIELD_MAP" not in os.environ:
        pytest.skip("SIGHTFIELD_MAP names no map")
    world = load_world(os.environ["SIGHTFIELD_MAP"]).world
    grid = float(os.environ.get("GRID", "0.1"))
    solve(world, 5 * grid, "middle")
    table, seconds = solve(world, grid, "middle")
    print(
        f"\n{os.environ['SIGHTFIELD_MAP']}, grid {grid} m: {table.pairs / 1e6:.0f} million "
        f"pairs, {table.bytes / 1e6:.0f} MB, {seconds:.1f} CPU-s, keeps "
        f"{table.share_for_ever:.2f} for ever"
    )
