"""Closed rings of vertices: cleaning, orientation and area."""

import numpy as np
import shapely

from ..errors import InvalidInput, require

# A vertex this close to the line of its neighbours, relative to the ring's size, is collinear.
COLLINEAR = 1e-9


def ring_area(ring: np.ndarray) -> float:
    """Signed area of a ring, positive when counter-clockwise, shape (n, 2) [m] -> [m^2]."""
    # Relative to a vertex, so that a far origin costs no digits.
    x, y = (ring - ring[0]).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def clean_ring(name: str, ring: object) -> np.ndarray:
    """Return a ring as a counter-clockwise float array without repeated or collinear vertices.

    Args:
        name: What to call the ring in an error.
        ring: Vertices in order, shape (n, 2) [m]; the first may be repeated at the end.

    Raises:
        InvalidInput: Not an array of points, not finite, without area, or crossing itself.
    """
    try:
        points = np.array([list(p) for p in ring], dtype=float)  # type: ignore[union-attr]  # what cannot be iterated is refused below
    except (TypeError, ValueError):
        raise InvalidInput(f"`{name}` must be a list of [x, y] points; got {ring!r}") from None
    require(
        points.ndim == 2 and points.shape[1] == 2,
        name,
        "be a list of [x, y] points",
        "no points" if points.size == 0 else f"an array of shape {points.shape}",
    )
    require(bool(np.isfinite(points).all()), name, "have finite coordinates", points.tolist())
    original = points
    points = _drop_redundant(points)
    require(len(points) >= 3, name, "enclose an area", original.tolist())
    outline = shapely.Polygon(points)
    if not outline.is_valid:
        raise InvalidInput(
            f"`{name}` must not cross itself; got {shapely.is_valid_reason(outline)}"
        )
    return points if ring_area(points) > 0 else points[::-1].copy()


def _drop_redundant(points: np.ndarray) -> np.ndarray:
    """Drop repeated and collinear vertices until none is left."""
    size = float(np.hypot(*np.ptp(points, axis=0)))
    while len(points) >= 3:
        before = np.roll(points, 1, axis=0)
        after = np.roll(points, -1, axis=0)
        chord = after - before
        length = np.hypot(*chord.T)
        offset = points - before
        height = np.abs(chord[:, 0] * offset[:, 1] - chord[:, 1] * offset[:, 0])
        height = height / np.where(length > 0, length, 1.0)
        repeated = np.hypot(*offset.T) <= COLLINEAR * size
        # A spike that doubles back has height 0 too, but its tip lies beyond both neighbours;
        # it is left for the validity check to name.
        between = np.einsum("ij,ij->i", offset, points - after) <= 0
        redundant = repeated | ((height <= COLLINEAR * size) & between)
        if not redundant.any():
            break
        # One at a time in each run: a neighbour of a dropped vertex is judged afresh.
        keep = ~redundant | np.roll(redundant, 1)
        if redundant.all():
            keep[:] = True
            keep[::2] = False
        points = points[keep]
    return points
