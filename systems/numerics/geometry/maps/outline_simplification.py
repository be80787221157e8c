"""Simplifying all rings of a cell outline within a tolerance, keeping its topology."""

from typing import NamedTuple

import numpy as np

from .cell_outline import CellOutline, without_pinches
from .fewest_chords import fewest_chords

# Side of a bucket of marks; 4 to 16 are equally fast [cells].
BUCKET = 4.0

# Rings of up to so many points are searched from several of them.
SMALL_RING = 100


class MarkGrid(NamedTuple):
    """Points that no chord may sweep over, in buckets of a square grid.

    Attributes:
        points: Shape (m, 2) [cells].
        x, y, cell: Corner of the grid, side of a bucket [cells].
        columns: Buckets in a row.
        starts: Where each bucket starts in `items`, row by row, and their end,
            shape (buckets + 1,).
        items: Numbers of points, shape (m,).
        winding, stamp: Scratch of the search: how often the area swept from the current tail winds
            around each point, valid where the stamp is the current serial number; shape (m,).
        serial: That number, shape (1,).
    """

    points: np.ndarray
    x: float
    y: float
    cell: float
    columns: int
    starts: np.ndarray
    items: np.ndarray
    winding: np.ndarray
    stamp: np.ndarray
    serial: np.ndarray


def simplify_outline(
    outline: CellOutline, guards: np.ndarray, tolerance: float
) -> list[np.ndarray]:
    """Replace each ring by one of the fewest vertices within a tolerance.

    The new rings cross neither themselves nor each other, enclose each other as before and pass
    no guard. They do not even touch: where old rings met in a pinched corner, a bridge now joins
    what is not in the region. Every point of a new ring is within the tolerance of the old one,
    and the other way round.

    Args:
        outline: The rings.
        guards: Points to leave on their side, shape (n, 2) [cells].
        tolerance: Positive [cells].

    Returns:
        One array of vertices for each ring, shape (k, 2) [cells].
    """
    # A cut of the largest leg is off by 0.35 cells; a finer tolerance allows only a smaller one.
    points, on_ring, starts = without_pinches(outline, min(0.5, tolerance))
    marks = _mark_grid(np.concatenate([points, guards]), len(points), on_ring)
    spans = zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)
    return [_shortest_ring(points, on_ring, span, marks, tolerance) for span in spans]


def _shortest_ring(
    points: np.ndarray,
    on_ring: np.ndarray,
    span: tuple[int, int],
    marks: MarkGrid,
    tolerance: float,
) -> np.ndarray:
    """The ring of fewest vertices, and of those the one that sweeps the least area.

    The search needs a vertex to start from, and the best ring through one may have one vertex
    more than the best of all. So what the first corner gives is only taken for a choice of
    starts: around a small ring every vertex of it, around a large one that half a turn away.
    """
    first, last = span

    def search(start: int) -> tuple[np.ndarray, float]:
        keep, swept = fewest_chords(points, on_ring, first, last, start, marks, tolerance)
        return keep, float(swept)

    start = int(np.argmax(on_ring[first:last]))
    keep, _ = search(start)
    starts = np.flatnonzero(keep)
    if last - first > SMALL_RING:
        onwards = np.flatnonzero(np.roll(keep, -start))
        starts = (onwards[[len(onwards) // 2]] + start) % (last - first)
    rings = [search(int(place)) for place in starts]
    keep, _ = min(rings, key=lambda ring: (ring[0].sum(), ring[1]))
    return points[first:last][keep]


def _mark_grid(points: np.ndarray, ring_points: int, on_ring: np.ndarray) -> MarkGrid:
    """Put the guards, and the ring points that are on their ring, into buckets."""
    low = points.min(axis=0)
    place = np.floor((points - low) / BUCKET).astype(np.int64)
    columns, rows = (place.max(axis=0) + 1).tolist()
    bucket = place[:, 1] * columns + place[:, 0]
    items = np.argsort(bucket, kind="stable")
    items = items[(items >= ring_points) | on_ring[np.minimum(items, ring_points - 1)]]
    counts = np.bincount(bucket[items], minlength=columns * rows)
    starts = np.concatenate([[0], np.cumsum(counts)])
    winding, stamp = np.zeros((2, len(points)), dtype=np.int64)
    serial = np.zeros(1, dtype=np.int64)
    corner = (float(low[0]), float(low[1]))
    return MarkGrid(points, *corner, BUCKET, columns, starts, items, winding, stamp, serial)
