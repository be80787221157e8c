"""The belief about the evader's position, and what an agent's next picture would show, on cells.

Both serve to choose whom to ask: `expected_information` compares them over the same cells.

Source: ours (Zhang 2014, 4.4, asks for a choice by expected information).
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from ...errors import require_positive
from ...geometry.edge_index import EdgeIndex, build_edge_index
from ...geometry.segment_sight import are_clear
from ...geometry.world import World

# Headings over which the view of a camera at an unknown pose is averaged.
_HEADINGS = 8
# Approximate number of places over which it is averaged.
_PLACES = 60


@dataclass(frozen=True, eq=False)
class Outlook:
    """Cells of the free region, and the field of view of the agents' cameras.

    Attributes:
        cells: Middles of the cells, shape (n, 2) [m].
        index: Edges of the walls.
        view_angle: Angle of view of a camera [rad].
        reach: Greatest distance at which the evader is recognised [m].
    """

    cells: np.ndarray
    index: EdgeIndex
    view_angle: float
    reach: float

    @cached_property
    def typical(self) -> np.ndarray:
        """Probability that a camera at a random pose shows each cell, shape (n,)."""
        places = self.cells[:: max(len(self.cells) // _PLACES, 1)]
        headings = 2 * math.pi * np.arange(_HEADINGS) / _HEADINGS
        poses = [(*place, heading) for place in places for heading in headings]
        return np.mean([view(self, np.array(pose)) for pose in poses], axis=0)


def make_outlook(world: World, *, cell: float, view_angle: float, reach: float) -> Outlook:
    """Divide a world into square cells.

    Args:
        world: World whose walls block sight.
        cell: Side of a cell [m].
        view_angle: Angle of view of the agents' cameras [rad].
        reach: Greatest distance at which the evader is recognised [m].

    Raises:
        InvalidInput: A number is not positive.
    """
    for name, value in (("cell", cell), ("view_angle", view_angle), ("reach", reach)):
        require_positive(name, value)
    x_low, y_low, x_high, y_high = world.bounds
    x, y = np.arange(x_low + cell / 2, x_high, cell), np.arange(y_low + cell / 2, y_high, cell)
    middles = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    free = shapely.contains_xy(world.polygon, middles[:, 0], middles[:, 1])
    return Outlook(middles[free], build_edge_index(world), view_angle, reach)


def view(outlook: Outlook, pose: np.ndarray) -> np.ndarray:
    """Which cells a camera at a pose (3,) [m], [m], [rad] shows: 0 or 1, shape (n,)."""
    offsets = outlook.cells - pose[:2]
    distances = np.hypot(*offsets.T)
    turned = np.arctan2(offsets[:, 1], offsets[:, 0]) - pose[2]
    beside = np.abs(np.remainder(turned + math.pi, 2 * math.pi) - math.pi)
    shown = (beside <= 0.5 * outlook.view_angle) & (distances <= outlook.reach)
    near = np.flatnonzero(shown)
    starts = np.tile(pose[:2], (len(near), 1))
    shown[near] = are_clear(outlook.index, starts, outlook.cells[near])
    return shown.astype(float)


def expected_view(outlook: Outlook, pose: np.ndarray, age: float, forgetting: float) -> np.ndarray:
    """Probability that a camera last known at a pose shows each cell now, shape (n,).

    It is still there with probability exp(-age / forgetting), else anywhere.
    """
    weight = math.exp(-age / forgetting) if math.isfinite(age) else 0.0
    known = view(outlook, pose) if weight > 1e-3 else outlook.typical
    return weight * known + (1 - weight) * outlook.typical


def belief(outlook: Outlook, mean: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Belief from an estimate of the evader: a Gaussian on the cells, shape (n,), summing to one.

    An infinite covariance means no estimate: then all cells are equally likely.

    Args:
        outlook: Its cells.
        mean: Mean of the position, shape (2,) [m].
        covariance: Shape (2, 2) [m^2].
    """
    count = len(outlook.cells)
    if not np.isfinite(covariance).all():
        return np.full(count, 1 / count)
    offsets = outlook.cells - mean
    # Never narrower than a cell, or all weights could vanish.
    spacing = 0.25 * np.eye(2) * _area(outlook)
    exponents = 0.5 * np.einsum(
        "ij,ij->i", offsets, np.linalg.solve(covariance + spacing, offsets.T).T
    )
    weights = np.exp(exponents.min() - exponents)
    return weights / weights.sum()


def _area(outlook: Outlook) -> float:
    """Area of a cell [m^2]."""
    steps = np.diff(np.unique(np.round(outlook.cells[:, 0], 9)))
    return float(steps.min()) ** 2 if len(steps) else 1e-4
