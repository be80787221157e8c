"""Paths among walls by best-first search with a table; it backtracks where a way is shut.

Steps are long ones, as in the sweeps. Each is checked with the cart's discs, so that no path leads
through a wall, whatever the table promises.

Source: A*, Hart, Nilsson and Raphael (1968), with the table for what is still to go.
"""

import heapq
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from ..arc_words.words import control_set
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer, hold_beta, shift_of
from .obstacles import Walls, overlaps
from .value_function import ValueFunction, look_up_in_reach

# Checks for walls and for the goal in one step.
LOOKS = 8
# Length of a step, in angles between theta nodes.
STEP = 0.5
# Weight of the time to go against the time driven: errors of the table by this share do not make
# the search turn back.
EAGERNESS = 1.1
# States from which steps are driven at once, and most steps in all.
BATCH = 24
MOST_STEPS = 60_000
# Two states in one box of this size count as the same, in cells of the grid.
ALIKE = 0.5


class _Node(NamedTuple):
    """A state that was reached, and how."""

    state: np.ndarray
    time: float
    parent: int
    control: int


@dataclass(frozen=True, eq=False)
class Search:
    """What a search found.

    Attributes:
        path: Into the goal box; None: there was none within the limit.
        steps: How many steps were driven.
    """

    path: TrailerPath | None
    steps: int


def search_path(value: ValueFunction, walls: Walls, start, goal: Goal) -> Search:
    """Drive towards a goal box, the most promising step first.

    Args:
        value: Time to go among the walls, in the world's own frame.
        walls: What is in the way, on a raster fine enough to trust.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: The box, that of the table or within it.
    """
    trailer = value.trailer
    controls = control_set(trailer) * [trailer.speed, trailer.turn_rate]
    duration = STEP * value.grid.theta_step / trailer.turn_rate
    nodes = [_Node(np.array(start, dtype=float), 0.0, -1, -1)]
    queue, seen, steps = [(0.0, 0)], set(), 0
    while queue and steps < MOST_STEPS:
        batch = []
        while queue and len(batch) < BATCH:
            _, k = heapq.heappop(queue)
            cell = _cell(value, nodes[k].state)
            if cell not in seen:
                seen.add(cell)
                batch.append(k)
        if not batch:
            break
        states = np.array([nodes[k].state for k in batch])
        # Shape (looks + 1, controls, batch, 4).
        ways = _driven(trailer, states, controls, duration)
        steps += ways.shape[1] * ways.shape[2]
        first_wall = _first(~_clear(walls, ways) | _folded(trailer, ways))
        first_goal = _first(goal.contains(ways))
        arrived = (first_goal < first_wall) & (first_goal <= LOOKS)
        if arrived.any():
            times = np.array([nodes[k].time for k in batch]) + duration / LOOKS * first_goal
            c, n = divmod(int(np.argmin(np.where(arrived, times, np.inf))), len(batch))
            last = ways[: first_goal[c, n] + 1, c, n]
            path = _path(nodes, batch[n], c, last, trailer, controls, duration)
            return Search(path, steps)
        to_go = look_up_in_reach(value, ways[-1])
        for c, n in np.argwhere((first_wall > LOOKS) & np.isfinite(to_go)).tolist():
            time = nodes[batch[n]].time + duration
            nodes.append(_Node(ways[-1, c, n], time, batch[n], c))
            heapq.heappush(queue, (time + EAGERNESS * float(to_go[c, n]), len(nodes) - 1))
    return Search(None, steps)


def _driven(trailer: Trailer, states, controls, duration: float) -> np.ndarray:
    """States all along every control from every state, shape (LOOKS + 1, controls, n, 4)."""
    shape = (len(controls), len(states))
    v = np.broadcast_to(controls[:, :1], shape)
    omega = np.broadcast_to(controls[:, 1:], shape)
    x, y, theta, beta = (np.broadcast_to(column, shape) for column in states.T)
    times = duration / LOOKS * np.arange(LOOKS + 1)[:, None, None]
    dx, dy = shift_of(theta, v, omega, times)
    betas = hold_beta(beta, v, omega, duration, LOOKS, trailer)
    return np.stack([x + dx, y + dy, theta + omega * times, betas], axis=-1)


def _clear(walls: Walls, ways: np.ndarray) -> np.ndarray:
    free = np.empty(ways.size // 4, dtype=bool)
    _look(walls, np.ascontiguousarray(ways.reshape(-1, 4)), free)
    return free.reshape(ways.shape[:-1])


@compiled
def _look(walls, states, free):
    for s in range(len(states)):
        free[s] = not overlaps(walls, states[s, 0], states[s, 1], states[s, 2], states[s, 3])


def _folded(trailer: Trailer, ways: np.ndarray) -> np.ndarray:
    """Where the trailer is beyond its jackknife limit."""
    if trailer.jackknife >= math.pi:
        return np.zeros(ways.shape[:-1], dtype=bool)
    return np.abs(_wrapped(ways[..., 3])) > trailer.jackknife


def _wrapped(angles: np.ndarray) -> np.ndarray:
    return np.remainder(angles + math.pi, math.tau) - math.pi


def _first(marks: np.ndarray) -> np.ndarray:
    """Index of the first mark along the first axis; the length of the axis if there is none."""
    return np.where(marks.any(axis=0), marks.argmax(axis=0), len(marks))


def _cell(value: ValueFunction, state: np.ndarray) -> tuple[int, ...]:
    sizes = ALIKE * np.array(value.grid.cell)
    place = np.append(state[:2], _wrapped(state[2:]))
    return tuple(np.floor(place / sizes).astype(int).tolist())


def _path(nodes, k: int, c: int, last: np.ndarray, trailer, controls, duration) -> TrailerPath:
    """The path to a node and on along the last step, sampled at every look."""
    chain, held = [last], [np.tile(controls[c], (len(last) - 1, 1))]
    while nodes[k].parent >= 0:
        before = nodes[nodes[k].parent].state
        control = controls[nodes[k].control]
        chain.append(_driven(trailer, before[None], control[None], duration)[:-1, 0, 0])
        held.append(np.tile(control, (LOOKS, 1)))
        k = nodes[k].parent
    states, inputs = np.concatenate(chain[::-1]), np.concatenate(held[::-1])
    return TrailerPath(duration / LOOKS * np.arange(len(states)), states, inputs)
