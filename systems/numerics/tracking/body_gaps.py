"""How near robots came to one another, from a log of where they were.

Source: ours; closest approach of points in uniform motion.
"""

import numpy as np


def pair_gaps(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Gap between the bodies of each pair [m], negative where they overlap.

    Args:
        positions: Of all robots, shape (..., N, 2) [m].
        radii: Theirs, shape (N,) [m].

    Returns:
        Shape (..., N (N - 1) / 2); pairs in the order of `numpy.triu_indices`.
    """
    first, second = np.triu_indices(len(radii), 1)
    offsets = positions[..., first, :] - positions[..., second, :]
    return np.hypot(offsets[..., 0], offsets[..., 1]) - radii[first] - radii[second]


def gaps_between_samples(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """Least gap of each pair from one sample to the next, all moving straight in between [m].

    Args:
        positions: Shape (T, N, 2) [m].
        radii: Shape (N,) [m].

    Returns:
        Shape (T - 1, N (N - 1) / 2).
    """
    first, second = np.triu_indices(len(radii), 1)
    offsets = positions[:, first] - positions[:, second]
    start, change = offsets[:-1], np.diff(offsets, axis=0)
    square = np.einsum("tpk,tpk->tp", change, change)
    towards = -np.einsum("tpk,tpk->tp", start, change)
    moment = np.clip(np.divide(towards, square, out=np.zeros_like(square), where=square > 0), 0, 1)
    nearest = start + moment[..., None] * change
    return np.hypot(nearest[..., 0], nearest[..., 1]) - radii[first] - radii[second]


def count_contacts(gaps: np.ndarray) -> int:
    """How often a pair comes to overlap that did not before.

    Args:
        gaps: In time, from `gaps_between_samples`, shape (T, pairs) [m].
    """
    overlaps = gaps < 0.0
    return int(overlaps[:1].sum() + (overlaps[1:] & ~overlaps[:-1]).sum())
