"""Words of arcs, each one control held for a while, and where they take the cart, in closed form.

What a word does to the trailer's angle is the product of the matrices of its arcs.
"""

import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..trailer import Trailer, half_angle_map, half_angles, shift_of


def normalised(trailer: Trailer) -> Trailer:
    """The same trailer with lengths in turning radii and times in 1 / turn rate."""
    radius = trailer.radius
    return Trailer(
        length=trailer.length / radius,
        hitch_offset=trailer.hitch_offset / radius,
        reverse=trailer.reverse,
        jackknife=trailer.jackknife,
    )


def control_set(trailer: Trailer) -> np.ndarray:
    """v, omega in {-1, 0, 1}, shape (3, 2), or (6, 2) with reverse."""
    speeds = (1, -1) if trailer.reverse else (1,)
    return np.array([(v, omega) for v in speeds for omega in (-1, 0, 1)])


class Words(NamedTuple):
    """Words from a common start at the origin, heading along x; lengths in turning radii.

    Attributes:
        ends: dx, dy, dtheta, duration, shape (n, 4).
        maps: What they do to the half angle of the trailer, see `half_angle_map`, shape (n, 2, 2).
        last: Number of their last control, -1 of the empty word, shape (n,).
        roots: Number of the word that is one lattice step shorter; of the empty word itself,
            shape (n,).
    """

    ends: np.ndarray
    maps: np.ndarray
    last: np.ndarray
    roots: np.ndarray


def angles_after(maps, betas) -> np.ndarray:
    """Beta after each of some words, in (-pi, pi], shape (n, m) [rad].

    Args:
        maps: Of the words, shape (n, 2, 2).
        betas: At their start, shape (m,) [rad].
    """
    s, c = np.moveaxis(np.einsum("nij,mj->nmi", maps, half_angles(betas)), -1, 0)
    return np.remainder(2 * np.arctan2(s, c) + math.pi, math.tau) - math.pi


def words_of(trailer: Trailer, arcs: int, longest: float, lattice: float) -> Words:
    """All words of up to so many arcs, whose durations are multiples of a lattice.

    No two neighbours are alike, and no arc turns by a whole turn.

    Args:
        trailer: Normalised.
        arcs: Largest number of arcs; 0: the empty word alone.
        longest: Largest duration of a word [1 / turn rate].
        lattice: Step of the durations [1 / turn rate].
    """
    controls = control_set(trailer)
    empty = Words(np.zeros((1, 4)), np.eye(2)[None], np.array([-1]), np.array([0]))
    parts, level, first = [empty], empty, 0
    times = lattice * np.arange(1, math.floor(longest / lattice + 1e-9) + 1)
    all_maps = [half_angle_map(trailer, v, omega, times) for v, omega in controls]
    for _ in range(arcs):
        found = []
        count = first + len(level.ends)
        for number in range(len(level.ends)):
            for control, (v, omega) in enumerate(controls):
                if control == level.last[number]:
                    continue
                x, y, theta, spent = level.ends[number]
                limit = min(longest - spent, math.tau - lattice) if omega else longest - spent
                most = max(0, math.floor(limit / lattice + 1e-9))
                held = times[:most]
                dx, dy = shift_of(theta, v, omega, held)
                ends = np.column_stack([x + dx, y + dy, theta + omega * held, spent + held])
                maps = all_maps[control][:most] @ level.maps[number]
                roots = np.arange(count - 1, count - 1 + most)
                roots[:1] = first + number
                found.append(Words(ends, maps, np.full(most, control), roots))
                count += most
        first += len(level.ends)
        level = _joined(found)
        parts.append(level)
    return _joined(parts)


def _joined(parts: list[Words]) -> Words:
    return Words(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def within_jackknife(words: Words, betas, limit: float) -> np.ndarray:
    """Whether beta keeps within a limit, or within its value at the start, all along each word.

    It is checked at the points of the lattice.

    Args:
        words: From `words_of`.
        betas: At the start, shape (m,) [rad].
        limit: Largest |beta| [rad].

    Returns:
        Shape (n, m).
    """
    if limit >= math.pi:
        return np.ones((len(words.ends), len(betas)), dtype=bool)
    size = np.abs(angles_after(words.maps, betas))
    allowed = size <= np.maximum(limit, size[0]) + 1e-9
    _inherit(allowed, words.roots)
    return allowed


@compiled
def _inherit(allowed, roots):
    """A word is allowed where the word that it continues is, too; roots come first."""
    for number in range(len(roots)):
        allowed[number] &= allowed[roots[number]]


class Endings(NamedTuple):
    """What may follow some words: one control, held until a sample of time.

    Attributes:
        control: Its number.
        words: Those whose last control is another.
        numbers: Index of each of them among all words, shape (n,).
        lengths: Largest number of a sample after each word, shape (n,).
        shifts: dx, dy, dtheta until each sample, shape (n_samples, 3).
        maps: What they do to the half angle of the trailer, shape (n_samples, 2, 2).
    """

    control: int
    words: Words
    numbers: np.ndarray
    lengths: np.ndarray
    shifts: np.ndarray
    maps: np.ndarray


def endings_of(
    trailer: Trailer, words: Words, longest: float, reach: float, sample: float
) -> list[Endings]:
    """The last arcs of words, one set for each control.

    Args:
        trailer: Normalised.
        words: What comes before.
        longest: Largest duration of a word with its last arc [1 / turn rate].
        reach: Largest duration of a straight alone [1 / turn rate]; a turn alone may go once round.
        sample: Distance of samples [1 / turn rate].
    """
    found = []
    for control, (v, omega) in enumerate(control_set(trailer)):
        count = math.ceil((math.tau if omega else reach) / sample)
        times = sample * np.arange(count + 1)
        shifts = np.column_stack([*shift_of(0.0, v, omega, times), omega * times])
        numbers = np.flatnonzero(words.last != control)
        chosen = Words(*(column[numbers] for column in words))
        lengths = ((longest - chosen.ends[:, 3]) / sample).astype(int).clip(0, count) + 1
        lengths[0] = count
        maps = half_angle_map(trailer, v, omega, times)
        found.append(Endings(control, chosen, numbers, lengths, shifts, maps))
    return found
