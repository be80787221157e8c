"""Simplified rings against an exhaustive search over all chords."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sightfield.systems.numerics.geometry.cell_outline import (
    simplify_outline,
    trace_cells,
    without_pinches,
)

NO_GUARDS = np.zeros((0, 2))


def turns_around(ring: np.ndarray, mark: np.ndarray) -> int:
    """How often a ring winds around a point, by adding up the angles it is seen under."""
    away = ring - mark
    ahead = np.roll(away, -1, axis=0)
    cross = away[:, 0] * ahead[:, 1] - away[:, 1] * ahead[:, 0]
    return round(np.arctan2(cross, (away * ahead).sum(axis=1)).sum() / (2 * np.pi))


def to_segment(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distances of points from a segment."""
    along = end - start
    t = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    return np.hypot(*(points - start - t[:, None] * along).T)


def is_allowed(ring, on_ring, tail, length, marks, tolerance) -> bool:
    """Whether a chord may replace `length` steps from the tail, from the definition alone."""
    chain = [(tail + k) % len(ring) for k in range(length + 1)]
    start, end = ring[chain[0]], ring[chain[-1]]
    if (start == end).all():
        return False
    if to_segment(ring[chain], start, end).max() > tolerance * (1 + 1e-9):
        return False
    swept = ring[[k for k in chain if on_ring[k]]]
    own = {tuple(point) for point in swept}
    for mark in marks:
        if tuple(mark) in own:
            continue
        if to_segment(mark[None], start, end)[0] == 0.0 or turns_around(swept, mark) != 0:
            return False
    return True


def fewest_by_search(ring, on_ring, marks, tolerance) -> int:
    """Fewest allowed chords around a ring, from the best of all starts."""
    places = np.flatnonzero(on_ring)
    size = len(ring)
    best = size
    allowed: dict[tuple[int, int], bool] = {}
    for start in places:
        chords = {0: 0}
        ahead = [*sorted({int(p - start) % size for p in places}), size]
        for a, b in itertools.combinations(ahead, 2):
            shorter = a in chords and chords[a] + 1 < chords.get(b, size + 1)
            chord = (start + a) % size, b - a
            if shorter and chord not in allowed:
                allowed[chord] = is_allowed(ring, on_ring, *chord, marks, tolerance)
            if shorter and allowed[chord]:
                chords[b] = chords[a] + 1
        best = min(best, chords[size])
    return best


def all_allowed(vertices, ring, on_ring, marks, tolerance) -> bool:
    """Whether a simplified ring is made of allowed chords only."""
    places = [int(np.flatnonzero((ring == v).all(axis=1) & on_ring)[0]) for v in vertices]
    steps = (np.roll(places, -1) - places) % len(ring)
    return all(
        is_allowed(ring, on_ring, tail, step, marks, tolerance)
        for tail, step in zip(places, steps.tolist(), strict=True)
    )


cells = arrays(bool, st.tuples(st.integers(2, 4), st.integers(2, 4)))


@settings(max_examples=50)
@given(cells=cells, tolerance=st.sampled_from([0.3, 0.5, 0.75, 1.0]))
def test_chords_are_allowed_and_at_most_one_more_than_the_fewest(cells, tolerance):
    outline = trace_cells(np.pad(cells, 1))
    if len(outline.corners) == 0:
        return
    points, on_ring, starts = without_pinches(outline, min(0.5, tolerance))
    # Two guards to mind, beside the middles of two cells.
    guards = np.array([[1.75, 1.5], [2.5, 2.75]])
    marks = np.concatenate([points[on_ring], guards])
    simplified = simplify_outline(outline, guards, tolerance)
    for vertices, first, last in zip(simplified, starts[:-1], starts[1:], strict=True):
        chain = points[first:last], on_ring[first:last], marks, tolerance
        assert all_allowed(vertices, *chain)
        fewest = fewest_by_search(*chain)
        assert fewest <= len(vertices) <= fewest + 1


@pytest.mark.parametrize("slope", [(1, 1), (1, 2), (2, 5), (1, 7)])
def test_a_straight_oblique_side_stays_one_edge(slope):
    rise, run = slope
    columns = np.arange(60)
    below = (columns[None] * rise + run > np.arange(70)[:, None] * run) & (columns > 0)[None]
    below[0] = below[-1] = below[:, 0] = below[:, -1] = False
    (ring,) = simplify_outline(trace_cells(below), NO_GUARDS, 1.0)
    # Bottom, right side and slope; the left end is as thin as a cell or two.
    assert len(ring) == 3


def test_the_corners_of_a_rectangle_are_not_moved():
    cells = np.zeros((12, 20), dtype=bool)
    cells[2:9, 3:15] = True
    (ring,) = simplify_outline(trace_cells(cells), NO_GUARDS, 1.0)
    assert {tuple(point) for point in ring} == {(3, 2), (15, 2), (15, 9), (3, 9)}


def test_a_bump_as_high_as_the_tolerance_disappears_and_a_higher_one_does_not():
    cells = np.zeros((14, 20), dtype=bool)
    cells[2:9, 3:15] = True
    cells[9, 8] = True
    assert len(simplify_outline(trace_cells(cells), NO_GUARDS, 1.0)[0]) == 4
    assert len(simplify_outline(trace_cells(cells), NO_GUARDS, 0.9)[0]) > 4


def test_an_outline_does_not_pass_a_guard():
    cells = np.zeros((14, 20), dtype=bool)
    cells[2:9, 3:15] = True
    cells[9, 8] = True
    (ring,) = simplify_outline(trace_cells(cells), np.array([[8.5, 9.5]]), 1.0)
    assert turns_around(ring, np.array([8.5, 9.5])) == 1


def test_a_dead_end_along_a_wall_is_not_cut_off():
    # The chord along the lower wall to the mouth's upper corner passes near enough to the line
    # of the dead end, but ends long before it.
    cells = np.zeros((14, 16), dtype=bool)
    cells[2:11, 2:9] = True
    cells[2, 9:12] = True
    (ring,) = simplify_outline(trace_cells(cells), NO_GUARDS, 1.5)
    assert ring[:, 0].max() >= 12 - 1.5
