"""Sweeps over the grid: every node takes the best of its long steps, among walls of those in reach.

Inside the solver lengths are in turning radii and times in 1 / turn rate, so that the tractor has
speed one and turn rate one. A step lasts a multiple of the angle between theta nodes, so that it
ends on a theta node exactly, and its shift in x and y is the same over the whole plane.

For one pair of angles and one control the foot points of all (x, y) nodes are shifted alike, so
an update is a stencil over a plane: first the planes of neighbouring beta nodes are combined,
then rows, then columns. A plane is one long line, its rows parted by unreachable columns, so that
a shift beyond an edge finds what it should. Inside, times are in 1 / turn rate and unreachable is
FAR, because infinity times zero is not a number.

In the open a value interpolated from an unreachable node is unreachable itself. Beside walls, and
on the narrow way into a goal close behind one, that would shut passages of several cells. There,
whether a step is free is known exactly, so a cell takes the mean of its reachable nodes if they
have at least half of its weight: this puts the edge of what is reachable midway between nodes.
"""

import math
from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable

from ...compiled import compiled, kernel
from ..arc_words.words import control_set
from ..trailer import Trailer, hold_beta, shift_of
from .grid import THESIS_ANGLES, StateGrid

# Durations of long steps, in angles between theta nodes of the thesis's grid. Finer grids have them
# too: each step adds an error of interpolation.
LONGER = (2.0, 3.0, 6.0)
# Shorter ones, with linear interpolation, whose error is the larger one. With cubics the shortest
# step is one angle of any grid, since controls change more often than the thesis's angles allow.
SHORTER = (1.0, 1.5)
# A foot point this near to a node, in cells, is on it.
SNAP = 1e-4


class Motions(NamedTuple):
    """C controls, held for a while, from every node.

    Attributes:
        controls: v, omega in {-1, 0, 1}, shape (C, 2).
        multiples: Duration of each, in angles between theta nodes, shape (C,).
        durations: The same in 1 / turn rate, shape (C,).
        turns: By how many theta nodes each turns, shape (C,).
        x_cells, y_cells: Whole cells of the shift, by control and theta, shape (C, n_theta).
        x_parts, y_parts: What is left of it, in [0, 1), shape (C, n_theta).
        beta_cells: Beta node below the foot point, by control and beta, shape (C, n_beta);
            -1: the control is not allowed there (jackknife).
        beta_parts: Where between it and the next, in [0, 1), shape (C, n_beta).
    """

    controls: np.ndarray
    multiples: np.ndarray
    durations: np.ndarray
    turns: np.ndarray
    x_cells: np.ndarray
    x_parts: np.ndarray
    y_cells: np.ndarray
    y_parts: np.ndarray
    beta_cells: np.ndarray
    beta_parts: np.ndarray


def step_multiples(grid: StateGrid, *, cubic: bool) -> tuple[int, ...]:
    """Durations of steps, in angles between theta nodes.

    Args:
        grid: For its angles.
        cubic: Whether passes end with cubic interpolation.
    """
    finer = _fineness(grid.theta_count)
    shorter = (1.0 / finer,) if cubic else SHORTER
    return tuple(sorted({round(duration * finer) for duration in (*shorter, *LONGER)}))


@register_jitable
def _fineness(theta_count):
    """How many times finer angles are than the thesis's, at least 1."""
    return max(1.0, theta_count / THESIS_ANGLES)


