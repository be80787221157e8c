"""The visibility games of a tracking game's world, solved once for all who look them up.

Once in a process; and that of one evader once on a machine, on whose disk it is kept for the next
time. A file's name is a digest of all that a table depends on: the worlds' vertices, each argument
of `solve_visibility_game`, and the sources of the solver, so that a table of an older solver is not
taken for one of this. Files appear whole, and two processes may keep the same table at once. What
cannot be kept or read is said in one line, and the game is solved as if there were no cache.
"""

import hashlib
import inspect
import json
import logging
import os
import time
from collections.abc import Callable, Iterator
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from ...systems.numerics import geometry
from ...systems.numerics.errors import InvalidInput
from ...systems.numerics.geometry.world import World
from ...systems.numerics.tracking import visibility_game
from ...systems.numerics.tracking.visibility_game.bounds import certified_grid, turning_time
from ...systems.numerics.tracking.visibility_game.files import (
    load_guaranteed_times,
    save_guaranteed_times,
)
from ...systems.numerics.tracking.visibility_game.guaranteed_times import (
    GuaranteedTimes,
    solve_visibility_game,
)
from ...systems.numerics.tracking.visibility_game.two_evaders import (
    GuaranteedTimesOfTwo,
    solve_two_evaders,
)
from ..outputs import cache_folder
from .game import TrackingGame

# The folder, instead of one in the user's cache; empty for none.
VARIABLE = "SIGHTFIELD_GAMES"

# All tables together; the ones not used for longest go first [bytes].
MOST_BYTES = 4e9

# What does not change a table, or only whether it may be made.
FREE = ("memory", "progress")

# A file that is still being written after so long was left behind [s].
ABANDONED = 3600.0

_LOG = logging.getLogger(__name__)


def games_folder() -> Path | None:
    """Where tables are kept: by VARIABLE, or in the user's cache; None for nowhere."""
    if VARIABLE in os.environ:
        return Path(os.environ[VARIABLE]) if os.environ[VARIABLE] else None
    try:
        return cache_folder() / "games"
    except RuntimeError:
        # The user has no home.
        return None


def recall_or_solve(
    world: World,
    *,
    folder: Path | None,
    memory: float = 4e9,
    progress: Callable[[float], None] | None = None,
    **options: Any,
) -> tuple[GuaranteedTimes, bool]:
    """The solved visibility game of a world: from the cache, or solved and kept there.

    Args:
        world: Whose obstacles block sight.
        folder: Of the cache, see `games_folder`; None for none.
        memory, progress, options: See `solve_visibility_game`.

    Returns:
        The table, and whether it was solved before.

    Raises:
        InvalidInput: See `solve_visibility_game`.
    """
    path = None if folder is None else folder / f"{_digest(world, options)}.npz"
    if path is not None:
        table = _recall(path)
        if table is not None and table.nbytes <= memory:
            return table, True
    table = solve_visibility_game(world, memory=memory, progress=progress, **options)
    if path is not None:
        _keep(table, path)
    return table, False


def _recall(path: Path) -> GuaranteedTimes | None:
    """A table, if it was kept and is whole."""
    try:
        if not path.exists():
            return None
        table = load_guaranteed_times(path)
        # Used now.
        os.utime(path)
    except InvalidInput as error:
        # Another process may just have removed it.
        if path.exists():
            _LOG.warning("a kept visibility game is solved anew: %s", error)
        return None
    except OSError:
        # It cannot be marked as used, or be looked at.
        return None
    return table


def _keep(table: GuaranteedTimes, path: Path) -> None:
    """Write a table, and make room."""
    if table.nbytes > MOST_BYTES:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        save_guaranteed_times(table, path)
        _make_room(path.parent)
    except (InvalidInput, OSError) as error:
        reason = error.strerror or error if isinstance(error, OSError) else error
        _LOG.warning("the solved visibility game is not kept in %s: %s", path.parent, reason)


def _make_room(folder: Path) -> None:
    """Remove what was not used for longest beyond MOST_BYTES, and what was left behind."""
    now, left = time.time(), MOST_BYTES
    for _, size, path in sorted(_files(folder, "*.npz"), reverse=True):
        left -= size
        if left < 0:
            path.unlink(missing_ok=True)
    for written, _, path in _files(folder, "*.part"):
        if now - written > ABANDONED:
            path.unlink(missing_ok=True)


def _files(folder: Path, pattern: str) -> Iterator[tuple[float, int, Path]]:
    """When each file was used or written last, its size, and its path."""
    for path in folder.glob(pattern):
        try:
            status = path.stat()
        except FileNotFoundError:
            continue
        yield status.st_mtime, status.st_size, path


def _digest(world: World, options: dict[str, Any]) -> str:
    """Of all that a table depends on."""
    call = inspect.signature(solve_visibility_game).bind(world, **options)
    call.apply_defaults()
    digest = hashlib.sha256(metadata.version("sightfield").encode())
    for package in (visibility_game, geometry):
        for folder in package.__path__:
            for file in sorted(Path(folder).glob("*.py")):
                digest.update(file.read_bytes())
    for name, value in call.arguments.items():
        if name not in FREE:
            digest.update(f"{name}={_told(value)};".encode())
    return digest.hexdigest()[:32]


def _told(value: Any) -> str:
    """An argument as text that tells all of it; numbers are told exactly."""
    if isinstance(value, World):
        return json.dumps([ring.tolist() for ring in value.rings])
    if isinstance(value, (tuple, list)):
        return f"[{','.join(_told(each) for each in value)}]"
    return repr(float(value) if isinstance(value, (int, float)) else value)


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


def losing_strips(
    table: GuaranteedTimes,
    visibility_polygon: Callable[[np.ndarray], np.ndarray],
    pursuer: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Strips of cells in a pursuer's sight from which an evader escapes in the end.

    Args:
        table: The game, solved.
        visibility_polygon: From a point to what it sees, shape (n, 2) [m].
        pursuer: Shape (2,) [m].

    Returns:
        x_min, y_min, x_max, y_max of each strip, along x, of cells that are kept equally long,
        shape (k, 4) [m]; and for how long, shape (k,) [s]. None where the pursuer cannot be.
    """
    try:
        times = table.times_from(pursuer)
    except InvalidInput:
        return np.zeros((0, 4)), np.zeros(0)
    grid = table.evader_grid
    points = grid.points
    seen = shapely.Polygon(visibility_polygon(pursuer))
    shapely.prepare(seen)
    losing = np.isfinite(times)
    losing[losing] = shapely.contains_xy(seen, points[losing])
    kept = np.where(losing, times, -1.0)
    # A strip begins and ends where the time changes along a row.
    edges = np.ones((grid.rows, grid.columns + 1), dtype=bool)
    edges[:, 1:-1] = kept[:, 1:] != kept[:, :-1]
    rows, columns = np.nonzero(edges)
    within = rows[1:] == rows[:-1]
    row, first, last = rows[:-1][within], columns[:-1][within], columns[1:][within]
    lost = kept[row, first] >= 0.0
    row, first, last = row[lost], first[lost], last[lost]
    half = 0.5 * grid.spacing
    low, high = grid.at(row, first) - half, grid.at(row, last - 1) + half
    return np.column_stack([low, high]), kept[row, first]
