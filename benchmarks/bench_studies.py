"""How fast studies are played, against a target: one figure of 16 000 runs in 20 minutes."""

import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from sightfield.diagrams.studies.engine import run_study
from sightfield.diagrams.studies.play import play_block
from sightfield.diagrams.studies.player import GAMES_PER_PROCESS
from sightfield.diagrams.studies.tracking_study import tracking_study

pytestmark = pytest.mark.benchmarks

# Runs that are played of each of the 16 cells, of the 1000 that the figure has; for workers twice
# as many, which make an even number of blocks, in rounds that alternate.
SAMPLE, RUNS, ROUNDS = 32, 64, 3

# 20 minutes on 2 cores for 16 cells of 1000 runs: CPU time of a game [s].
TARGET = 20 * 60 * 2 / 16_000


def figure(runs):
    """The study of Figure 2.16."""
    return tracking_study(runs=runs, vectors=("uniform",))


def play_one_by_one(runs):
    """CPU time of a game [s], and how much a process grows by it [MB]."""
    study = figure(runs)
    play_block(study, 0, 1)  # compile
    began, size = time.process_time(), resident_size()
    play_block(study, 1, runs)
    games = (runs - 1) * len(study.cells)
    return (time.process_time() - began) / games, (resident_size() - size) / games


def resident_size():
    """Memory of this process [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 1e6


def test_a_figure_of_sixteen_cells_at_a_thousand_runs():
    # In a process of its own, as the games of a study are: they leave memory behind.
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as apart:
        cost, growth = apart.submit(play_one_by_one, SAMPLE).result()
    print(
        f"\n{cost * 1e3:.1f} ms of CPU a game: {cost * 16_000 / 60:.1f} CPU minutes a figure, "
        f"{TARGET / cost:.1f} times as fast as the target; a process grows by {growth:.2f} MB a "
        f"game, to {growth * GAMES_PER_PROCESS:.0f} MB before it is replaced"
    )


def play_apart(runs):
    """Time that a process takes for games by itself, once it has compiled [s]."""
    study = figure(runs)
    play_block(study, 0, 1)
    began = time.perf_counter()
    play_block(study, 0, runs)
    return time.perf_counter() - began


def play_side_by_side(processes, runs):
    """Time until as many processes, which know nothing of each other, have all done that [s]."""
    pools = [ProcessPoolExecutor(1, mp_context=get_context("spawn")) for _ in range(processes)]
    try:
        return max(each.result() for each in [pool.submit(play_apart, runs) for pool in pools])
    finally:
        for pool in pools:
            pool.shutdown()


def test_one_worker_and_two(tmp_path):
    study, times, shares, limits = figure(RUNS), [], [], []
    for round_ in range(ROUNDS):
        took = []
        for workers in (1, 2):
            began, used = time.perf_counter(), time.process_time()
            run_study(study, tmp_path / f"{round_}-{workers}", workers=workers)
            took.append(time.perf_counter() - began)
        times.append(took)
        shares.append((time.process_time() - used) / took[1])
        limits.append(2.0 * play_side_by_side(1, SAMPLE) / play_side_by_side(2, SAMPLE))
    times, games = np.array(times), study.runs * len(study.cells)
    one, two = np.median(times, axis=0)
    print(
        f"\n{games} games: {one:.1f} s with one worker, {two:.1f} s with two "
        f"(medians of {ROUNDS}), {np.median(times[:, 0] / times[:, 1]):.2f} times as fast; two "
        f"processes that know nothing of each other play {np.median(limits):.2f} times as fast as "
        f"one (least {min(limits):.2f}, most {max(limits):.2f}); "
        f"{16_000 * two / games / 60:.1f} minutes a figure; what they share, the process that "
        f"hands out and writes, takes {np.median(shares):.1%} of a core"
    )
