"""The visibility games of a tracking game's world, solved once for all who look them up.

Once in a process; and that of one evader once on a machine where its cache is kept, see
`game_cache`.
"""

from functools import lru_cache

from ...systems.numerics.geometry.world import World
from ...systems.numerics.tracking.visibility_game.certificates import certified_grid, turning_time
from ...systems.numerics.tracking.visibility_game.guaranteed_times import GuaranteedTimes
from ...systems.numerics.tracking.visibility_game.two_evaders import (
    GuaranteedTimesOfTwo,
    solve_two_evaders,
)
from .game import TrackingGame
from .game_cache import games_folder, recall_or_solve


def solved_game(game: TrackingGame, bound: str = "middle") -> GuaranteedTimes:
    """One pursuer and one evader in a game's world, on the scenario's grid.

    By the lower bound the grid is a little finer, so that a step is a number of periods, and
    differential drives have the time to turn in each step.

    Args:
        game: Whose world, robots and grid.
        bound: One of the bounds of `solve_visibility_game`.

    Raises:
        InvalidInput: See `solve_visibility_game`.
    """
    pursuers, evaders = game.scenario.pursuers, game.scenario.evaders
    grid, turning = pursuers.grid, 0.0
    if bound == "lower" and pursuers.model == "differential_drive":
        turning = turning_time(pursuers.top_turn_rate, game.scenario.period)
    if bound == "lower":
        grid = certified_grid(grid, pursuers.top_speed, game.scenario.period)
    return _solved(
        game.world,
        game.pursuer_regions,
        game.evader_regions,
        pursuers.top_speed,
        evaders.top_speed,
        grid,
        bound,
        turning,
    )


def solved_game_of_two(game: TrackingGame) -> GuaranteedTimesOfTwo:
    """One pursuer and two evaders in a game's world, on the scenario's grid for them.

    Args:
        game: Whose world, robots and grid.

    Raises:
        InvalidInput: See `solve_two_evaders`.
    """
    pursuers, evaders = game.scenario.pursuers, game.scenario.evaders
    return _solved_of_two(
        game.world,
        game.pursuer_regions,
        game.evader_regions,
        pursuers.top_speed,
        evaders.top_speed,
        pursuers.grid_of_two,
    )


# Both bounds of a game and of the same without bodies, played in turns.
@lru_cache(maxsize=4)
def _solved(
    world: World,
    pursuer_regions: tuple[World, ...],
    evader_regions: tuple[World, ...],
    pursuer_speed: float,
    evader_speed: float,
    grid: float,
    bound: str,
    turning: float,
) -> GuaranteedTimes:
    table, _ = recall_or_solve(
        world,
        folder=games_folder(),
        pursuer_speed=pursuer_speed,
        evader_speed=evader_speed,
        grid=grid,
        bound=bound,
        pursuer_regions=pursuer_regions,
        evader_regions=evader_regions,
        turning_time=turning,
    )
    return table


@lru_cache(maxsize=4)
def _solved_of_two(
    world: World,
    pursuer_regions: tuple[World, ...],
    evader_regions: tuple[World, ...],
    pursuer_speed: float,
    evader_speed: float,
    grid: float,
) -> GuaranteedTimesOfTwo:
    return solve_two_evaders(
        world,
        pursuer_speed=pursuer_speed,
        evader_speed=evader_speed,
        grid=grid,
        pursuer_regions=pursuer_regions,
        evader_regions=evader_regions,
    )