def make_motions(
    grid: StateGrid, trailer: Trailer, scale: float, multiples: tuple[int, ...]
) -> Motions:
    """Tabulate steps of a normalised trailer.

    Args:
        grid: Where they start.
        trailer: Normalised.
        scale: A turning radius [m].
        multiples: Durations of each control, in angles between theta nodes.
    """
    pairs = [(v, omega, k) for v, omega in control_set(trailer) for k in multiples]
    v, omega, angles = (np.array(column) for column in zip(*pairs, strict=True))
    durations = angles * grid.theta_step
    _, _, thetas, betas = grid.axes()
    dx, dy = shift_of(thetas, v[:, None], omega[:, None], durations[:, None])
    x_cells, x_parts = _split(dx * scale / grid.step)
    y_cells, y_parts = _split(dy * scale / grid.step)
    starts = np.remainder(betas + math.pi, math.tau) - math.pi
    ends = np.array(
        [
            hold_beta(starts, vi, wi, ki * grid.theta_step, 8 * ki, trailer)[-1]
            for vi, wi, ki in pairs
        ]
    )
    beta_cells, beta_parts = _split(ends / grid.beta_step)
    beta_cells %= grid.beta_count
    # Nodes just beyond the limit are kept, for interpolation; they may only fold back.
    limit = np.maximum(trailer.jackknife, np.abs(starts))
    beyond = np.abs(starts) > trailer.jackknife + 2 * grid.beta_step
    if trailer.jackknife < math.pi:
        beta_cells[(np.abs(ends) > limit) | beyond] = -1
    return Motions(
        np.column_stack([v, omega]),
        angles,
        durations.astype(np.float32),
        angles * omega,
        x_cells,
        x_parts,
        y_cells,
        y_parts,
        beta_cells,
        beta_parts,
    )


