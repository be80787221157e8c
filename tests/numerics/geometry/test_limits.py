"""What is a world, a map, an arena or a step ends where it is said to end, and not before."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import (
    build_edge_index,
    cell_of,
    edge_distance,
    index_regions,
    point_is_free,
)
from sightfield.systems.numerics.geometry.occupancy_map import (
    FREE,
    OCCUPIED,
    UNKNOWN,
    OccupancyMap,
    read_gray_image,
    read_occupancy_map,
)
from sightfield.systems.numerics.geometry.occupancy_outline import OutlineOptions, select_free_cells
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import (
    are_clear,
    build_corner_index,
    leaves_through_obstacle,
)
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.team_sight import disc_blocks, rim_times, unit_roots
from sightfield.systems.numerics.geometry.visibility_polygon import cast_ray, visibility_polygon
from sightfield.systems.numerics.geometry.wall_sliding import SKIN, first_contact, slide, stop_team
from sightfield.systems.numerics.geometry.world import (
    FARTHEST,
    clean_ring,
    make_world,
    ring_area,
    shrink_world,
    world_from_polygon,
)
from sightfield.systems.numerics.geometry.world_files import load_world

ROOM = [[-1.0, -0.5], [4.0, -0.5], [4.0, 3.5], [-1.0, 3.5]]
BOX = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]]
WORLD = make_world(ROOM, [BOX])
INDEX = build_edge_index(WORLD)
TOLERANCE = WORLD.tolerance


def test_a_room_s_tolerance_is_a_billionth_of_its_size_or_the_rounding_of_its_place():
    assert pytest.approx(1e-9 * math.sqrt(20.0)) == TOLERANCE
    far = make_world(np.add(ROOM, [3e7, 0.0]))
    assert far.tolerance == pytest.approx(64 * 2.0**-52 * 3e7, rel=1e-6)
    assert FARTHEST == 1e12


def test_coordinates_end_at_the_farthest():
    edge = np.array([[0.0, 0.0], [FARTHEST, 0.0], [0.0, -FARTHEST]])
    assert ring_area(clean_ring("ring", edge)) > 0
    with pytest.raises(InvalidInput, match="`ring` must have coordinates within 1e"):
        clean_ring("ring", edge * 1.0001)


@pytest.mark.parametrize("size", [1.0, 700.0])
def test_a_vertex_is_dropped_where_it_is_less_than_a_billionth_off(size):
    for off, kept in ((1.38e-9, 4), (1.45e-9, 5), (-1.45e-9, 5)):
        ring = size * np.array([[0, 0], [0.6, off], [1, 0], [1, 1], [0, 1]])
        assert len(clean_ring("ring", ring)) == kept


@pytest.mark.parametrize(("width", "fine"), [(0.8e-3, True), (0.9e-3, False)])
def test_an_obstacle_may_leave_the_room_by_a_trillionth_of_its_area(width, fine):
    # Farther than what counts as touching.
    box = shapely.box(0.5, 0.7, 0.5 + width, 1 + 1.2e-9).exterior.coords
    if fine:
        assert make_world([[0, 0], [1, 0], [1, 1], [0, 1]], [box]).vertex_count >= 6
        return
    with pytest.raises(InvalidInput, match=r"`obstacles\[0\]` must lie inside the boundary"):
        make_world([[0, 0], [1, 0], [1, 1], [0, 1]], [box])


def test_what_is_left_of_a_world_is_larger_than_its_rounding():
    assert [part.free_area for part in shrink_world(WORLD, 0.0)] == [WORLD.free_area]
    assert len(shrink_world(WORLD, 0.49)) == 1
    with pytest.raises(InvalidInput, match="`radius` must leave free space"):
        shrink_world(WORLD, 2.1)
    with pytest.raises(InvalidInput, match="`radius` must be zero or positive"):
        shrink_world(WORLD, -0.1)
    # Corners of obstacles are cut off at twice the radius: at an angle of 60 degrees just not.
    spike = make_world(ROOM, [[[1, 1], [2, 1.0], [2, 1.2]]])
    reach = shrink_world(spike, 0.1)[0].obstacles[0][:, 0].min()
    assert 1.0 - reach == pytest.approx(0.2, abs=0.01)
    parts = shrink_world(
        make_world([[0, 0], [9, 0], [9, 3], [5, 3], [5, 0.4], [4, 0.4], [4, 3], [0, 3]]), 0.3
    )
    assert [round(part.free_area, 6) for part in parts] == [round(3.4 * 2.4, 6)] * 2


def test_polygons_that_are_none_are_refused():
    for wrong, words in (
        (shapely.Polygon(), r"got Polygon \(empty\)"),
        (shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(2, 0, 3, 1)]), "MultiPolygon"),
        (7, "got int"),
        (shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]), "must be a valid polygon"),
    ):
        with pytest.raises(InvalidInput, match=words):
            world_from_polygon(wrong)


def test_points_are_free_to_the_tolerance_and_no_further():
    for x, y, *way in ((1.4, 1.0, 0, 1), (1.0, 1.7, 1, 0), (4.0, 2.2, 1, 0), (2.0, 1.2, -1, 0)):
        for depth, free in ((-0.9, True), (0.9, True), (1.1, False)):
            at = np.array([x, y]) + depth * TOLERANCE * np.array(way)
            assert point_is_free(INDEX, *at) == free
    outside = [(-3.0, 1.0), (9.0, 1.0), (1.0, -3.0), (1.0, 9.0)]
    assert [cell_of(INDEX.frame, *each) for each in outside] == [-1] * 4
    assert not any(point_is_free(INDEX, *each) for each in outside)


def test_distances_to_an_edge_are_to_its_line_or_its_ends():
    edges = np.array([[0.0, 0.0, 1.0, 1.0, 2.0, 1.0], [0.0, 0.0, 3.0, 0.0, 0.0, 4.0]])
    for point, distance in (((1.3, 0.4), 0.6), ((0.7, 0.6), 0.5), ((2.6, 1.8), 1.0)):
        assert edge_distance(edges, 0, *point) == pytest.approx(distance)
    assert edge_distance(edges, 1, 0.0, 0.0) == pytest.approx(2.4)


def test_worlds_without_worlds_are_refused():
    with pytest.raises(InvalidInput, match="`world` must be given; got none"):
        build_edge_index()
    for regions, words in (
        (WORLD, "must be a list of worlds; got one World"),
        ([], "must have one world at least"),
        ([WORLD, 3], r"regions\[1\]` must be of type World"),
        (3, "must be of type Sequence"),
    ):
        with pytest.raises(InvalidInput, match=words):
            index_regions("regions", regions)
    assert np.array_equal(index_regions("regions", [WORLD]).edges, INDEX.edges)


def test_lines_along_a_wall_enter_it_where_they_are_deeper_than_the_tolerance():
    a, b = np.array([0.2, 1.0]), np.array([3.1, 1.0])
    for depth, clear in ((-2.0, True), (0.9, True), (1.3, False), (3.0, False)):
        lift = [0.0, depth * TOLERANCE]
        ends = np.array([a + lift, b + lift])
        assert are_clear(INDEX, ends, ends[::-1]).tolist() == [clear] * 2
    # From one side, turned about the far end so that it enters at most so deep.
    for depth, clear in ((0.9, True), (3.0, False)):
        tilted = np.array([[0.2, 1.0 + depth * TOLERANCE], [2.0, 1.0]])
        assert are_clear(INDEX, tilted[:1], tilted[1:])[0] == clear


def test_directions_into_a_corner_are_between_its_two_edges():
    number = int(np.flatnonzero((INDEX.edges[:, 2:4] == [1, 1]).all(axis=1))[0])
    for degrees in range(0, 360, 15):
        u = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        inside = 0 < degrees < 90
        assert leaves_through_obstacle(INDEX.edges, number, *u, 0.3, TOLERANCE) == inside
    # As good as along an edge, over a short way and over a long one.
    for reach, angle, inside in (
        (0.5, 0.9, False),
        (0.5, 1.1, True),
        (40.0, 0.9, False),
        (40.0, 1.1, True),
    ):
        turn = angle * TOLERANCE / min(reach, 1.0)
        for u in ((math.cos(turn), math.sin(turn)), (math.sin(turn), math.cos(turn))):
            found = leaves_through_obstacle(INDEX.edges, number, *u, reach, TOLERANCE)
            assert found == inside
    # At a corner of the room there is obstacle all round but for a quarter.
    corner = int(np.flatnonzero((INDEX.edges[:, 2:4] == [-1, -0.5]).all(axis=1))[0])
    for degrees in range(7, 360, 15):
        u = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        found = leaves_through_obstacle(INDEX.edges, corner, *u, 0.3, TOLERANCE)
        assert found == (degrees > 90)


def test_rays_end_at_walls_and_at_corners_on_their_sides():
    for x, y, u, ends in (
        (0.0, 0.3, (1, 0), (4.0, 4.0)),
        (0.0, 1.5, (1, 0), (1.0, 1.0)),
        # Along the box's lower side, which ends the view on the left alone.
        (0.0, 1.0, (1, 0), (4.0, 1.0)),
        (0.0, 2.0, (1, 0), (1.0, 4.0)),
        (3.0, 1.0, (-1, 0), (1.0, 4.0)),
        (1.0, 0.0, (0, 1), (1.0, 3.5)),
        (2.0, 0.0, (0, 1), (3.5, 1.0)),
        # From within a side: along it, away from it, and into it.
        (1.4, 1.0, (1, 0), (2.6, 0.0)),
        (1.4, 1.0, (-1, 0), (0.0, 2.4)),
        (1.4, 1.0, (0, -1), (1.5, 1.5)),
        (1.4, 1.0, (0, 1), (0.0, 0.0)),
        # From a corner.
        (1.0, 1.0, (1, 0), (3.0, 0.0)),
        (1.0, 1.0, (0, 1), (0.0, 2.5)),
        (1.0, 1.0, (-1, 0), (2.0, 2.0)),
        (1.0, 1.0, (0.6, 0.8), (0.0, 0.0)),
    ):
        assert cast_ray(INDEX, x, y, *u) == pytest.approx(ends, abs=1e-7), (x, y, u)


def test_a_view_from_where_there_is_none_is_refused():
    for point in ((1.5, 1.5), (9.0, 0.0), (np.nan, 0.0)):
        with pytest.raises(InvalidInput, match="`point` must be in the free region"):
            visibility_polygon(INDEX, point)
    with pytest.raises(InvalidInput, match=r"`point` must have shape \(2,\); got \(3,\)"):
        visibility_polygon(INDEX, (0.0, 0.0, 0.0))


def test_corners_that_are_looked_at_from_themselves_are_seen():
    corners = build_corner_index(WORLD, INDEX)
    assert sorted(map(tuple, corners.points)) == sorted(map(tuple, BOX))
    for number, point in zip(corners.numbers, corners.points, strict=True):
        assert tuple(INDEX.edges[number, 2:4]) == tuple(point)
    assert np.isinf(corners.heights).sum() == 8


@pytest.mark.parametrize(
    ("line", "centre", "radius", "blocks"),
    [
        ((3.0, 4.0), (0.6, 1.3), 0.31, True),
        ((3.0, 4.0), (0.6, 1.3), 0.29, False),
        ((2.0, 0.0), (1.0, 0.5), 0.5, False),
        ((2.0, 0.0), (-0.3, 0.4), 0.5, False),
        ((2.0, 0.0), (-0.3, 0.4), 0.51, True),
        ((2.0, 0.0), (2.3, -0.4), 0.49, False),
        ((2.0, 0.0), (2.3, -0.4), 0.51, True),
        ((2.0, 0.0), (0.0, 0.5), 0.5, False),
        ((2.0, 0.0), (2.0, 0.5), 0.51, True),
        ((2.0, 0.0), (1.0, 0.0), 0.0, False),
        ((2.0, 0.0), (1.0, 0.0), -0.4, False),
        ((0.0, 0.0), (0.3, 0.4), 0.6, True),
    ],
)
def test_a_disc_blocks_a_line_that_enters_it(line, centre, radius, blocks):
    assert disc_blocks(line, centre, radius) == blocks


def test_rims_touch_a_line_where_distances_are_the_radius():
    # A disc that comes across a line at rest, and one that passes its end.
    line, still = (2.0, 0.0), (0.0, 0.0)
    assert np.sort(rim_times(line, still, (1.0, -1.0), (0.0, 2.0), 0.4)) == pytest.approx(
        [0.3, 0.7]
    )
    beside = np.sort(rim_times(line, still, (-0.3, -1.0), (0.0, 2.0), 0.5))
    assert beside == pytest.approx([0.3, 0.7])
    behind = np.sort(rim_times(line, still, (2.3, -1.0), (0.0, 2.0), 0.5))
    assert behind == pytest.approx([0.3, 0.7])
    for centre in ((5.0, 0.0), (-4.0, 0.0), (1.0, 3.0), (1.0, -3.0)):
        assert len(rim_times(line, still, centre, (0.1, 0.1), 0.5)) == 0
    assert len(rim_times(line, still, (1.0, -1.0), (0.0, 2.0), 0.0)) == 0


@pytest.mark.parametrize(
    ("coefficients", "roots"),
    [
        ([1.0], []),
        ([0.0, 1.0], [0.0]),
        ([1.0, -1.0], [1.0]),
        ([0.3, -1.0], [0.3]),
        ([-0.06, 0.5, -1.0], [0.2, 0.3]),
        ([0.0, 1.0, -1.0], [0.0, 1.0]),
        ([0.0, 0.0], [0.0]),
        ([1.0, 0.0, 0.0, -2.0], [0.5 ** (1 / 3)]),
        ([2.0, -1.0], []),
        ([-0.024, 0.26, -0.9, 1.0], [0.2, 0.3, 0.4]),
    ],
)
def test_roots_are_those_between_zero_and_one(coefficients, roots):
    found = unit_roots(np.array(coefficients))
    assert found == pytest.approx(roots, abs=1e-9)


def test_a_loss_lies_at_the_corner_that_is_passed():
    viewer, after = np.array([0.0, 1.5]), np.array([0.0, 1.5])
    # Of a target that goes down behind the box, seen past its corner (1, 2) from below there.
    loss, who = first_loss(INDEX, viewer, after, np.array([1.0, 3.0]), np.array([3.0, 2.0]))
    # The line through the corner has the slope 1/2; the target's way meets it.
    t = (3.0 - 1.5 - 0.5) / (1.0 + 1.0)
    assert (loss, who) == (pytest.approx(t), 0)
    kept = first_loss(INDEX, viewer, after, np.array([1.0, 3.0]), np.array([1.0, 2.9]))
    assert kept == (np.inf, -1)
    gone = first_loss(INDEX, viewer, after, np.array([2.5, 1.5]), np.array([2.6, 1.5]))
    assert gone == (0.0, 0)
    assert first_loss(INDEX, np.zeros(0), np.zeros(0), viewer, after) == (0.0, 0)
    assert first_loss(INDEX, viewer, after, np.zeros(0), np.zeros(0)) == (np.inf, -1)


def test_steps_end_a_skin_before_the_walls():
    skin = SKIN * TOLERANCE
    part, *tangent = first_contact(INDEX, 0.0, 1.5, 2.0, 0.3)
    assert part * 2.0 == pytest.approx(1.0 - skin, abs=1e-12)
    assert np.abs(tangent) == pytest.approx([0.0, 1.0])
    assert first_contact(INDEX, 0.0, 1.5, 1.0 - 1.1 * skin, 0.0) == (1.0, 0.0, 0.0)
    assert first_contact(INDEX, 0.0, 1.5, 1.0 - 0.9 * skin, 0.0)[0] < 1.0
    # Past the corner by more than a skin, and by less.
    assert first_contact(INDEX, 0.0, 1.0 - 1.1 * skin, 2.0, 0.0)[0] == 1.0
    assert first_contact(INDEX, 0.0, 1.0 - 0.9 * skin, 2.0, 0.0)[0] < 1.0
    # Along a wall, and away from it.
    assert first_contact(INDEX, 0.0, -0.5, 1.0, 0.0)[0] == 1.0
    assert first_contact(INDEX, 0.0, -0.5, 0.1, 0.4)[0] == 1.0
    assert slide(INDEX, 0.4, 0.4, 0.0, 0.0) == (0.0, 0.0)
    # Inside the box the way out is by its nearest side, no farther than asked.
    assert slide(INDEX, 1.9, 1.4, 0.01, 0.0) == pytest.approx((0.01, 0.0))
    far = slide(INDEX, 1.9, 1.4, 0.3, 0.4)
    assert far == pytest.approx((0.1 + 2 * skin, 0.0), abs=1e-12)
    poses = np.array([0.0, 1.5, 0.3, 1.5, 1.5, 0.1, 0.0, 0.0, 1.0])
    steps = np.array([2.0, 0.0, 1.0, 0.3, 0.0, 1.0, 0.5, 0.2, 0.0])
    assert stop_team(INDEX, poses, steps) == pytest.approx([0.5, 0.0, 1.0], abs=1e-5)


@pytest.mark.parametrize(
    ("settings", "fits"),
    [
        ({"longest": 3.4}, True),
        ({"longest": 3.41}, False),
        ({"shortest": 0.9}, True),
        ({"shortest": 0.91}, False),
        ({"obstacles": 0}, True),
        ({"gap": 0.0}, True),
        ({"longest": 0.0, "shortest": 0.0}, False),
    ],
)
def test_arenas_are_drawn_of_what_just_fits(settings, fits):
    if fits:
        Arena(**settings)
        return
    with pytest.raises(InvalidInput):
        Arena(**settings)


def test_arenas_have_seeds_from_zero_on():
    assert len(draw_arena(Arena(obstacles=2), 0).obstacles) == 2
    with pytest.raises(InvalidInput, match="`seed` must be zero or positive; got -1"):
        draw_arena(Arena(), -1)


@pytest.mark.parametrize(
    ("length", "thick", "kept"),
    [(8, 2, True), (7, 2, False), (9, 3, False), (12, 3, True), (3, 1, False), (4, 1, True)],
)
def test_a_wall_is_four_times_as_long_as_it_is_thick(length, thick, kept):
    cells = np.full((30, 40), FREE, np.uint8)
    cells[10 : 10 + thick, 5 : 5 + length] = OCCUPIED
    found = select_free_cells(OccupancyMap(cells, 0.1, (0, 0, 0)), False, 100.0, 4.0)
    assert (found.speckle_area == 0) == kept
    assert found.inside.sum() == cells.size - length * thick * kept


def test_options_of_outlines_end_at_zero():
    OutlineOptions(min_obstacle_area=0.0, min_wall_length=0.0, tolerance=1e-9)
    for wrong in ({"tolerance": 0.0}, {"min_wall_length": -1e-9}, {"unknown": "maybe"}):
        with pytest.raises(InvalidInput):
            OutlineOptions(**wrong)


SETTINGS = "image: a.pgm\norigin: [0, 0, 0]\nnegate: 0\n"


@pytest.mark.parametrize(
    ("text", "fine"),
    [
        ("resolution: 1e-6\nfree_thresh: 0.2\noccupied_thresh: 0.6", True),
        ("resolution: 1e6\nfree_thresh: 0.2\noccupied_thresh: 0.6", True),
        ("resolution: 0.9e-6\nfree_thresh: 0.2\noccupied_thresh: 0.6", False),
        ("resolution: 1.1e6\nfree_thresh: 0.2\noccupied_thresh: 0.6", False),
        ("resolution: 1\nfree_thresh: 0.5\noccupied_thresh: 0.5", True),
        ("resolution: 1\nfree_thresh: 0.51\noccupied_thresh: 0.5", False),
        ("resolution: 1\nfree_thresh: 0.2\noccupied_thresh: 1.0", True),
        ("resolution: 1\nfree_thresh: 0.2\noccupied_thresh: 1.01", False),
        ("resolution: 1\nfree_thresh: -0.01\noccupied_thresh: 1", False),
    ],
)
def test_settings_of_maps_end_where_they_say(tmp_path, text, fine):
    (tmp_path / "a.pgm").write_bytes(b"P5 2 2 255\n" + bytes([255, 254, 0, 130]))
    (tmp_path / "a.yaml").write_text(SETTINGS + text)
    if fine:
        read_occupancy_map(tmp_path / "a.yaml")
        return
    with pytest.raises(InvalidInput):
        read_occupancy_map(tmp_path / "a.yaml")


@pytest.mark.parametrize(
    ("size", "white", "fine"),
    [(b"2 2", 65535, True), (b"2 2", 65536, False), (b"2 2", 1, True), (b"0 2", 9, False)],
)
def test_sizes_and_whites_of_pictures_end_where_they_say(tmp_path, size, white, fine):
    depth = 2 if white > 255 else 1
    (tmp_path / "a.pgm").write_bytes(b"P5 %b %d\n" % (size, white) + bytes([0, 1] * 2 * depth))
    text = "resolution: 1\nfree_thresh: 0.9\noccupied_thresh: 0.999999"
    (tmp_path / "a.yaml").write_text(SETTINGS.replace("negate: 0", "negate: 1") + text)
    if fine:
        read_occupancy_map(tmp_path / "a.yaml")
        return
    with pytest.raises(InvalidInput):
        read_occupancy_map(tmp_path / "a.yaml")


def test_raw_pixels_of_another_white_are_percent_on_a_scale_of_255(tmp_path):
    pixels = np.array([10, 100, 180, 202, 300], dtype=">u2")
    (tmp_path / "a.pgm").write_bytes(b"P5 5 1 510\n" + pixels.tobytes())
    text = "mode: raw\nresolution: 1\nfree_thresh: 0.2\noccupied_thresh: 0.6"
    (tmp_path / "a.yaml").write_text(SETTINGS + text)
    cells = read_occupancy_map(tmp_path / "a.yaml").cells[0]
    assert cells.tolist() == [FREE, UNKNOWN, OCCUPIED, UNKNOWN, UNKNOWN]


@pytest.mark.parametrize(("white", "depth"), [(255, 1), (256, 2), (65535, 2)])
def test_a_line_end_behind_the_last_pixel_is_none(tmp_path, white, depth):
    pixels = np.arange(6).reshape(2, 3) + 10
    data = b"P5 3 2 %d\n" % white + pixels.astype(f">u{depth}").tobytes()
    path = tmp_path / "a.pgm"
    for end in (b"", b"\n", b" \r\n"):
        path.write_bytes(data + end)
        np.testing.assert_array_equal(read_gray_image(path).channels[..., 0], pixels)
    for wrong in (data + b"\x0b\x00", data[:-depth], data + b"\n7\n"):
        path.write_bytes(wrong)
        with pytest.raises(InvalidInput, match="must hold the 3 x 2 pixels"):
            read_gray_image(path)


@pytest.mark.parametrize(
    ("corner", "coordinates", "fine"),
    [
        ((0.999, 0.5), "metres", False),
        ((1.0, 0.5), "metres", True),
        ((1.0, 0.5), "wgs84", True),
        ((1.001, 0.5), "wgs84", False),
        ((0.5, 1.001), "wgs84", False),
    ],
)
def test_a_degree_is_the_widest_field_and_the_narrowest_of_metres(
    tmp_path, corner, coordinates, fine
):
    x, y = corner
    (tmp_path / "a.wkt").write_text(f"POLYGON ((0 0, {x} 0, {x} {y}, 0 {y}, 0 0))")
    if fine:
        load_world(tmp_path / "a.wkt", coordinates=coordinates)
        return
    with pytest.raises(InvalidInput):
        load_world(tmp_path / "a.wkt", coordinates=coordinates)


@pytest.mark.parametrize(
    ("lon", "lat", "fine"),
    [
        (179.5, 0, True),
        (179.6, 0, False),
        (-180, 0, True),
        (-180.1, 0, False),
        (0, 89.5, True),
        (0, 89.6, False),
        (0, -90, True),
        (0, -90.1, False),
    ],
)
def test_the_globe_ends_at_its_seam_and_at_its_poles(tmp_path, lon, lat, fine):
    box = shapely.box(lon, lat, lon + 0.5, lat + 0.5)
    (tmp_path / "a.wkt").write_text(box.wkt)
    if fine:
        load_world(tmp_path / "a.wkt", coordinates="wgs84")
        with pytest.raises(InvalidInput, match="looks like degrees"):
            load_world(tmp_path / "a.wkt")
        return
    with pytest.raises(InvalidInput, match=r"within \+-180, \+-90 degrees"):
        load_world(tmp_path / "a.wkt", coordinates="wgs84")
    load_world(tmp_path / "a.wkt")
