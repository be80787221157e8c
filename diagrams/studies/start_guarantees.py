"""What the solved visibility game guarantees at the start of a game, whatever evaders do.

With as many pursuers as evaders or more, that of the best matching, each pursuer with its own
evader; with fewer, that of the best way to share the evaders out. By the middle bound. One against
one that is the value of the game, which no strategy beats against the best evader; a team may do
better by changing its matching on the way.
"""

import numpy as np

from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.team_sight import sight_matrix
from ...systems.numerics.statistics import run_seed
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
from ..tracking.game import TrackingGame, set_up_game
from ..tracking.solved_game import solved_game, solved_game_of_two
from .opponents import match_of
from .study import Study, cell_scenario, in_world


def guaranteed_at_start(game: TrackingGame) -> float:
    """For how long the team can keep all evaders from its starts [s]; infinite for ever.

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
