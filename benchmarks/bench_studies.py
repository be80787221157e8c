"""How fast studies are played, against a target: one figure of 16 000 runs in 20 minutes."""

import sys
import time
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from sightfield.diagrams.studies.engine import GAMES_PER_PROCESS
from sightfield.diagrams.studies.play import play_block
from sightfield.diagrams.studies.team_studies import tracking_study

from .racing import Racer, race

pytestmark = pytest.mark.benchmarks

# Runs that are played of each of the 16 cells, of the 1000 that the figure has; for workers more,
# an even number of blocks, in rounds.
SAMPLE, RUNS, ROUNDS = 32, 64, 2
# Of the slower of two that run in turns [s].
TURN = 4.0

# 20 minutes on 2 cores for 16 cells of 1000 runs: CPU time of a game [s].
TARGET = 20 * 60 * 2 / 16_000


def figure(runs):
    """The study of Figure 2.16, against the evaders that play the corner game."""
    return tracking_study(runs=runs, vectors=("uniform",), opponents=("adversarial",))


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


# What a racer does once it has imported all: a study with so many workers, or as many processes
# which know nothing of each other and share the runs of each cell.
START = """
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from sightfield.diagrams.studies.engine import run_study
from sightfield.diagrams.studies.play import play_block
from sightfield.diagrams.studies.team_studies import tracking_study
workers, runs = int(sys.argv[1]), int(sys.argv[2])
study = tracking_study(runs=runs, vectors=("uniform",), opponents=("adversarial",))
print("ready", flush=True)
"""
STUDY = START + "run_study(study, Path(sys.argv[3]), workers=workers)"
APART = (
    START
    + """
with ProcessPoolExecutor(workers) as pool:
    starts = range(0, runs, runs // workers)
    list(pool.map(play_block, [study] * workers, starts, [k + runs // workers for k in starts]))
"""
)


def race_workers(code, folder):
    """How long a racer with one worker takes, and one with two [s]."""
    folder.mkdir(exist_ok=True)
    racers = []
    for workers in (1, 2):
        words = [sys.executable, "-c", code, str(workers), str(RUNS), str(folder / str(workers))]
        # Half the turn for the one that takes half as long, so that both end together.
        racers.append(Racer(words, TURN / workers))
    return race(*racers)


def test_one_worker_and_two(tmp_path):
    rounds = range(ROUNDS)
    studies = np.array([race_workers(STUDY, tmp_path / f"{k}") for k in rounds])
    apart = np.array([race_workers(APART, tmp_path / f"{k}") for k in rounds])
    ratios, limits = studies[:, 0] / studies[:, 1], apart[:, 0] / apart[:, 1]
    games = RUNS * len(figure(RUNS).cells)
    print(
        f"\n{games} games, in turns of {TURN:g} s: two workers {np.median(ratios):.2f} times as "
        f"fast as one ({ratios.min():.2f} to {ratios.max():.2f}), two processes that know nothing "
        f"of each other {np.median(limits):.2f} times ({limits.min():.2f} to {limits.max():.2f}); "
        f"{16_000 * np.median(studies[:, 1]) / games / 60:.1f} minutes a figure"
    )
