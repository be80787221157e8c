"""Borders of ground and standing crop, against Shapely."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.machines import Combine, combine_outline
from sightfield.systems.numerics.harvest.turns.borders import (
    BUCKET,
    CELL,
    CROP_CELL,
    FARTHEST,
    StandingCrop,
    border_distance,
    cuts_edge,
    edges_of,
    make_borders,
)
from sightfield.systems.numerics.harvest.turns.ground import Ground, make_footprint
from sightfield.systems.numerics.harvest.turns.turn import path_of_pieces

RIM = shapely.Polygon([(-3.3, 1.7), (61.2, -4.1), (57.9, 33.3), (21.1, 28.4), (2.2, 37.8)])
REGION = RIM - shapely.Polygon([(12.3, 9.1), (20.7, 7.2), (19.4, 16.6)])
BORDERS = make_borders(REGION)


def test_edges_are_all_rings_in_pieces_of_twenty_metres_at_most():
    edges = edges_of(REGION)
    lengths = np.hypot(*(edges[:, 2:] - edges[:, :2]).T)
    assert lengths.sum() == pytest.approx(REGION.length)
    # The longest edge is 64.8 m, the only one in four pieces.
    assert lengths.max() < 20.0
    assert len(edges) == 4 + 2 + 2 + 2 + 2 + 3
    lines = shapely.linestrings(edges.reshape(-1, 2, 2))
    assert shapely.hausdorff_distance(shapely.union_all(lines), REGION.boundary) < 1e-9
    assert edges_of(shapely.Polygon()).shape == (0, 4)


def test_nodes_know_their_distance_to_the_border():
    x0, y0, x1, y1 = REGION.bounds
    np.testing.assert_allclose(BORDERS.origin, [x0 - CELL, y0 - CELL])
    rows, columns = BORDERS.distances.shape
    # One node before the box, and at least one behind it.
    assert columns == math.ceil((x1 - x0) / CELL) + 3
    assert rows == math.ceil((y1 - y0) / CELL) + 3
    x = BORDERS.origin[0] + CELL * np.arange(columns)
    y = BORDERS.origin[1] + CELL * np.arange(rows)[:, None]
    nodes = shapely.points(x + 0.0 * y, y + 0.0 * x)
    away = np.minimum(shapely.distance(REGION.boundary, nodes), FARTHEST)
    away[~shapely.contains(REGION, nodes)] *= -1.0
    np.testing.assert_allclose(BORDERS.distances, away, atol=1e-5)
    assert away.max() == FARTHEST


def test_between_nodes_distances_are_bilinear_and_beyond_the_raster_far_off():
    rng = np.random.default_rng(3)
    rows, columns = BORDERS.distances.shape
    for u, v in rng.uniform([0, 0], [columns - 1, rows - 1], (200, 2)):
        i, j = int(u), int(v)
        corner = BORDERS.distances[j : j + 2, i : i + 2].astype(float)
        said = border_distance(BORDERS, *(BORDERS.origin + CELL * np.array([u, v])))
        share = np.outer([1 - v + j, v - j], [1 - u + i, u - i])
        assert said == pytest.approx((share * corner).sum(), abs=1e-5)
    x, y = BORDERS.origin
    last_x, last_y = x + CELL * (columns - 1), y + CELL * (rows - 1)
    middle = (x + last_x) / 2, (y + last_y) / 2
    for far in ((x - 0.1, middle[1]), (middle[0], y - 0.1)):
        assert border_distance(BORDERS, *far) == -FARTHEST
    for far in ((last_x + 0.1, middle[1]), (middle[0], last_y + 0.1)):
        assert border_distance(BORDERS, *far) == -FARTHEST
    # The last cell before each end of the raster has values of its own.
    for near in ((x + 0.1, y + 0.1), (last_x - 0.1, last_y - 0.1)):
        assert -FARTHEST < border_distance(BORDERS, *near) < 0.0


def test_each_bucket_lists_the_edges_whose_boxes_reach_into_it():
    rows, columns = BORDERS.distances.shape
    columns, rows = int(columns * CELL / BUCKET) + 1, int(rows * CELL / BUCKET) + 1
    assert len(BORDERS.starts) == rows * columns + 1
    assert BORDERS.starts[0] == 0
    assert BORDERS.starts[-1] == len(BORDERS.items)
    low, high = (
        np.floor((pick(BORDERS.edges[:, :2], BORDERS.edges[:, 2:]) - BORDERS.origin) / BUCKET)
        for pick in (np.minimum, np.maximum)
    )
    for j in range(rows):
        for i in range(columns):
            bucket = j * columns + i
            items = BORDERS.items[BORDERS.starts[bucket] : BORDERS.starts[bucket + 1]]
            inside = ((low <= [i, j]) & (high >= [i, j])).all(axis=1)
            assert items.tolist() == np.flatnonzero(inside).tolist()


@pytest.mark.parametrize("touch", [0.01, 0.6])
def test_an_edge_cuts_a_polygon_that_it_comes_into_deeper_than_a_touch(touch):
    rng = np.random.default_rng(7)
    edges = shapely.linestrings(BORDERS.edges.reshape(-1, 2, 2))
    said = []
    for _ in range(400):
        hull = shapely.MultiPoint(rng.uniform(-6, 40, 2) * [1.4, 1.0] + rng.normal(0, 2.2, (5, 2)))
        hull = shapely.orient_polygons(hull.convex_hull)
        inner = hull.buffer(-touch, join_style="mitre", mitre_limit=1e3)
        cut = shapely.intersection(inner, edges)
        if 0.0 < shapely.length(cut).max() < 1e-3:
            continue
        corners = np.array(hull.exterior.coords)[:-1]
        room = np.concatenate([corners, np.full((3, 2), 1e3)])
        said.append(cuts_edge(BORDERS, room, len(corners), touch))
        assert said[-1] == (shapely.length(cut).max() > 0.0)
    assert 50 < sum(said) < len(said) - 50


def test_an_edge_along_a_side_does_not_cut_a_box_and_one_beyond_its_corner_does():
    borders = make_borders(shapely.box(0.0, 0.0, 30.0, 20.0))

    def cut(x, y, touch=0.0):
        box = np.array([[x, y], [x + 5.0, y], [x + 5.0, y + 3.0], [x, y + 3.0]])
        return cuts_edge(borders, box, 4, touch)

    assert not cut(0.0, 7.0)
    assert not cut(25.0, 17.0)
    assert cut(-0.1, 7.0)
    assert cut(25.1, 10.0)
    assert cut(7.0, 17.1)
    assert not cut(-0.1, -0.1, touch=0.1)
    assert cut(-0.1, -0.1, touch=0.09)


STAND = shapely.Polygon([(4.2, 3.1), (17.9, 5.3), (15.2, 14.8), (6.1, 12.2)])


def test_crop_stands_on_cells_whose_middles_are_in_it_until_it_is_cut():
    crop = StandingCrop(STAND)
    x0, y0, x1, y1 = STAND.bounds
    assert crop.origin.tolist() == [x0, y0]
    shape = math.ceil((y1 - y0) / CROP_CELL) + 1, math.ceil((x1 - x0) / CROP_CELL) + 1
    assert crop.cells.shape == shape
    y, x = (np.indices(shape) + 0.5) * CROP_CELL + np.array([y0, x0])[:, None, None]
    middles = shapely.points(x, y)
    stands = shapely.contains(STAND, middles)
    assert (crop.cells == stands).all()
    assert crop.area == stands.sum() * CROP_CELL**2
    gone = shapely.Polygon([(8.1, 0.0), (12.3, 0.2), (11.4, 20.0), (7.2, 19.0)])
    again = crop.copy()
    again.mark(gone, stands=False)
    cut = shapely.contains(gone, middles)
    assert (again.cells == stands & ~cut).all()
    assert (crop.cells == stands).all()
    again.mark(gone & STAND, stands=True)
    assert (again.cells == stands).all()


@pytest.mark.parametrize("sizes", [(7.5, 1.7, 7.0, 3.4), (3.7, 2.1, 9.1, 3.2)])
def test_a_footprint_is_covered_by_discs_and_covers_discs(sizes):
    width, depth, length, body_width = sizes
    outline = combine_outline(
        Combine(header_width=width, header_depth=depth, length=length, width=body_width)
    )
    footprint = make_footprint(outline)
    assert footprint.reach == pytest.approx(np.hypot(*np.concatenate(outline).T).max())
    inside = [shapely.Point(x, y).buffer(r - 1e-3) for x, y, r in footprint.inside]
    for part, (x, y, radius) in zip(outline, footprint.around, strict=True):
        assert np.hypot(*(part - [x, y]).T) == pytest.approx(np.full(4, radius))
        mine = [disc for disc in inside if shapely.Polygon(part).contains(disc)]
        # As wide as the shorter side, and from end to end of the longer one, without gaps.
        short, long = sorted(np.ptp(part, axis=0))
        assert len(mine) >= max(2, math.ceil(long / short))
        ends = np.array([np.array(disc.bounds).reshape(2, 2) for disc in mine])
        np.testing.assert_allclose(ends.min(axis=(0, 1)), part.min(axis=0), atol=2e-3)
        np.testing.assert_allclose(ends.max(axis=(0, 1)), part.max(axis=0), atol=2e-3)
        assert shapely.union_all(mine).buffer(2e-3).geom_type == "Polygon"
    assert all(any(shapely.Polygon(part).contains(disc) for part in outline) for disc in inside)
    body = outline.body
    low, high = body.min(axis=0), body.max(axis=0)
    for axis in (0, 1):
        rows = np.unique(np.round(footprint.body[:, axis], 9))
        assert rows[[0, -1]] == pytest.approx(
            [low[axis] + CROP_CELL / 2, high[axis] - CROP_CELL / 2]
        )
        assert np.diff(rows).max() <= CROP_CELL + 1e-9
        assert len(rows) == math.ceil((high[axis] - low[axis]) / CROP_CELL - 1 - 1e-9) + 1
    assert len(footprint.body) == np.prod(
        [len(np.unique(np.round(footprint.body[:, axis], 9))) for axis in (0, 1)]
    )


def test_ground_without_an_area_is_refused():
    lines = shapely.GeometryCollection([shapely.LineString([(0, 0), (1, 1)]), shapely.Polygon()])
    with pytest.raises(InvalidInput, match="`ground` must have an area"):
        Ground(lines)
    parts = shapely.GeometryCollection([shapely.LineString([(0, 0), (1, 1)]), STAND])
    assert Ground(parts).region.equals(STAND)


def test_pieces_are_driven_in_arcs_of_a_quarter_turn_and_end_at_the_goal():
    start = np.array([1.0, 2.0, 0.4])
    curvatures, lengths = np.array([0.2, 0.0, 0.0, -0.25]), np.array([17.0, 0.0, -3.0, 2.0])
    x, y, theta = 1.0, 2.0, 0.4
    for curvature, length in zip(curvatures, lengths, strict=True):
        turned = curvature * length
        chord = length * np.sinc(turned / (2 * np.pi))
        x, y = x + chord * math.cos(theta + turned / 2), y + chord * math.sin(theta + turned / 2)
        theta += turned
    # But for rounding and whole turns.
    goal = np.array([x + 1e-9, y - 1e-9, theta - 2 * math.tau])
    path = path_of_pieces(start, goal, curvatures, lengths)
    assert path.poses[0] == pytest.approx(start)
    assert path.poses[-1, :2].tolist() == goal[:2].tolist()
    assert path.poses[-1, 2] == pytest.approx(theta)
    # 3.4 rad are three arcs.
    assert path.gears.tolist() == [1, 1, 1, -1, 1]
    assert path.curvatures * path.gears == pytest.approx([0.2, 0.2, 0.2, 0.0, -0.25])
    assert not path.cutting.any()
    exact = path_of_pieces(start, goal, np.array([0.2]), np.array([5 * math.pi / 2]))
    assert len(exact.gears) == 1
    assert path_of_pieces(start, start, np.zeros(1), np.zeros(1)).poses.tolist() == [start.tolist()]
    with pytest.raises(ValueError, match="argument"):
        path_of_pieces(start, goal, curvatures, lengths[1:])
