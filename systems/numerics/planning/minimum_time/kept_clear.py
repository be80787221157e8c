"""Paths of the programme that are kept clear of walls between its nodes too.

By the spline a path is clear at its nodes, or, in a narrow passage, nearly so. From there it is
solved again beside the walls that it faces, and where it still dips into a wall between two looks
it is told to keep off by as much.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..footprint import overlaps_along
from ..plan import TrailerPath
from .problem import Attempt, Problem, resampled

# Overlap with a wall above which a path is pushed away; and the deepest overlap that counts as none
# where that does not help. They are relative to the trailer's length.
_CLEAR = 1e-5
ACCEPTED_OVERLAP = 1e-3
# A margin grows by so many times the overlap that was seen.
_PUSH = 1.5
# How far a path may move in a run: at first, at most and at least, in radii of the smallest disc;
# and how much farther after a run that made it quicker, and after one that led into a wall.
_REACH, _FARTHEST, _LEAST = 0.5, 1.0, 0.02
_LONGER, _SHORTER = 2.0, 0.25
# Share of its time by which a path gets quicker when it moves; and after how many runs that neither
# move it nor get it out of a wall it is left as it is.
_MOVED, _DIPS = 0.01, 5
# A path that is none yet gets nearer to one while a run leaves at most this share of its violation.
_FALLS = 0.98
# Most runs, and the least share of time that one must save to be followed by another: first, and
# when the best path is divided more finely.
_RUNS, _MORE = 30, 1e-3
_FINER_RUNS, _LESS = 8, 1e-4
# A path counts as nearly clear while it overlaps by less than this share of the smallest disc.
_NEARLY = 0.5
# Longest intervals beside walls [1 / turn rate], and numbers of them: few, for each makes another
# programme, which takes seconds to build.
_LONGEST, _INTERVALS = 0.2, (60, 120, 240)
# A path is beside a wall while it leaves less room than this share of the smallest disc.
_BESIDE = 0.1
# How many paths are tried, and the least share of time that another must promise to save.
_MOST_TRIED, _SAVED = 4, 1e-3


@dataclass(frozen=True, eq=False)
class Kept:
    """A path among walls.

    Attributes:
        attempt: The path.
        overlap: Largest depth of a disc in a wall, between nodes too; negative: the least room [m].
    """

    attempt: Attempt
    overlap: float

    def is_clear(self, problem: Problem) -> bool:
        """Whether its overlap counts as none.

        Args:
            problem: For the length of its trailer.
        """
        return self.overlap <= ACCEPTED_OVERLAP * problem.trailer.length

    def rank(self, problem: Problem) -> tuple[bool, bool, bool, float]:
        """Sorts clear paths before those that just count as clear, then by `Attempt.rank`.

        Args:
            problem: For the length of its trailer.
        """
        touches = self.overlap > _CLEAR * problem.trailer.length
        return not self.is_clear(problem), touches, *self.attempt.rank


def best_kept_clear(
    problem: Problem, attempts: Sequence[Attempt], known: float = math.inf
) -> tuple[Kept | None, int]:
    """Keep the quickest attempts clear of walls, those that are only nearly clear among them.

    Args:
        problem: Among walls.
        attempts: By the spline.
        known: Time of a path that is known; none that promises to be slower is tried [s].

    Returns:
        The best path, and how many iterations led to paths beside walls; None: there is no path.
    """
    assert problem.discs is not None
    smallest = min(problem.discs.radii)
    best, found, tried = None, [], set[float]()
    for each in sorted(attempts, key=lambda each: (not each.is_path, each.rank)):
        if best is not None and best.is_clear(problem):
            known = min(known, best.attempt.time)
        if each.time >= (1 - _SAVED) * known:
            continue
        if len(tried) == _MOST_TRIED:
            break
        # The same time to six digits means the same path.
        alike = float(f"{each.time:.5e}")
        overlap = float(overlaps_by_interval(problem, each.path).max())
        if alike in tried or not (each.is_path or overlap < _NEARLY * smallest):
            continue
        tried.add(alike)
        if each.is_path:
            found.append(Kept(replace(each, iterations=0), overlap))
        if overlap > -_BESIDE * smallest:
            turned = each.time * problem.trailer.turn_rate
            intervals = next((n for n in _INTERVALS if turned < _LONGEST * n), _INTERVALS[-1])
            found += kept_clear(problem, each.path, intervals, _RUNS, _MORE)
        best = min(found, key=lambda kept: kept.rank(problem), default=None)
    if best is not None and best.overlap > -_BESIDE * smallest:
        path = best.attempt.path
        finer = min(2 * len(path.controls), _INTERVALS[-1])
        found += kept_clear(problem, path, finer, _FINER_RUNS, _LESS)
        best = min(found, key=lambda kept: kept.rank(problem))
    return best, sum(kept.attempt.iterations for kept in found)


def overlaps_by_interval(problem: Problem, path: TrailerPath) -> np.ndarray:
    """Largest depth of a disc in a wall in each interval of a path, shape (n,) [m].

    Infinite, if the states are not finite or the times do not increase.

    Args:
        problem: Among walls.
        path: With a state at each end of each interval.
    """
    world, discs = problem.obstacles, problem.discs
    assert world is not None
    assert discs is not None
    n = len(path.controls)
    if not (np.isfinite(path.states).all() and (np.diff(path.times) > 0).all()):
        return np.full(n, np.inf)
    times, depths = overlaps_along(world, discs, path, problem.trailer)
    last = np.searchsorted(path.times, times, side="right").clip(max=n) - 1
    # A node belongs to the intervals on both of its sides.
    first = np.searchsorted(path.times, times, side="left").clip(1, n) - 1
    deepest = np.full(n, -np.inf)
    np.maximum.at(deepest, last, depths)
    np.maximum.at(deepest, first, depths)
    return deepest


def kept_clear(
    problem: Problem, path: TrailerPath, intervals: int, runs: int, less: float
) -> list[Kept]:
    """Solve again and again beside the walls that a path faces, until it is clear and no quicker.

    Each run moves the path only so far that these are still the walls that it faces; how far that
    is shows afterwards. Margins make up for overlaps between looks.

    Args:
        problem: Among walls.
        path: Clear of them, or nearly.
        intervals: In how many the path is divided.
        runs: Of the solver, at most.
        less: Least share of time for which it is solved again.

    Returns:
        The paths that were found on the way, the last one being the clearest.
    """
    discs = problem.discs
    assert discs is not None
    smallest = min(discs.radii)
    found, margins, reach = [], np.zeros(intervals), _REACH * smallest
    violation, dips = math.inf, 0
    for _ in range(runs):
        if reach < _LEAST * smallest or dips == _DIPS:
            break
        pushed = problem.solve_beside_walls(resampled(path, intervals), margins, reach)
        overlaps = overlaps_by_interval(problem, pushed.path)
        depth = float(overlaps.max())
        if pushed.status != "optimal" or depth > _NEARLY * smallest:
            reach *= _SHORTER
            continue
        before = float(path.times[-1])
        moved, path = pushed.time < (1 - _MOVED) * before, pushed.path
        if not pushed.is_path:
            dips += pushed.violation > _FALLS * violation
            violation = pushed.violation
            continue
        found.append(Kept(pushed, depth))
        clear = depth <= _CLEAR * problem.trailer.length
        if clear and pushed.time >= (1 - less) * before:
            break
        # Margins hold for where it was.
        if moved:
            margins[:] = 0.0
        margins += _PUSH * np.maximum(overlaps, 0.0)
        dips = 0 if clear or moved else dips + 1
        reach = min(_LONGER * reach, _FARTHEST * smallest) if clear or moved else reach
    return found
