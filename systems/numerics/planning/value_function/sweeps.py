"""Sweeps over the grid: every node takes the best of its long steps.

For one pair of angles and one control the foot points of all (x, y) nodes are shifted alike, so
an update is a stencil over a plane: first the planes of neighbouring beta nodes are combined,
then rows, then columns. A plane is one long line, its rows parted by unreachable columns, so that
a shift beyond an edge finds what it should. Inside, times are in 1 / turn rate and unreachable is
FAR, because infinity times zero is not a number.
"""

import numpy as np

from ...compiled import compiled, kernel

# Stands for infinity; a value that is mixed from one exceeds LIMIT.
FAR = np.float32(1e12)
LIMIT = np.float32(1e3)
SIXTH = np.float32(1.0 / 6.0)
ONE = np.float32(1.0)
# How much the second differences of neighbours may differ where values are smooth
# [1 / turn rate].
RATIO = np.float32(8.0)
SLACK = np.float32(0.05)


@kernel
def between(a, b, c, d, part):
    """Limited cubic between b and c; a, b, c, d in a row, part in [0, 1) from b to c.

    A cubic is the straight line less a share of the second differences p and q at b and c. Beside
    a jump one of them is large and says nothing of the values between: it may exceed RATIO times
    the other by SLACK at most. Clipped in each direction by itself: clipped to the eight corners of
    a cell alone, times come out a tenth too short.
    """
    rest = ONE - part
    line = rest * b + part * c
    p = a - b - b + c
    q = b - c - c + d
    bound = RATIO * min(abs(p), abs(q)) + SLACK
    p = min(max(p, -bound), bound)
    q = min(max(q, -bound), bound)
    cubic = line - part * rest * SIXTH * ((rest + ONE) * p + (part + ONE) * q)
    clipped = min(max(cubic, min(b, c)), max(b, c))
    return clipped if bound < LIMIT else line


@kernel
def blend(a, b, part, out):
    """out = (1 - part) a + part b."""
    rest = np.float32(1.0) - part
    for i in range(len(out)):
        out[i] = rest * a[i] + part * b[i]


@kernel
def blend_four(a, b, c, d, part, out):
    """out = what is `between` b and c, all along four lines.

    Args:
        a, b, c, d: Neighbouring lines of values.
        part: How far from b to c, 0 to 1.
        out: To be filled.
    """
    for i in range(len(out)):
        out[i] = between(a[i], b[i], c[i], d[i], part)


@kernel
def _take_linear(a, part, time, best):
    """Best so far, or the linear interpolation along x plus the time of the step."""
    rest = np.float32(1.0) - part
    for i in range(len(best)):
        value = rest * a[i] + part * a[i + 1] + time
        best[i] = value if value < best[i] else best[i]


@kernel
def _take_cubic(a, part, time, best):
    """Best so far, or the cubic interpolation along x plus the time of the step."""
    for i in range(len(best)):
        value = between(a[i], a[i + 1], a[i + 2], a[i + 3], part) + time
        best[i] = value if value < best[i] else best[i]


@compiled
def sweep_row(table, t, cubic, durations, turns, xc, xp, yc, yp, bc, bp, width, best):
    """The best update of all nodes of one theta row.

    Args:
        table: Shape (n_theta, n_beta, n), with n = n_y * width.
        t: Number of the row.
        cubic: Whether to interpolate with limited cubics, and to forget the old values.
        durations, turns, xc, xp, yc, yp, bc, bp: See `Motions`.
        width: Nodes of a line, with its unreachable columns.
        best: Where the update goes, shape (n_beta, n).
    """
    theta_count, beta_count, n = table.shape
    margin = (np.abs(yc).max() + 3) * width + np.abs(xc).max() + 3
    plane = np.full(n + 2 * margin, FAR, dtype=np.float32)
    inner = plane[margin : margin + n]
    line = np.empty(n + 3, dtype=np.float32)
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
            if cubic:
                p0, p3 = source[(k - 1) % beta_count], source[(k + 2) % beta_count]
                blend_four(p0, p1, p2, p3, bp[c, b], inner)
                blend_four(
                    plane[foot - 1 - width :],
                    plane[foot - 1 :],
                    plane[foot - 1 + width :],
                    plane[foot - 1 + 2 * width :],
                    yp[c, t],
                    line,
                )
                _take_cubic(line, xp[c, t], durations[c], best[b])
            else:
                blend(p1, p2, bp[c, b], inner)
                blend(plane[foot:], plane[foot + width :], yp[c, t], line[: n + 1])
                _take_linear(line, xp[c, t], durations[c], best[b])


@compiled
def settle_row(table, t, best, near, width, x_count, mirrored):
    """Write a row, bounded by the near field, and its mirror image; return the largest change.

    Args:
        table: Values, shape (theta, beta, y x).
        t: Number of the row in theta.
        best: New values of the row, shape (beta, y x).
        near: Bounds near the goal, shape of the table.
        width: Entries from one y to the next, those beyond the grid included.
        x_count: Nodes along x.
        mirrored: Whether the row -theta has the mirror image of the values.
    """
    theta_count, beta_count, n = table.shape
    change = np.float32(0.0)
    for b in range(beta_count):
        old, new, bound = table[t, b], best[b], near[t, b]
        for i in range(x_count, n, width):
            new[i : i + width - x_count] = FAR
        for i in range(n):
            value = new[i] if new[i] < bound[i] else bound[i]
            value = value if value < LIMIT else FAR
            step = abs(value - old[i])
            change = step if step > change else change
            old[i] = value
    other = (theta_count - t) % theta_count
    if mirrored:
        for b in range(beta_count):
            target = table[other, (beta_count - b) % beta_count]
            source = table[t, b]
            if other != t:
                for i in range(0, n, width):
                    target[n - width - i : n - i] = source[i : i + width]
    return change
