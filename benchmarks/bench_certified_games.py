"""Whether certified pursuers keep their promises, over many games, and what they can promise."""

import os
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.tracking.certified_games import (
    OPPONENTS,
    CertifiedGame,
    play_certified_games,
)
from sightfield.diagrams.tracking.scenario import TrackingScenario
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.world import World
from sightfield.systems.numerics.geometry.world_files import load_world

pytestmark = pytest.mark.benchmarks

# Starts of each size, each against every evader; and how many of them share a world.
GAMES = int(os.environ.get("GAMES", "4"))
SHARED = 2

SECONDS = float(os.environ.get("GAME_SECONDS", "20"))
GRID = float(os.environ.get("GRID", "0.15"))

# Passages that robots of 0.1 m go through.
ARENA = Arena(obstacles=3, gap=0.5)

SIZES = ((1, 1), (2, 2), (3, 3), (3, 4), (4, 4))

ROBOTS = {
    "points": (),
    "bodies": ("pursuers.radius=0.1", "evaders.radius=0.1"),
    "drives": (
        "pursuers.radius=0.1",
        "evaders.radius=0.1",
        "pursuers.model=differential_drive",
        "evaders.model=differential_drive",
        "pursuers.top_turn_rate=6",
    ),
}

Job = tuple[TrackingScenario, int, int, World]


def play_all_sizes(job: Job) -> tuple[list[list[CertifiedGame]], list[float]]:
    """Games in one world by size, and what each size took [s]."""
    base, seed, starts, world = job
    found, seconds = [], []
    for pursuers, evaders in SIZES:
        start = time.process_time()
        scenario = replace(
            base,
            pursuers=replace(base.pursuers, positions=[], headings=[], count=pursuers),
            evaders=replace(base.evaders, positions=[], headings=[], count=evaders),
        )
        found.append(play_certified_games(scenario, games=starts, seed=seed, world=world))
        seconds.append(time.process_time() - start)
    return found, seconds


@pytest.mark.parametrize("robots", ROBOTS)
def test_certified_games(robots):
    settings = (
        "evaders.top_speed=0.09",
        f"pursuers.grid={GRID}",
        f"seconds={SECONDS}",
        *ROBOTS[robots],
    )
    path = find_scenario("corner_1v1")
    base = load_scenario(TrackingScenario, path, list(settings))
    drawn = "SIGHTFIELD_MAP" not in os.environ
    where = "drawn arenas" if drawn else os.environ["SIGHTFIELD_MAP"]
    worlds = [
        draw_arena(ARENA, 100 + block) if drawn else load_world(where).world
        for block in range(-(-GAMES // SHARED) if drawn else 1)
    ]
    jobs = [
        (base, block, min(SHARED, GAMES - block * SHARED) if drawn else GAMES, world)
        for block, world in enumerate(worlds)
    ]
    # A process for each world: Drake frees no diagram, and these hold the world's tables.
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        played = list(pool.map(play_all_sizes, jobs))
    broken = []
    for number, size in enumerate(SIZES):
        games = [game for sizes, _ in played for game in sizes[number]]
        seconds = sum(times[number] for _, times in played)
        promises = [game.promises for game in games]
        margins = [each.margin for each in promises if not np.isnan(each.margin)]
        broken += [
            f"{size} {game.policy} {game.seed}: {game.promises.breach}"
            for game in games
            if game.promises.breach
        ]
        least = f"{min(margins):.2f} s" if margins else "-"
        print(
            f"\n{robots}, {size[0]}v{size[1]}, {where}, {SECONDS:g} s, grid {GRID} m: "
            f"{sum(not each.breach for each in promises)} of {len(games)} games against "
            f"{len(OPPONENTS)} evaders kept their promises; a certificate stood in "
            f"{sum(each.claimed > 0 for each in promises)}, for ever in "
            f"{sum(np.isinf(each.claimed) for each in promises)}; sight was lost in "
            f"{sum(game.lost_evader is not None for game in games)}, T - C at least {least}; "
            f"withdrawn {sum(each.withdrawn for each in promises)}, reassigned "
            f"{sum(game.reassignments for game in games)}; {seconds:.0f} CPU-s",
            flush=True,
        )
    assert not broken, "\n".join(broken)
