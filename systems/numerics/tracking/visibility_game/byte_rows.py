"""Loops over bytes of planes: minimum and maximum, and the erosion by an evader's moves.

Each is one loop over arrays that do not overlap, so that the compiler can vectorise it.
"""

import numpy as np

from ...compiled import kernel
from .planes import FOR_EVER


@kernel
def erode(
    plane: np.ndarray,
    stride: int,
    halves: np.ndarray,
    out: np.ndarray,
    odd: np.ndarray,
    even: np.ndarray,
) -> None:
    """out[f] = least of plane[f + move], in a flat plane whose rows are `stride` long.

    Rows and columns within reach of the rim are not meaningful. `odd` and `even` are scratch for
    running minima along rows, whose width grows by one column on each side in turn.

    Args:
        plane: Bytes, shape (f,).
        stride: Length of its rows.
        halves: Of the moves, as of `Rules`.
        out: Written to, shape (f,).
        odd, even: See above, shape (f,).
    """
    size, reach = len(plane), len(halves) // 2
    low, high = reach * stride + reach, size - reach * stride - reach
    target = out[low:high]
    target[:] = FOR_EVER
    for half in range(halves[reach] + 1):
        if half == 1:
            _least(odd[1 : size - 1], plane[: size - 2], plane[1 : size - 1], plane[2:])
        elif half > 1 and half % 2 == 0:
            _lesser(even[1 : size - 1], odd[: size - 2], odd[2:])
        elif half > 1:
            _lesser(odd[1 : size - 1], even[: size - 2], even[2:])
        minima = plane if half == 0 else (odd if half % 2 else even)
        for r in range(-reach, reach + 1):
            if halves[r + reach] == half:
                lower_to(target, minima[low + r * stride : high + r * stride])


@kernel
def copy(out: np.ndarray, values: np.ndarray) -> None:
    """Copy bytes.

    Args:
        out: Written to, shape (n,).
        values: Copied, shape (n,).
    """
    for i in range(len(out)):
        out[i] = values[i]


@kernel
def put_seen(out: np.ndarray, values: np.ndarray, seen: np.ndarray) -> None:
    """Copy values where something is seen; leave the other entries as they are.

    Args:
        out: Written to where something is seen; before, `Rules.blocked` is laid there, shape (n,).
        values: Copied, shape (n,).
        seen: Not 0 where something is seen, shape (n,).
    """
    for i in range(len(out)):
        out[i] = values[i] if seen[i] != 0 else out[i]


@kernel
def step_up(values: np.ndarray, others: np.ndarray, most: np.uint8) -> bool:
    """Set values to others plus one step where something is seen; return whether any changed.

    Args:
        values: Written to, shape (n,); 0 where nothing is seen [steps].
        others: Values less one step, shape (n,) [steps].
        most: The horizon: from this value on, one step more is FOR_EVER [steps].
    """
    different = np.uint8(0)
    for i in range(len(values)):
        # A value beyond the horizon counts as for ever.
        more = others[i] + np.uint8(1) if others[i] < most else np.uint8(FOR_EVER)
        more = more if values[i] != 0 else np.uint8(0)
        different |= values[i] ^ more
        values[i] = more
    return different != 0


@kernel
def is_less_somewhere(values: np.ndarray) -> bool:
    """Whether something is seen that is not kept for ever.

    Args:
        values: 0 where nothing is seen, shape (n,) [steps].
    """
    found = np.uint8(0)
    for i in range(len(values)):
        found |= np.uint8(values[i] != 0) & np.uint8(values[i] != FOR_EVER)
    return found != 0


@kernel
def raise_to(values: np.ndarray, others: np.ndarray) -> None:
    """Write the elementwise maximum of two arrays into the first.

    Args:
        values: Written to, shape (n,).
        others: Compared with, shape (n,).
    """
    for i in range(len(values)):
        values[i] = others[i] if others[i] > values[i] else values[i]


@kernel
def lower_to(values: np.ndarray, others: np.ndarray) -> None:
    """Write the elementwise minimum of two arrays into the first.

    Args:
        values: Written to, shape (n,).
        others: Compared with, shape (n,).
    """
    for i in range(len(values)):
        values[i] = others[i] if others[i] < values[i] else values[i]


@kernel
def _lesser(out, a, b):
    for i in range(len(out)):
        out[i] = a[i] if a[i] < b[i] else b[i]


@kernel
def _least(out, a, b, c):
    for i in range(len(out)):
        least = a[i] if a[i] < b[i] else b[i]
        out[i] = least if least < c[i] else c[i]
