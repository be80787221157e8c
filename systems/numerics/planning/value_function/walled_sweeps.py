"""Sweeps among walls: a step may end in a cell of which only some nodes are in reach.

In the open a value that is mixed from an unreachable node is unreachable itself. Beside walls, and
on the narrow way into a goal close behind one, that would shut passages of several cells. Whether
the way is free is known exactly, so here the nodes in reach speak for the cell, once they have
half of its weight: that puts the edge of what is in reach between the nodes, to neither side.
"""

import numpy as np

from ...compiled import compiled, kernel
from .sweeps import FAR, LIMIT, between, blend, blend_four

# Weight of the reachable nodes from which on they stand for their cell.
MAJORITY = np.float32(0.5)
ZERO = np.float32(0.0)
ONE = np.float32(1.0)


@kernel
def _blend_known(a, b, part, values, known):
    """Values in reach times their weights, and the weights."""
    rest = ONE - part
    for i in range(len(values)):
        one, two = a[i] < LIMIT, b[i] < LIMIT
        values[i] = (rest * a[i] if one else ZERO) + (part * b[i] if two else ZERO)
        known[i] = (rest if one else ZERO) + (part if two else ZERO)


@kernel
def _take_linear(values, known, part, time, shut, bit, best):
    """Best so far, or the mean of the nodes in reach plus the time of an open step."""
    rest = ONE - part
    for i in range(len(best)):
        weight = rest * known[i] + part * known[i + 1]
        value = (rest * values[i] + part * values[i + 1]) / max(weight, MAJORITY) + time
        value = value if weight >= MAJORITY and not shut[i] & bit else FAR
        best[i] = value if value < best[i] else best[i]


@kernel
def _take_cubic(line, values, known, part, time, shut, bit, best):
    """The same, with the cubic instead where all of its nodes are in reach."""
    rest = ONE - part
    for i in range(len(best)):
        weight = rest * known[i] + part * known[i + 1]
        mean = (rest * values[i] + part * values[i + 1]) / max(weight, MAJORITY)
        mean = mean if weight >= MAJORITY else FAR
        cubic = between(line[i], line[i + 1], line[i + 2], line[i + 3], part)
        value = (cubic if cubic < LIMIT else mean) + time
        value = FAR if shut[i] & bit else value
        best[i] = value if value < best[i] else best[i]


@compiled
def sweep_walled_row(table, t, cubic, shut, durations, turns, xc, xp, yc, yp, bc, bp, width, best):
    """The best update of all nodes of one theta row; otherwise
    arguments as those of `sweep_row`.

    Args:
        shut: Whether each control's way is shut, by bit, shape of the table.
    """
    theta_count, beta_count, n = table.shape
    margin = (np.abs(yc).max() + 3) * width + np.abs(xc).max() + 3
    values = np.zeros(n + 2 * margin, dtype=np.float32)
    known = np.zeros(n + 2 * margin, dtype=np.float32)
    plane = np.full(n + 2 * margin, FAR, dtype=np.float32)
    value_line = np.empty(n + 1, dtype=np.float32)
    known_line = np.empty(n + 1, dtype=np.float32)
    line = np.empty(n + 3, dtype=np.float32)
    end = margin + n
    for b in range(beta_count):
        best[b] = table[t, b]
        if cubic:
            best[b] = FAR
        for c in range(len(durations)):
            if bc[c, b] < 0:
                continue
            source = table[(t + turns[c]) % theta_count]
            k = bc[c, b]
            p1, p2 = source[k], source[(k + 1) % beta_count]
            foot = margin + yc[c, t] * width + xc[c, t]
            bit = np.uint32(1) << np.uint32(c)
            _blend_known(p1, p2, bp[c, b], values[margin:end], known[margin:end])
            blend(values[foot:], values[foot + width :], yp[c, t], value_line)
            blend(known[foot:], known[foot + width :], yp[c, t], known_line)
            if not cubic:
                _take_linear(
                    value_line, known_line, xp[c, t], durations[c], shut[t, b], bit, best[b]
                )
                continue
            p0, p3 = source[(k - 1) % beta_count], source[(k + 2) % beta_count]
            blend_four(p0, p1, p2, p3, bp[c, b], plane[margin:end])
            blend_four(
                plane[foot - 1 - width :],
                plane[foot - 1 :],
                plane[foot - 1 + width :],
                plane[foot - 1 + 2 * width :],
                yp[c, t],
                line,
            )
            _take_cubic(
                line, value_line, known_line, xp[c, t], durations[c], shut[t, b], bit, best[b]
            )
