"""Playing games for their times alone, through the tracking diagram, without logs."""

import json
import math
from dataclasses import asdict
from functools import lru_cache

import numpy as np
from pydrake.systems.analysis import Simulator

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.geometry.world import World
from ...systems.numerics.statistics import run_seed
from ..scenario_files import build
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.make_tracking import MakeTracking
from ..world_source import WorldSource
from .study import Study, cell_scenario, in_world

# How often a game looks whether it is over [s].
_STRIDE = 1.0

# What is noted of a game: its cell, number and seed; the teams' sizes; the horizon [s]; the time
# until an evader was first seen by nobody, at most the horizon [s]; whether none was; the evader.
COLUMNS = (
    "cell",
    "run",
    "seed",
    "pursuers",
    "evaders",
    "horizon",
    "time",
    "censored",
    "lost_evader",
)

# Rows by column, all of one length.
Rows = dict[str, list]


def play(game: TrackingGame) -> tuple[float, int]:
    """Play a game to the first loss of sight or to the horizon.

    Returns:
        Tracking time [s], and the number of the evader that was lost, or -1 at the horizon; as
        `run_tracking` finds them.

    Raises:
        InvalidInput: An evader is yours to drive.
    """
    scenario = game.scenario
    diagram = MakeTracking(game)
    simulator = Simulator(diagram)
    loss, context = diagram.GetOutputPort("loss"), simulator.get_context()
    # Whole periods: the last one may reach beyond the horizon.
    horizon = scenario.period * math.ceil(scenario.seconds / scenario.period - 1e-9)
    reached, strides = 0.0, 0
    while reached < horizon:
        strides += 1
        reached = min(strides * max(_STRIDE, scenario.period), horizon)
        simulator.AdvanceTo(reached)
        if reached == horizon:
            # The sample at the horizon itself is otherwise taken in the step that would follow.
            simulator.AdvancePendingEvents()
        lost_at, evader = np.asarray(loss.Eval(context))
        if lost_at <= scenario.seconds:
            return float(lost_at), int(evader)
    return float(scenario.seconds), -1


def play_block(study: Study, start: int, stop: int) -> Rows:
    """Play the runs from start to stop of every cell that has them.

    Runs of one number share their world, and so do runs that share an arena.

    Raises:
        InvalidInput: A game cannot be set up.
    """
    scenarios = [
        (cell.name, study.runs_of(cell), cell_scenario(study, cell)) for cell in study.cells
    ]
    rows: Rows = {name: [] for name in COLUMNS}
    drawn = study.drawn_world(start)
    for run in range(start, stop):
        seed = run_seed(study.seed, run)
        if run % study.starts_per_arena == 0:
            drawn = study.drawn_world(run)
        for name, runs, each in scenarios:
            if run >= runs:
                continue
            scenario = in_world(each, drawn, seed)
            try:
                world = drawn or _fixed_world(json.dumps(asdict(scenario.world)))
                time, evader = play(set_up_game(scenario, world))
            except InvalidInput as error:
                raise InvalidInput(f"{error} (in cell {name}, run {run})") from None
            teams = scenario.pursuers.size, scenario.evaders.size
            row = (name, run, seed, *teams, float(scenario.seconds), time, evader < 0, evader)
            for column, value in zip(COLUMNS, row, strict=True):
                rows[column].append(value)
    return rows


# Real maps take long to load, and a process plays many blocks in the same few.
@lru_cache(maxsize=8)
def _fixed_world(source: str) -> World:
    return build(WorldSource, json.loads(source)).load()
