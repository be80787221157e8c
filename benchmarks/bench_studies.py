"""How fast studies are played, against a target: one figure of 16 000 runs in 20 minutes."""

import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from sightfield.diagrams.studies.engine import run_study
from sightfield.diagrams.studies.play import play_block
from sightfield.diagrams.studies.player import GAMES_PER_PROCESS
from sightfield.diagrams.studies.tracking_study import tracking_study

pytestmark = pytest.mark.benchmarks

# Runs that are played of each of the 16 cells, of the 1000 that the figure has.
SAMPLE = 30

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


def test_one_worker_and_two(tmp_path):
    study, times, own = figure(2 * SAMPLE), [], []
    for workers in (1, 2):
        began, used = time.perf_counter(), time.process_time()
        run_study(study, tmp_path / str(workers), workers=workers)
        times.append(time.perf_counter() - began)
        own.append(time.process_time() - used)
    (one, two), games = times, study.runs * len(study.cells)
    print(
        f"\n{games} games: {one:.1f} s with one worker, {two:.1f} s with two, {one / two:.2f} "
        f"times as fast; {16_000 * two / games / 60:.1f} minutes a figure; what they share, the "
        f"process that hands out and writes, takes {own[1] / two:.1%} of a core"
    )
