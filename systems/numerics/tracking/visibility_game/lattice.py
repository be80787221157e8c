"""Grids of nodes, and the moves on them.

The middle of the world is half a cell from the nearest nodes, so that a mirrored world, or one
rotated by a right angle, has the mirrored or rotated grid.

A player can be followed on nodes, each of which is only near it. Let the player be within `slack`
of its node, and move no farther than `pace` in a step. If discs of radius `slack` round all moves
cover the disc of radius `pace + slack`, one of the moves leads to a node within `slack` of the
player again. So bounds of a game on nodes become bounds of the game in the plane.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ...compiled import compiled
from ...errors import InvalidInput
from ...geometry.edge_index import EdgeIndex, point_is_free
from ...geometry.segment_sight import segment_is_clear

# Kinds of moves: to no free node; blocked by a wall; clear.
NOWHERE, BLOCKED, CLEAR = range(3)

# Largest distance of a followed player from its node [cells].
SLACK = 1.0


class Lattice(NamedTuple):
    """A rectangle of nodes.

    Attributes:
        x, y: The node of column 0 and row 0 [m].
        spacing: Between neighbours [m].
        rows, columns: Number of nodes.
    """

    x: float
    y: float
    spacing: float
    rows: int
    columns: int

    def at(self, row: ArrayLike, column: ArrayLike) -> np.ndarray:
        """Places of nodes, shape (..., 2) [m].

        Args:
            row, column: Indices of shape (...), or shapes that broadcast to it.
        """
        rows, columns = np.broadcast_arrays(row, column)
        return np.stack([self.x + columns * self.spacing, self.y + rows * self.spacing], axis=-1)

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows and columns of the nodes nearest to points, shape (n,) each.

        Args:
            points: Shape (n, 2) [m].
        """
        columns, rows = np.rint((points - self.at(0, 0)) / self.spacing).astype(int).T
        return rows, columns

    @property
    def points(self) -> np.ndarray:
        """Places of all nodes, shape (rows, columns, 2) [m]."""
        return self.at(*np.mgrid[: self.rows, : self.columns])


class Moves(NamedTuple):
    """A player's moves in one step: all offsets within a disc.

    Attributes:
        halves: Half-width of the row of offsets at each row offset from -reach to reach, shape
            (2 reach + 1,) [cells].
    """

    halves: np.ndarray

    @property
    def reach(self) -> int:
        """Largest row offset [cells]."""
        return len(self.halves) // 2

    @property
    def offsets(self) -> np.ndarray:
        """Row and column offsets, nearest first, shape (n, 2) [cells]."""
        reach = self.reach
        listed = [
            (row, column)
            for row in range(-reach, reach + 1)
            for column in range(-self.halves[row + reach], self.halves[row + reach] + 1)
        ]
        return np.array(sorted(listed, key=lambda offset: (math.hypot(*offset), offset)))

    @property
    def longest(self) -> float:
        """Length of the longest offset [cells]."""
        return float(np.hypot(*self.offsets.T).max())

    @property
    def pace(self) -> float:
        """How far a player that is followed with these moves may go in a step [cells].

        It is the largest r such that discs of radius SLACK round the offsets cover that of
        r + SLACK.
        """
        offsets = self.offsets
        angles = np.linspace(0.0, 2.0 * np.pi, 14401)
        directions = np.column_stack([np.sin(angles), np.cos(angles)])
        along = offsets @ directions.T
        across = offsets[:, :1] * directions[:, 1] - offsets[:, 1:] * directions[:, 0]
        inside = SLACK * SLACK - across * across
        ends = np.where(inside < 0.0, -np.inf, along + np.sqrt(np.maximum(inside, 0.0)))
        # The union's rim is the farthest arc in each direction, and hardly nearer between two.
        return float(ends.max(axis=0).min() - SLACK - 1e-3)


