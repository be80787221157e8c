"""Playing games for their times alone, and what is guaranteed at their starts.

Guaranteed is what the solved visibility game promises, whatever evaders do: with as many pursuers
as evaders or more, that of the best matching, each pursuer with its own evader; with fewer, that of
the best way to share the evaders out. By the middle bound. One against one that is the value of the
game, which no strategy beats against the best evader; a team may do better by changing its matching
on the way.
"""

import json
import math
from dataclasses import asdict
from functools import lru_cache

import numpy as np
from pydrake.systems.analysis import Simulator

from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.team_sight import sight_matrix
from ...systems.numerics.geometry.world import World
from ...systems.numerics.run_seeds import run_seed
from ...systems.numerics.tracking.visibility_game.board import make_board
from ...systems.numerics.tracking.visibility_game.bottleneck import bottleneck, certificate
from ...systems.numerics.tracking.visibility_game.pursuit import pair_worths
from ...systems.numerics.tracking.visibility_game.responsibilities import (
    NOBODY,
    make_team_board,
    prospects,
    responsibilities,
    shared_certificate,
)
from ..scenario_files import build
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.make_tracking import MakeTracking
from ..tracking.solved_game import solved_game, solved_game_of_two
from ..world_source import WorldSource
from .opponents import match_of
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


def guaranteed_at_start(game: TrackingGame) -> float:
    """For how long the team can keep all evaders from its starts [s]; infinite if for ever.

    Args:
        game: Whose starts.

    Raises:
        InvalidInput: See `solved_game` and `solved_game_of_two`.
    """
    table = solved_game(game)
    pursuers, evaders = game.pursuer_starts[:, :2], game.evader_starts[:, :2]
    seen = sight_matrix(build_edge_index(game.world), pursuers.ravel(), evaders.ravel())
    visible = seen.reshape(len(pursuers), len(evaders)) > 0.5
    places = np.ascontiguousarray(pursuers.ravel()), np.ascontiguousarray(evaders.ravel())
    if len(pursuers) >= len(evaders):
        steps, worth = pair_worths(make_board(table), *places, visible)
        # Sight ends somewhere within the last step.
        return table.step * max(certificate(bottleneck(worth), steps) - 0.5, 0.0)
    board = make_team_board(table, solved_game_of_two(game))
    one, two = prospects(board, *places, visible)
    held = np.full(len(evaders), NOBODY)
    owners = responsibilities(one, two, visible, held, board.steps[1])
    return float(shared_certificate(one, two, owners))


def guarantees_of_study(study: Study, runs: int) -> dict[str, np.ndarray]:
    """What is guaranteed at the starts of a study's first runs, by the sizes of the teams.

    Args:
        study: Whose cells are named by `cell_name`; those with teams of the same sizes have the
            same starts.
        runs: How many.

    Returns:
        By "3v4", shape (runs,) [s].
    """
    scenarios = {}
    for cell in study.cells:
        match = match_of(cell.name)
        size = f"{match.pursuers}v{match.evaders}"
        scenarios.setdefault(size, cell_scenario(study, cell))
    found = {size: np.empty(runs) for size in scenarios}
    for run in range(runs):
        world = study.drawn_world(run)
        for size, scenario in scenarios.items():
            game = set_up_game(in_world(scenario, world, run_seed(study.seed, run)), world)
            found[size][run] = guaranteed_at_start(game)
    return found
