"""What makes good solutions better: switches in place, and walls kept clear between nodes."""

from ..vehicle.overlap import deepest_overlap
from .arcs import split_into_arcs
from .guess import FREE, resampled
from .problem import Attempt, Problem

# Of each arc, when switches are put in their places; paths of more arcs are left as they are.
INTERVALS_PER_ARC = 15
MOST_ARCS = 10
# Solutions that take at most this many times the least time get their switches placed: equal
# intervals cost up to a hundredth of the time, so that the second best may be the best.
NEAR_BEST = 1.01
# Deepest overlap with a wall that still counts as none [m], relative to the trailer's length, and
# how often a path that reaches deeper is pushed away.
ACCEPTED_OVERLAP = 1e-3
_MOST_PUSHES = 4


def with_placed_switches(problem: Problem, found: list[Attempt]) -> list[Attempt]:
    """Solve again from the best attempts, with one duration for each of their arcs."""
    least = min(each.time for each in found)
    seen: set[float] = set()
    better = []
    for each in found:
        # The same time to five decimals means the same path.
        key = round(each.time / least, 5)
        if key <= NEAR_BEST and key not in seen:
            seen.add(key)
            guess = split_into_arcs(each.path, problem.trailer, INTERVALS_PER_ARC)
            freedom = len(guess.durations) + int((guess.signs == FREE).sum())
            exact_goals = problem.goal.tolerance.count(0)
            # Few arcs may leave nothing to choose: then every switch is where it must be.
            if len(guess.durations) <= MOST_ARCS and freedom >= exact_goals:
                better.append(problem.solve(guess))
    return better


def kept_clear(problem: Problem, best: Attempt) -> tuple[list[Attempt], float]:
    """Solve again with twice as many nodes, and margins as large as the overlaps between them.

    Returns:
        What was found on the way, the last one being the clearest, and its overlap [m].
    """
    assert problem.obstacles is not None
    assert problem.discs is not None
    intervals = 2 * len(best.path.controls)
    found, margin = [best], 0.0
    overlap = deepest_overlap(problem.obstacles, problem.discs, best.path.states)
    for _ in range(_MOST_PUSHES):
        if overlap <= ACCEPTED_OVERLAP * problem.trailer.length:
            break
        pushed = problem.solve(resampled(found[-1].path, intervals), margin)
        if not pushed.is_path:
            break
        found.append(pushed)
        overlap = deepest_overlap(problem.obstacles, problem.discs, pushed.path.states)
        margin += max(overlap, 0.0)
    return found, max(overlap, 0.0)
