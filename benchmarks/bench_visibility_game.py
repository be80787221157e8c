"""What the solved visibility game costs, and how near it comes to the closed form of one corner."""

import math
import os
import resource
import time

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import segment_is_clear
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.geometry.world_files import load_world
from sightfield.systems.numerics.tracking.corner_game import (
    corner_table,
    escape_time,
    margins,
    to_corner_frame,
)
from sightfield.systems.numerics.tracking.visibility_game.board import make_board
from sightfield.systems.numerics.tracking.visibility_game.files import (
    load_guaranteed_times,
    save_guaranteed_times,
)
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    GuaranteedTimes,
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.triples import steps_of_two
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders

pytestmark = pytest.mark.benchmarks

RATIO = 0.3
# A room of this side with one hollow corner, at no special place of the grids [m].
SIDE = 4.0
CORNER = (2.0317, 2.0243)


def solve(world, grid: float, bound: str) -> tuple[GuaranteedTimes, float]:
    """The game of speeds 1 and RATIO, and the CPU time that it took [s]."""
    start = time.process_time()
    table = solve_visibility_game(
        world, pursuer_speed=1.0, evader_speed=RATIO, grid=grid, bound=bound
    )
    return table, time.process_time() - start


def corner_errors(corner_at: tuple[float, float], bound: str, grid: float) -> dict[str, float]:
    """How far a solved game is from the closed form, in a room with one corner.

    Pairs are left out in which the pursuer is nearer to an outer wall than it may have to run,
    until it loses or until the corner threatens no more: the corner game has no such walls.
    """
    x, y = corner_at
    world = make_world([(0, 0), (SIDE, 0), (SIDE, SIDE), (x, SIDE), (x, y), (0, y)])
    (corner,) = corner_table(world)
    table, seconds = solve(world, grid, bound)
    errors, offsets, wrong, count = [], [], [0, 0], 0
    points = table.evader_grid.points
    places = table.places[table.sighted > 0]
    for p in places[:: max(1, len(places) // 400)]:
        times = table.times_from(p)
        for j, i in np.argwhere(~np.isnan(times))[::3]:
            if not segment_is_clear(table.sight, *p, *points[j, i]):
                continue
            *state, _ = to_corner_frame(*p, *points[j, i], *corner[:4])
            theory = escape_time(*state, corner[3], RATIO, 1.0)
            barrier, _, to_star, _, _ = margins(*state, corner[3], RATIO)
            if (theory if math.isfinite(theory) else to_star) > min(*p, *(SIDE - p)):
                continue
            count += 1
            if math.isinf(times[j, i]) != math.isinf(theory):
                wrong[int(math.isinf(theory))] += 1
                if state[1] < 0:
                    offsets.append(abs(barrier))
            elif math.isfinite(theory):
                errors.append(times[j, i] - theory)
    return {
        "kept though lost": wrong[0] / count,
        "lost though kept": wrong[1] / count,
        "offset": float(np.mean(offsets)),
        "error": float(np.mean(errors)),
        "least": float(np.min(errors)),
        "most": float(np.max(errors)),
        "seconds": seconds,
    }


def test_one_corner():
    corner_errors(CORNER, "middle", 0.4)
    corner_errors(CORNER, "lower", 0.4)
    corner_errors(CORNER, "upper", 0.4)
    finer = (0.4, 0.2, 0.1)
    for bound, grids in (("middle", (0.2, 0.1, 0.05)), ("lower", finer), ("upper", finer)):
        for grid in grids:
            found = corner_errors(CORNER, bound, grid)
            print(
                f"\none corner, {bound}, grid {grid} m: kept though lost "
                f"{found['kept though lost']:.4f}, lost though kept "
                f"{found['lost though kept']:.4f}, |M1| where the two differ "
                f"{found['offset']:.3f} m, V - T* {found['error']:+.3f} s ({found['least']:+.2f} "
                f"to {found['most']:+.2f}), {found['seconds']:.1f} CPU-s"
            )


def test_order_at_a_corner():
    """The order of the barrier's offset under halving, with the corner at six places."""
    drawn = np.random.default_rng(int(os.environ.get("SEED", "3"))).uniform(1.95, 2.05, (5, 2))
    found = []
    for x, y in (CORNER, *drawn):
        offsets = [corner_errors((x, y), "middle", grid)["offset"] for grid in (0.2, 0.1, 0.05)]
        found.append(offsets)
        print(f"\ncorner at ({x:.4f}, {y:.4f}): {order_of(offsets)}")
    print(f"\nmean of six: {order_of(np.mean(found, axis=0))}")


def order_of(offsets) -> str:
    """The offsets on three grids, each half as wide as the one before, and their order."""
    listed = ", ".join(f"{each:.4f}" for each in offsets)
    return f"{listed} m, order {math.log2(offsets[0] / offsets[-1]) / 2:.2f}"


def test_arenas():
    found = []
    bounds = ("middle", "lower", "upper")
    for seed in range(6):
        world = draw_arena(Arena(), seed)
        for bound in bounds:
            solve(world, 0.8, bound)
        # The upper bound's nodes at the grid itself, else it would cost most of the time.
        solved = [solve(world, 0.2 if bound == "upper" else 0.1, bound) for bound in bounds]
        found.append([(t.share_for_ever, seconds, t.nbytes / 1e6) for t, seconds in solved])
        print(f"\narena {seed}: " + ", ".join(f"{entry[0]:.3f}" for entry in found[-1]))
    middle = np.mean(found, axis=0)[0][0]
    for bound, (share, seconds, size) in zip(bounds, np.mean(found, axis=0), strict=True):
        print(
            f"\n6 random arenas, {bound}: {seconds:.1f} CPU-s, {size:.0f} MB, keeps {share:.3f} "
            f"for ever, {share / middle:.3f} of middle"
        )


def peak_memory() -> int:
    """Most memory that this process has had so far [bytes]."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


@pytest.mark.parametrize(
    ("bound", "grid", "moves"),
    [("middle", 0.25, 9), ("middle", 0.25, 21), ("middle", 0.2, 9), ("lower", 0.36, 9)],
)
def test_two_evaders(bound, grid, moves):
    speeds = {"pursuer_speed": 1.0, "evader_speed": RATIO}
    found, times = [], []
    for seed in range(3):
        world = draw_arena(Arena(), seed)
        options = {"bound": bound, "evader_moves": moves} | speeds
        solve_two_evaders(world, grid=1.0, **options)
        start = time.process_time()
        table = solve_two_evaders(world, grid=grid, **options)
        seconds = time.process_time() - start
        for p in range(0, len(table.places), 5):
            steps = steps_of_two(table.triples, table.roads, p).ravel()
            times.append(table.seconds(steps[::17]))
        found.append((seconds, table.triples_in_sight, table.nbytes, table.share_for_ever))
    seconds, triples, size, share = np.mean(found, axis=0)
    median, most = np.quantile(np.concatenate(times), (0.5, 0.95), method="lower")
    print(
        f"\n3 random arenas, one pursuer and two evaders, {bound}, grid {grid} m, {moves} moves: "
        f"{seconds:.1f} CPU-s, {triples / 1e6:.0f} million triples, {size / 1e6:.0f} MB; half are "
        f"kept for {median:.1f} s, a twentieth for more than {most:.1f} s, {share:.4f} for ever"
    )


def test_a_map(tmp_path):
    if "SIGHTFIELD_MAP" not in os.environ:
        pytest.skip("SIGHTFIELD_MAP names no map")
    world = load_world(os.environ["SIGHTFIELD_MAP"]).world
    grid = float(os.environ.get("GRID", "0.1"))
    make_board(solve(make_world([(0, 0), (4, 0), (4, 4), (0, 4)]), 0.5, "middle")[0])
    before = peak_memory()
    table, seconds = solve(world, grid, "middle")
    more = peak_memory() - before
    path = tmp_path / "game.npz"
    saving = -time.perf_counter()
    save_guaranteed_times(table, path)
    saving += time.perf_counter()
    reading = -time.perf_counter()
    load_guaranteed_times(path)
    reading += time.perf_counter()
    start = time.process_time()
    make_board(table)
    board = time.process_time() - start
    print(
        f"\n{os.environ['SIGHTFIELD_MAP']}, grid {grid} m: {table.pairs / 1e6:.0f} million "
        f"pairs, {table.nbytes / 1e6:.0f} MB, {seconds:.1f} CPU-s, {more / 1e6:.0f} MB more than "
        f"before at the peak, {table.updates / len(table.places):.0f} updates of a plane, keeps "
        f"{table.share_for_ever:.2f} for ever; written in {saving:.2f} s, read in {reading:.2f} s; "
        f"distances for pursuit {board:.1f} CPU-s"
    )
