"""Slices of a value function: the time to go over the plane, for one theta and beta.

A slice belongs to a moment of a plan, and has the cart's theta and beta at that moment: on it the
time to go where the cart is equals what is left of the plan, up to the table's error.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from shapely.geometry.base import BaseGeometry

from ....systems.numerics.planning.value_function.value_function import ValueFunction
from ..verdict import PlanningVerdict, Row

# Bands of equal colour in a slice, at most.
_BANDS = 20


@dataclass(frozen=True, eq=False)
class ValueSlice:
    """Time to go over (x, y).

    Attributes:
        moment: Of the plan [s].
        state: The cart's at that moment (x, y, theta, beta) [m], [m], [rad], [rad].
        x: Of the nodes, shape (n,) [m].
        y: Of the nodes, shape (m,) [m].
        times: To go, shape (m, n); infinite: unreachable on this grid [s].
    """

    moment: float
    state: tuple[float, float, float, float]
    x: np.ndarray
    y: np.ndarray
    times: np.ndarray


def followed_row(verdict: PlanningVerdict) -> Row | None:
    """Whose way the slices follow: the value function's own, else the fastest; None without any."""
    rows = [row for row in verdict.rows if row.plan.path is not None]
    own = [row for row in rows if "value_function" in row.plan.notes]
    return min(own or rows, key=lambda row: row.plan.time, default=None)


def slices_along(
    value: ValueFunction, row: Row | None, start, bounds: np.ndarray, count: int
) -> list[ValueSlice]:
    """Slices at equally spaced moments of a plan; without a plan, one at the start.

    Args:
        value: The table.
        row: Whose plan; see `followed_row`.
        start: x, y, theta, beta of the question [m], [m], [rad], [rad].
        bounds: x_min, y_min, x_max, y_max of the slices, shape (4,) [m].
        count: How many, at least two.
    """
    moments, states = np.zeros(1), np.array([start], dtype=float)
    if row is not None and row.plan.path is not None:
        path = row.plan.path
        moments = np.linspace(path.times[0], path.times[-1], count)
        states = np.array([np.interp(moments, path.times, column) for column in path.states.T]).T
    x, y = (
        np.linspace(low, high, max(2, round((high - low) / value.grid.step) + 1))
        for low, high in (bounds[::2], bounds[1::2])
    )
    slices = []
    for moment, (at_x, at_y, theta, beta) in zip(moments.tolist(), states.tolist(), strict=True):
        nodes = np.empty((len(y), len(x), 4))
        nodes[..., 0], nodes[..., 1] = np.meshgrid(x, y)
        nodes[..., 2:] = theta, beta
        state = (at_x, at_y, theta, beta)
        slices.append(ValueSlice(moment, state, x, y, value.interpolated(nodes)))
    return slices


def extent(value: ValueFunction) -> np.ndarray:
    """Bounds of the table in the world: x_min, y_min, x_max, y_max, shape (4,) [m]."""
    x_low, y_low, x_high, y_high = value.grid.bounds
    corners = np.array([(x_low, y_low), (x_high, y_low), (x_high, y_high), (x_low, y_high)])
    x, y, heading = value.placement
    c, s = np.cos(heading), np.sin(heading)
    placed = corners @ np.array([[c, s], [-s, c]]) + [x, y]
    return np.array([*placed.min(axis=0), *placed.max(axis=0)])


def band_levels(slices: list[ValueSlice]) -> np.ndarray:
    """Round times that part the bands of all slices, from zero up, shape (k,) [s]."""
    finite = [each.times[np.isfinite(each.times)] for each in slices]
    longest = max((float(times.max()) for times in finite if times.size), default=0.0)
    return np.asarray(
        MaxNLocator(_BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(0.0, longest or 1.0)
    )


def bands(piece: ValueSlice, levels: np.ndarray) -> list[BaseGeometry]:
    """For each two levels in turn, where the time to go lies between them [m].

    Args:
        piece: The slice.
        levels: Rising, shape (k,) [s].
    """
    times = np.ma.masked_invalid(piece.times)
    if times.count() == 0:
        return [shapely.Polygon() for _ in levels[1:]]
    filled = Figure().add_subplot().contourf(piece.x, piece.y, times, levels)
    areas = []
    for path in filled.get_paths():
        # Rings within rings are holes.
        outlines = [np.asarray(outline) for outline in path.to_polygons()]
        rings = [shapely.LinearRing(outline) for outline in outlines if len(outline) > 3]
        areas.append(shapely.build_area(shapely.MultiLineString(rings)))
    return areas
