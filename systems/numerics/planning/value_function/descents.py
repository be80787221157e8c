"""Paths from the table by looking far ahead: the best of many ways down the time to go.

A choice made step by step follows every error of the table, and can loop. This is a beam search:
many ways are driven at once, one angle between theta nodes at a time, and those are kept for which
time driven plus time to go is least. Steps end on theta nodes, where the table is best.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arc_words.words import control_set
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import hold_beta, shift_of
from .value_function import ValueFunction

# Width of the beam: for each first turn, half as many ways are kept after each step.
WIDTH = 16
# How often each step is checked for the goal box.
LOOKS = 4
# Ways are given up when they have driven for LATE times the quickest arrival, or promise to take
# HOPELESS times as long in all.
LATE = 1.15
HOPELESS = 1.3
# Ways are driven for at most this many times the promise at the start, plus two whole turns.
_PATIENCE = 2.0
# A turn that would be shorter than this, in angles between nodes, goes on to the next theta node.
_TOO_SHORT = 1e-3
# Weights that pack x, y, theta and beta, in half cells, into one number with room for a turn.
_DIGITS = 4 * np.array([1, 1 << 14, 1 << 28, 1 << 42])


@dataclass(frozen=True, eq=False)
class Descent:
    """A way into the goal box.

    Attributes:
        path: Sampled where the controls may change.
        first_turn: 1: left, -1: right, 0: it never turns.
        winding: Whole turns of the heading until it arrives.
    """

    path: TrailerPath
    first_turn: int
    winding: int

    @property
    def time(self) -> float:
        """Of travel [s]."""
        return float(self.path.times[-1])


class _Front(NamedTuple):
    """Ways after one more step; each row stems from one of the front before."""

    states: np.ndarray
    times: np.ndarray
    first_turns: np.ndarray
    parents: np.ndarray
    controls: np.ndarray


class _Arrival(NamedTuple):
    time: float
    front: int
    parent: int
    control: int
    state: np.ndarray
    first_turn: int
    winding: int


def descents(
    value: ValueFunction, start, width: int = WIDTH, aim: Goal | None = None
) -> list[Descent]:
    """Ways into the goal box, the quickest first; empty where the table promises none.

    One for each first turn and each number of whole turns that arrives in time: these are on
    different sides of a barrier, where a slightly wrong table may prefer the wrong side.

    Args:
        value: The table.
        start: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        width: Twice the number of ways that are kept for each first turn.
        aim: A box within that of the table, in the table's frame, to enter; by default all of it.
    """
    start = np.array(start, dtype=float)
    promised = float(value.looked_up(start))
    box = value.goal if aim is None else aim
    if not math.isfinite(promised):
        return []
    limit = _PATIENCE * promised + 2 * math.tau / value.trailer.turn_rate
    pairs = control_set(value.trailer) * [value.trailer.speed, value.trailer.turn_rate]
    none = np.zeros(1, dtype=int)
    front = _Front(start[None], np.zeros(1), none, none, none)
    fronts: list[_Front] = []
    arrivals: list[_Arrival] = []
    first = math.inf
    while len(front.states):
        fronts.append(front)
        durations = _durations(value, front.states, pairs)
        along = _driven(value, front.states, pairs, durations)
        hits = box.contains(value.to_table(along))
        entered = hits.any(axis=0)
        before = front.first_turns[:, None]
        turned = np.where(before, before, np.sign(pairs[:, 1]).astype(int))
        times = front.times[:, None] + durations
        for n, c in np.argwhere(entered).tolist():
            look = int(hits[:, n, c].argmax())
            state = along[look, n, c]
            time = float(front.times[n] + durations[n, c] * (look + 1) / LOOKS)
            winding = round((state[2] - value.placement[2] - value.goal.state[2]) / math.tau)
            turn = int(turned[n, c])
            arrivals.append(_Arrival(time, len(fronts) - 1, n, c, state, turn, winding))
            first = min(first, time)
        ends = along[-1].reshape(-1, 4)
        ahead = times.ravel()
        totals = ahead + value.interpolated(ends)
        going = ~entered.ravel() & (ahead < min(limit, LATE * first)) & np.isfinite(totals)
        if arrivals:
            going &= totals < HOPELESS * first
        kept = _best(value, ends, totals, turned.ravel(), going, width)
        count = len(pairs)
        first_turns = turned.ravel()[kept]
        front = _Front(ends[kept], ahead[kept], first_turns, kept // count, kept % count)
    found: dict[tuple[int, int], Descent] = {}
    # Of equally quick ones, those that never turn come first.
    for arrival in sorted(arrivals, key=lambda each: (round(each.time, 9), abs(each.first_turn))):
        kind = arrival.first_turn, arrival.winding
        if kind not in found:
            found[kind] = Descent(_path(fronts, arrival, pairs), *kind)
    return list(found.values())


def _durations(value: ValueFunction, states: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """How long to hold each control from each state, so that turns end on theta nodes, (n, c)."""
    step = value.grid.theta_step
    cells = value.to_table(states)[:, 2] / step
    part = cells - np.floor(cells)
    to_next = np.where(part > 1 - _TOO_SHORT, 2 - part, 1 - part)
    to_last = np.where(part < _TOO_SHORT, 1 + part, part)
    omega = pairs[:, 1]
    parts = np.where(omega > 0, to_next[:, None], np.where(omega < 0, to_last[:, None], 1.0))
    return parts * step / value.trailer.turn_rate


def _driven(value: ValueFunction, states: np.ndarray, pairs: np.ndarray, durations: np.ndarray):
    """States at every look along each control from each state, shape (LOOKS, n, c, 4)."""
    v, omega = (np.broadcast_to(column, durations.shape) for column in pairs.T)
    betas = np.broadcast_to(states[:, 3:], durations.shape)
    beta = hold_beta(betas, v, omega, durations, LOOKS, value.trailer)[1:]
    times = durations * np.arange(1, LOOKS + 1)[:, None, None] / LOOKS
    x, y, theta = (states[:, k, None] for k in range(3))
    dx, dy = shift_of(theta, v, omega, times)
    return np.stack([x + dx, y + dy, theta + omega * times, beta], axis=-1)


def _best(value: ValueFunction, states, totals, turned, going, width: int) -> np.ndarray:
    """Indices of the ways to keep: the best of each first turn, one at most per half cell."""
    order = np.flatnonzero(going)
    order = order[np.argsort(totals[order], kind="stable")]
    cell = np.array([value.grid.step, value.grid.step, value.grid.theta_step, value.grid.beta_step])
    places = np.round(2 * states[order] / cell).astype(np.int64)
    # One number for each half cell and turn; whole rows take longer to compare.
    keys = places @ _DIGITS + turned[order]
    _, firsts = np.unique(keys, return_index=True)
    order = order[np.sort(firsts)]
    return np.concatenate([order[turned[order] == turn][: width // 2] for turn in (-1, 0, 1)])


def _path(fronts: list[_Front], arrival: _Arrival, pairs: np.ndarray) -> TrailerPath:
    """The path to an arrival, traced back to the start."""
    times, states, controls = [arrival.time], [arrival.state], [pairs[arrival.control]]
    at = arrival.parent
    for k in range(arrival.front, -1, -1):
        front = fronts[k]
        times.append(float(front.times[at]))
        states.append(front.states[at])
        if k > 0:
            controls.append(pairs[front.controls[at]])
        at = int(front.parents[at])
    return TrailerPath(np.array(times[::-1]), np.array(states[::-1]), np.array(controls[::-1]))
