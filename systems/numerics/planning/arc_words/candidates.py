"""Words into a goal box from rough ones, without a table: each is made as short as it can be."""

import math
from collections.abc import Callable, Iterable

import numpy as np

from ..dubins import dubins_paths
from ..goal import Goal
from ..reeds_shepp import reeds_shepp_paths
from ..trailer import Trailer
from .quickest import ArcWord, word_path
from .shortened import Clearance, is_steady, merged, shortened, shortest, with_more_switches

# Words of Reeds and Shepp that are tried, and words that are given more switches.
REEDS_SHEPP_WORDS, REFINED = 8, 2
# A switch must save more time than this [1 / turn rate].
SWITCH = 1e-6


def quickest_words(
    trailer: Trailer,
    start,
    words: Iterable[ArcWord],
    goal: Goal,
    allowed: Callable[[ArcWord], bool],
    clearance: Clearance | None = None,
) -> list[ArcWord]:
    """The words near others that take the least time into a box, the quickest first.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        words: Near which to look; they need not lead into the box.
        goal: The box, or point.
        allowed: Says of a word whether it may be driven.
        clearance: See `shortened`.
    """

    def kept(found: Iterable[ArcWord | None]) -> list[ArcWord]:
        steady = (
            word for word in found if word is not None and is_steady(trailer, start, word, goal)
        )
        return [word for word in steady if allowed(word)]

    near = kept(shortened(trailer, start, word, goal, clearance) for word in words)
    near.sort(key=lambda word: rank(word, trailer))
    near += kept([shortest(trailer, start, word, goal, clearance) for word in near[:REFINED]])
    return sorted(near, key=lambda word: rank(word, trailer))


def rank(word: ArcWord, trailer: Trailer) -> float:
    """Sorts words by time, then by their switches [1 / turn rate]."""
    return word.time * trailer.turn_rate + SWITCH * len(word.durations)


def car_words(trailer: Trailer, start, goal: Goal, longest: float = math.inf) -> list[ArcWord]:
    """Words of a car to the middle of a box, with more switches for the trailer.

    Args:
        trailer: Which drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, or point.
        longest: Longer words are left out [1 / turn rate].
    """
    radius = trailer.speed / trailer.turn_rate
    first, last = tuple(float(entry) for entry in start[:3]), goal.state[:3]
    paths = dubins_paths(first, last, radius)
    if trailer.reverse:
        paths += reeds_shepp_paths(first, last, radius)[:REEDS_SHEPP_WORDS]
    words = []
    for path in paths:
        ways = np.array(path.lengths)
        if np.abs(ways).sum() <= longest * radius:
            turns = np.sign(ways) * np.array(path.turns) * trailer.turn_rate
            controls = np.column_stack([np.sign(ways) * trailer.speed, turns])
            word = merged(ArcWord(controls, np.abs(ways) / trailer.speed))
            words.append(with_more_switches(word, trailer))
    return words


def keeps_limit(trailer: Trailer, start, word: ArcWord) -> bool:
    """Whether a word keeps within the jackknife limit, or within what beta was at the start.

    Args:
        trailer: With the limit.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        word: Its arcs, or none.
    """
    limit = max(trailer.jackknife, abs(math.remainder(float(start[3]), math.tau)))
    if limit >= math.pi or not len(word.durations):
        return True
    bent = np.remainder(word_path(trailer, start, word).states[:, 3] + math.pi, math.tau) - math.pi
    return bool((np.abs(bent) <= limit + 1e-9).all())