@lru_cache
def moves_within(square: int) -> Moves:
    """All offsets whose squared length is at most `square`.

    Args:
        square: At least 1 [cells^2]; 5 gives an octagon of 21 moves.
    """
    reach = math.isqrt(square)
    halves = np.array([math.isqrt(square - row * row) for row in range(-reach, reach + 1)])
    return Moves(halves)


def cover(bounds: np.ndarray, spacing: float, margin: float = 0.0) -> Lattice:
    """A grid centred on a rectangle, whose cells cover it.

    Args:
        bounds: x_min, y_min, x_max, y_max, shape (4,) [m].
        spacing: Side of a cell [m].
        margin: Additional width to cover on each side [m].
    """
    low, high = bounds[:2] - margin, bounds[2:] + margin
    half = np.ceil((high - low) / (2.0 * spacing) - 1e-9).astype(int)
    x, y = 0.5 * (low + high) - (half - 0.5) * spacing
    return Lattice(float(x), float(y), spacing, 2 * int(half[1]), 2 * int(half[0]))


def free_nodes(lattice: Lattice, region: EdgeIndex) -> np.ndarray:
    """Which nodes lie in a region, shape (rows, columns), bool.

    Args:
        lattice: The nodes.
        region: Its edges.
    """
    return _are_free(region, tuple(lattice))


@compiled
def are_free(region: EdgeIndex, points: np.ndarray) -> np.ndarray:
    """Which points lie in a region, shape (n,), bool.

    Args:
        region: Its edges.
        points: Shape (n, 2) [m].
    """
    free = np.empty(len(points), dtype=np.bool_)
    for k in range(len(points)):
        free[k] = point_is_free(region, points[k, 0], points[k, 1])
    return free


@compiled
def _are_free(region: EdgeIndex, frame: tuple) -> np.ndarray:
    x, y, spacing, rows, columns = frame
    free = np.empty((rows, columns), dtype=np.bool_)
    for j in range(rows):
        for i in range(columns):
            free[j, i] = point_is_free(region, x + i * spacing, y + j * spacing)
    return free


@compiled
def _look_at_moves(
    frame: tuple, free: np.ndarray, nodes: np.ndarray, region: EdgeIndex, offsets: np.ndarray
) -> np.ndarray:
    x, y, spacing, rows, columns = frame
    clear = np.zeros((len(nodes), len(offsets)), dtype=np.uint8)
    for n in range(len(nodes)):
        for k in range(len(offsets)):
            row, column = nodes[n, 0] + offsets[k, 0], nodes[n, 1] + offsets[k, 1]
            if 0 <= row < rows and 0 <= column < columns and free[row, column]:
                ax, ay = x + nodes[n, 1] * spacing, y + nodes[n, 0] * spacing
                bx, by = x + column * spacing, y + row * spacing
                clear[n, k] = CLEAR if segment_is_clear(region, ax, ay, bx, by) else BLOCKED
    return clear


def clear_moves(
    lattice: Lattice, free: np.ndarray, nodes: np.ndarray, region: EdgeIndex, offsets: np.ndarray
) -> np.ndarray:
    """Classify moves: those to free nodes, and among these the ones that no wall blocks.

    Args:
        lattice: The nodes.
        free: Which are free, shape (rows, columns), bool.
        nodes: Row and column of those that move, shape (n, 2).
        region: Edges of where the player may be.
        offsets: Shape (k, 2) [cells].

    Returns:
        Shape (n, k): NOWHERE if there is no free node, BLOCKED or CLEAR.
    """
    return _look_at_moves(tuple(lattice), free, nodes, region, offsets)


def finite_point(name: str, value: object) -> np.ndarray:
    """Convert a point to an array, shape (2,) [m].

    Args:
        name: Name of the parameter in error messages.
        value: Of any type.

    Raises:
        InvalidInput: The value is not a finite [x, y].
    """
    point = np.asarray(value, dtype=float)
    if point.shape != (2,) or not np.isfinite(point).all():
        raise InvalidInput(f"`{name}` must be a finite point [x, y]; got {value}")
    return point