def _split(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole cells and what is left, in [0, 1)."""
    near = np.round(cells)
    cells = np.where(np.abs(cells - near) < SNAP, near, cells)
    whole = np.floor(cells)
    return whole.astype(np.int64), (cells - whole).astype(np.float32)


# Stands for infinity; a value interpolated from it exceeds LIMIT.
FAR = np.float32(1e12)
LIMIT = np.float32(1e3)
SIXTH = np.float32(1.0 / 6.0)
ONE = np.float32(1.0)
# How much the second differences of neighbours may differ where values are smooth: by a factor, and
# by a part on the thesis's grid [1 / turn rate].
RATIO = np.float32(8.0)
SLACK = 0.05


@kernel
def slack_for(theta_count):
    """By what second differences may differ: those of smooth values do by a cell squared.

    Args:
        theta_count: Nodes of the grid in theta.
    """
    return np.float32(SLACK / _fineness(theta_count) ** 2)


@kernel
def between(a, b, c, d, part, slack):
    """Limited cubic between b and c; a, b, c, d in a row, part in [0, 1) from b to c.

    A cubic is the straight line less a share of the second differences p and q at b and c. Beside
    a jump one of them is large and says nothing of the values between: it may exceed RATIO times
    the other by `slack` at most. Clipped in each direction by itself: clipped to the eight corners
    of a cell alone, times come out a tenth too short.
    """
    rest = ONE - part
    line = rest * b + part * c
    p = a - b - b + c
    q = b - c - c + d
    bound = RATIO * min(abs(p), abs(q)) + slack
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
def blend_four(a, b, c, d, part, slack, out):
    """out = what is `between` b and c, all along four lines.

    Args:
        a, b, c, d: Neighbouring lines of values.
        part: How far from b to c, 0 to 1.
        slack: See `slack_for`.
        out: To be filled.
    """
    for i in range(len(out)):
        out[i] = between(a[i], b[i], c[i], d[i], part, slack)


@kernel
def _take_linear(a, part, time, best):
    """Best so far, or the linear interpolation along x plus the time of the step."""
    rest = np.float32(1.0) - part
    for i in range(len(best)):
        value = rest * a[i] + part * a[i + 1] + time
        best[i] = value if value < best[i] else best[i]


@kernel
def _take_cubic(a, part, slack, time, best):
    """Best so far, or the cubic interpolation along x plus the time of the step."""
    for i in range(len(best)):
        value = between(a[i], a[i + 1], a[i + 2], a[i + 3], part, slack) + time
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
    slack = slack_for(theta_count)
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
                blend_four(p0, p1, p2, p3, bp[c, b], slack, inner)
                blend_four(
                    plane[foot - 1 - width :],
                    plane[foot - 1 :],
                    plane[foot - 1 + width :],
                    plane[foot - 1 + 2 * width :],
                    yp[c, t],
                    slack,
                    line,
                )
                _take_cubic(line, xp[c, t], slack, durations[c], best[b])
            else:
                blend(p1, p2, bp[c, b], inner)
                blend(plane[foot:], plane[foot + width :], yp[c, t], line[: n + 1])
                _take_linear(line, xp[c, t], durations[c], best[b])


@compiled
def settle_row(table, t, best, near, held, width, mirrored):
    """Write a row, bounded by the near field, and its mirror image; return the largest change.

    Args:
        table: Values, shape (theta, beta, y width).
        t: Number of the row in theta.
        best: New values of the row, shape (beta, y width).
        near: Bounds near the goal, shape (theta, beta, y, x).
        held: Up to which value such a bound is the time itself.
        width: Entries from one y to the next, those beyond the grid included.
        mirrored: Whether the row -theta has the mirror image of the values.
    """
    theta_count, beta_count, n = table.shape
    changes = np.zeros(near.shape[3], dtype=np.float32)
    for b in range(beta_count):
        for j in range(near.shape[2]):
            line = table[t, b, j * width :]
            _settle(line, best[b, j * width :], near[t, b, j], held, changes)
    other = (theta_count - t) % theta_count
    if mirrored and other != t:
        for b in range(beta_count):
            target = table[other, (beta_count - b) % beta_count]
            source = table[t, b]
            for i in range(0, n, width):
                target[n - width - i : n - i] = source[i : i + width]
    return changes.max()


@kernel
def _settle(line, new, bounds, held, changes):
    """Write one line; note the largest change of each column."""
    for i in range(len(bounds)):
        value = min(new[i], bounds[i]) if bounds[i] > held else bounds[i]
        value = value if value < LIMIT else FAR
        changes[i] = max(changes[i], abs(value - line[i]))
        line[i] = value


# Least weight of the reachable nodes of a cell with which they stand for all of it.
MAJORITY = np.float32(0.5)
ZERO = np.float32(0.0)


@kernel
def _blend_known(a, b, part, values, known):
    """Values of the reachable nodes times their weights, and these weights."""
    rest = ONE - part
    for i in range(len(values)):
        one, two = a[i] < LIMIT, b[i] < LIMIT
        values[i] = (rest * a[i] if one else ZERO) + (part * b[i] if two else ZERO)
        known[i] = (rest if one else ZERO) + (part if two else ZERO)


@kernel
def _take_linear_known(values, known, part, time, shut, bit, best):
    """Best so far, or the mean of the reachable nodes plus the time of a step that is not shut."""
    rest = ONE - part
    for i in range(len(best)):
        weight = rest * known[i] + part * known[i + 1]
        value = (rest * values[i] + part * values[i + 1]) / max(weight, MAJORITY) + time
        value = value if weight >= MAJORITY and not shut[i] & bit else FAR
        best[i] = value if value < best[i] else best[i]


@kernel
def _take_cubic_known(line, values, known, part, slack, time, shut, bit, best):
    """The same, with the cubic instead of the mean where all of its nodes are reachable."""
    rest = ONE - part
    for i in range(len(best)):
        weight = rest * known[i] + part * known[i + 1]
        mean = (rest * values[i] + part * values[i + 1]) / max(weight, MAJORITY)
        mean = mean if weight >= MAJORITY else FAR
        cubic = between(line[i], line[i + 1], line[i + 2], line[i + 3], part, slack)
        value = (cubic if cubic < LIMIT else mean) + time
        value = FAR if shut[i] & bit else value
        best[i] = value if value < best[i] else best[i]


@compiled
def sweep_walled_row(table, t, cubic, shut, durations, turns, xc, xp, yc, yp, bc, bp, width, best):
    """The best update of all nodes of one theta row, among walls.

    Args:
        table, t, cubic, durations, turns, xc, xp, yc, yp, bc, bp, width, best: See `sweep_row`.
        shut: Whether each control's way is shut, by bit, shape of the table.
    """
    theta_count, beta_count, n = table.shape
    slack = slack_for(theta_count)
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
                _take_linear_known(
                    value_line, known_line, xp[c, t], durations[c], shut[t, b], bit, best[b]
                )
                continue
            p0, p3 = source[(k - 1) % beta_count], source[(k + 2) % beta_count]
            blend_four(p0, p1, p2, p3, bp[c, b], slack, plane[margin:end])
            blend_four(
                plane[foot - 1 - width :],
                plane[foot - 1 :],
                plane[foot - 1 + width :],
                plane[foot - 1 + 2 * width :],
                yp[c, t],
                slack,
                line,
            )
            _take_cubic_known(
                line,
                value_line,
                known_line,
                xp[c, t],
                slack,
                durations[c],
                shut[t, b],
                bit,
                best[b],
            )
