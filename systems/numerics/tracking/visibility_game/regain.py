"""How a pursuer that does not see an evader gets to where it can keep it for ever.

The position of the evader is known from a teammate that sees it. While the pursuer takes k steps to
a place, the evader has k moves. So the pursuer arrives with a guarantee if, from that place, every
node that the evader can reach meanwhile is kept for ever. The nearest such place is found by
breadth-first search over the pursuer's nodes.

Source: ours.
"""

import math

import numpy as np

from ...compiled import compiled, kernel
from .board import Board, distance_to_losing, nearest_evader_node, nearest_place
from .planes import worst_reply

# Length of an evader's longest move [cells].
LONGEST = math.sqrt(5.0)


@compiled
def steps_to_guard(
    board: Board, pursuers: np.ndarray, evaders: np.ndarray, pairs: np.ndarray
) -> np.ndarray:
    """How soon each pursuer could guard each evader.

    Args:
        board: The solved game.
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        pairs: Which pairs are asked for, shape (n, m), bool.

    Returns:
        Shape (n, m) [steps]; infinite if there is no way, or if the pair was not asked for. If no
        place gives a guarantee, they are the steps to the place that leaves the longest time.
    """
    n, m = pairs.shape
    steps = np.full((n, m), np.inf)
    reached, queue = np.empty(len(board.places)), np.empty(len(board.places), dtype=np.int64)
    for i in range(n):
        for j in range(m):
            if pairs[i, j]:
                here = nearest_place(board, pursuers[2 * i], pursuers[2 * i + 1])
                row, column = nearest_evader_node(board, evaders[2 * j], evaders[2 * j + 1])
                if here >= 0 and row >= 0:
                    q = _search(board, here, row, column, reached, queue)
                    steps[i, j] = reached[q] if q >= 0 else np.inf
    return steps


@compiled
def way_to_guard(board: Board, px: float, py: float, ex: float, ey: float) -> int:
    """The node to go to now, on the way to where the evader can be guarded.

    Args:
        board: The solved game.
        px, py, ex, ey: Positions of the two [m].

    Returns:
        A neighbour of the pursuer's nearest node; -1 if there is no way, or it is there already.
    """
    here = nearest_place(board, px, py)
    row, column = nearest_evader_node(board, ex, ey)
    if here < 0 or row < 0:
        return -1
    reached, queue = np.empty(len(board.places)), np.empty(len(board.places), dtype=np.int64)
    q = _search(board, here, row, column, reached, queue)
    if q < 0 or q == here:
        return -1
    # Follow the way back, each time to the predecessor nearest to the pursuer.
    while reached[q] > 1:
        nearest, chosen = np.inf, q
        for k in range(board.rules.neighbour_starts[q], board.rules.neighbour_starts[q + 1]):
            before = board.rules.neighbours[k]
            if reached[before] == reached[q] - 1:
                distance = math.hypot(board.places[before, 0] - px, board.places[before, 1] - py)
                if distance < nearest:
                    nearest, chosen = distance, before
        q = chosen
    return q


@kernel
def _search(board, here, row, column, reached, queue):
    """Nearest place with a guarantee, else the one that leaves most, or -1; fills `reached`."""
    reached[:] = np.inf
    reached[here], queue[0] = 0.0, here
    first, last = 0, 1
    best, fallback = 0.0, -1
    while first < last:
        q = queue[first]
        first += 1
        steps = worst_reply(board.planes, q, row, column)
        if steps > 0:
            if distance_to_losing(board, q, row, column) > LONGEST * reached[q]:
                return q
            left = steps - reached[q]
            if left > best:
                best, fallback = left, q
        for k in range(board.rules.neighbour_starts[q], board.rules.neighbour_starts[q + 1]):
            after = board.rules.neighbours[k]
            if reached[after] == np.inf:
                reached[after] = reached[q] + 1.0
                queue[last] = after
                last += 1
    return fallback
