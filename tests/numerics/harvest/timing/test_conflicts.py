"""Conflicts of two paths, against Shapely at all pairs of cells and at fine samples."""

import numpy as np
import pytest
import shapely
from scipy import ndimage

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.timing.conflicts import GAP, conflict_set, find_conflicts


def intervals_of(matrix):
    """Rows, begins and ends of the true entries of a matrix."""
    change = np.diff(np.pad(matrix.astype(int), ((0, 0), (1, 1))), axis=1)
    row, begins = np.nonzero(change == 1)
    ends = np.nonzero(change == -1)[1]
    rows = np.searchsorted(row, np.arange(len(matrix) + 1))
    return rows, begins, ends


def matrix_of(found):
    """A set of conflicts as a matrix of bool, shape (cells of a, cells of b)."""
    a, b = len(found.of_a.rows) - 1, len(found.of_b.rows) - 1
    matrix = np.zeros((a, b), dtype=bool)
    for k, row in enumerate(np.repeat(np.arange(a), np.diff(found.of_a.rows))):
        matrix[row, found.of_a.begins[k] : found.of_a.ends[k]] = True
    return matrix


@pytest.mark.parametrize("gap", [GAP, 2.3])
@pytest.mark.parametrize("kind", range(4))
def test_the_set_is_what_a_search_of_all_pairs_of_cells_finds(fleets, kind, gap):
    rng = np.random.default_rng([3, kind])
    # Wanderers meet where there are more of them.
    paths = fleets.kinds[kind](rng, 4 if kind == 3 else 2)[:2]
    one, other = (fleets.journey(path, spacing=2.7).sweep for path in paths)
    covers = [
        np.array([fleets.cover_of(sweep, cell) for cell in range(sweep.cells)])
        for sweep in (one, other)
    ]
    apart = shapely.distance(covers[0][:, None], covers[1][None, :])
    keep = gap + one.margins[:, None] + other.margins[None, :]
    # Where rounding decides nothing is asked.
    sure = np.abs(apart - keep) > 1e-9
    found = matrix_of(find_conflicts(one, other, gap))
    assert (found == (apart < keep))[sure].all()
    assert found.any()


@pytest.mark.parametrize("kind", range(4))
def test_outside_of_the_set_machines_never_come_nearer_than_the_gap(fleets, kind):
    rng = np.random.default_rng([4, kind])
    paths = fleets.kinds[kind](rng, 2)
    one, other = (fleets.journey(path).sweep for path in paths)
    marks = matrix_of(find_conflicts(one, other))
    # Fine samples near each other whose cells are not in conflict.
    samples = [np.sort(rng.uniform(0, path.length, 700)) for path in paths]
    cells = [
        np.searchsorted(sweep.stations, at) - 1
        for sweep, at in zip((one, other), samples, strict=True)
    ]
    places = [path.pose_at(at)[:, :2] for path, at in zip(paths, samples, strict=True)]
    off = np.linalg.norm(places[0][:, None] - places[1][None], axis=2)
    p, q = np.nonzero((off < 16.0) & ~marks[np.ix_(*cells)])
    shapes = [
        fleets.outlines_at(path, fleets.outline, at)
        for path, at in zip(paths, samples, strict=True)
    ]
    least = min(
        shapely.distance(first[p], second[q]).min(initial=np.inf)
        for first in shapes[0]
        for second in shapes[1]
    )
    assert len(p) > 0
    assert least >= GAP


def test_conflicts_of_both_machines_are_the_same(fleets):
    rng = np.random.default_rng(8)
    one, other = (fleets.journey(path).sweep for path in fleets.kinds[2](rng, 2))
    found, turned = find_conflicts(one, other), find_conflicts(other, one)
    for ours, theirs in ((found.of_a, turned.of_b), (found.of_b, turned.of_a)):
        for name in ("rows", "begins", "ends"):
            assert (getattr(ours, name) == getattr(theirs, name)).all()
    assert found.parts == turned.parts


def test_encounters_are_the_connected_parts_corners_included():
    rng = np.random.default_rng(2)
    for _ in range(200):
        matrix = rng.random((rng.integers(1, 15), rng.integers(1, 15))) < rng.uniform(0.05, 0.6)
        found = conflict_set(*intervals_of(matrix), matrix.shape[1])
        labels, count = ndimage.label(matrix, np.ones((3, 3)))
        assert found.parts == count
        assert (matrix_of(found) == matrix).all()
        for part, marks in ((found.of_a, labels), (found.of_b, labels.T)):
            numbers = np.full(marks.shape, -1)
            for k, row in enumerate(np.repeat(np.arange(len(marks)), np.diff(part.rows))):
                numbers[row, part.begins[k] : part.ends[k]] = part.encounters[k]
            assert ((numbers >= 0) == (marks > 0)).all()
            # Equal labels are equal numbers, and the other way round.
            pairs = np.unique(np.column_stack([numbers[marks > 0], marks[marks > 0]]), axis=0)
            assert len(pairs) == count


def test_a_negative_gap_is_refused(fleets):
    sweep = fleets.journey(fleets.drive((0.0, 1.0, 0.2), (5.0, 0.0))).sweep
    with pytest.raises(InvalidInput, match="gap"):
        find_conflicts(sweep, sweep, -0.1)
