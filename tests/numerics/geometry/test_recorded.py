"""Grids, outlines, views and slides of worlds in odd poses are as they were recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.cell_outline import simplify_outline, trace_cells
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, clearances
from sightfield.systems.numerics.geometry.occupancy_map import FREE, OCCUPIED, UNKNOWN, OccupancyMap
from sightfield.systems.numerics.geometry.occupancy_outline import (
    OutlineOptions,
    outline_occupancy_map,
    wall_guards,
)
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.segment_sight import are_clear, build_corner_index
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.team_sight import rim_times, sight_matrix, unit_roots
from sightfield.systems.numerics.geometry.visibility_polygon import cast_ray, visibility_polygon
from sightfield.systems.numerics.geometry.wall_sliding import first_contact, slide, stop_team
from sightfield.systems.numerics.geometry.world import begin_leftmost, shrink_world
from sightfield.systems.numerics.geometry.world_files import from_local_plane, local_plane


@pytest.fixture
def turned_world(random_world, moved):
    """A world of a given number of obstacles that lies askew, and its map from the usual one."""
    return lambda obstacles: moved(random_world(7, obstacles), 0.7, True, 1.3, (-4.0, 11.0))


@pytest.fixture
def bays(moved, random_world):
    """A blob of cells with bays, pillars, thin walls, speckle and cells that touch in corners."""

    def make(seed: int, size: int, share: float) -> np.ndarray:
        rng = np.random.default_rng(seed)
        coarse = rng.random((size // 4, size // 5)) < share
        inside = np.kron(coarse, np.ones((4, 5), bool))
        inside ^= rng.random(inside.shape) < 0.03
        return np.pad(inside, 1)

    return make


def test_the_grid_over_a_world_is_as_recorded(turned_world, as_recorded):
    world, _ = turned_world(9)
    index = build_edge_index(world)
    as_recorded(index, "index")
    as_recorded(build_corner_index(world, index), "corners")
    as_recorded(world.corners, "frames")
    as_recorded(
        [world.size, world.tolerance, world.free_area, world.vertex_count, world.bounds], "sizes"
    )
    as_recorded(begin_leftmost(world).rings, "rings")
    rng = np.random.default_rng(1)
    points = rng.uniform(world.bounds[:2], world.bounds[2:], (20, 2))
    as_recorded(clearances(index, points), "clearances")


@pytest.mark.parametrize("radius", [0.02, 0.31])
def test_a_shrunk_world_is_as_recorded(turned_world, as_recorded, radius):
    world, _ = turned_world(30)
    as_recorded([part.rings for part in shrink_world(world, radius)])


def test_views_and_slides_among_many_walls_are_as_recorded(
    turned_world, random_world, free_points, as_recorded
):
    world, carry = turned_world(25)
    index = build_edge_index(world)
    points = carry(free_points(random_world(7, 25), 3, 60))
    rng = np.random.default_rng(2)
    headings = rng.uniform(-np.pi, np.pi, len(points))
    steps = np.column_stack([np.cos(headings), np.sin(headings)]) * rng.gamma(1.0, 1.5, (60, 1))
    as_recorded([visibility_polygon(index, point) for point in points[:8]], "views")
    # From corners and from within walls, too.
    ring = world.obstacles[3]
    spots = [ring[0], ring[1], 0.3 * ring[0] + 0.7 * ring[1]]
    as_recorded([visibility_polygon(index, spot) for spot in spots], "from the walls")
    units = steps / np.hypot(*steps.T)[:, None]
    rays = [cast_ray(index, *a, *u) for a, u in zip(points, units, strict=True)]
    as_recorded(np.array(rays), "rays")
    slides = [slide(index, *a, *d) for a, d in zip(points, steps, strict=True)]
    as_recorded(np.array(slides), "slides")
    contacts = [first_contact(index, *a, *d) for a, d in zip(points, steps, strict=True)]
    as_recorded(np.array(contacts), "contacts")
    poses = np.column_stack([points, headings]).ravel()
    moves = np.column_stack([steps, headings]).ravel()
    as_recorded(stop_team(index, poses, moves), "stops")
    # Who is in a wall is brought out of it.
    middles = [each.mean(axis=0) for each in world.obstacles[:6]]
    as_recorded([slide(index, *spot, 0.07, -0.2) for spot in middles], "rescues")


@pytest.mark.parametrize("bodies", [False, True])
def test_moments_of_loss_are_as_recorded(random_world, free_points, as_recorded, bodies):
    index = build_edge_index(random_world(11, 12))
    points = free_points(random_world(11, 12), 5, 400).reshape(80, 5, 2)
    rng = np.random.default_rng(3)
    radii = rng.uniform(0.0, 0.4, 5) if bodies else None
    losses, seen = [], []
    for at in points:
        after = at + rng.normal(0.0, 0.5, at.shape)
        ways = (at[:2].ravel(), after[:2].ravel(), at[2:].ravel(), after[2:].ravel())
        losses.append(first_loss(index, *ways, radii))
        seen.append(sight_matrix(index, ways[0], ways[2], radii))
    when = np.array(losses)[:, 0]
    assert 10 < np.isfinite(when).sum() < 70
    assert ((when > 0) & np.isfinite(when)).sum() > 5
    as_recorded(np.array(losses), "losses", relative=1e-5)
    as_recorded(np.array(seen), "seen")


def test_roots_and_moments_at_rims_are_as_recorded(as_recorded):
    rng = np.random.default_rng(4)
    touched = []
    for _ in range(200):
        vectors = [tuple(each) for each in rng.normal(0.0, 1.0, (4, 2)).tolist()]
        touched.append(np.sort(rim_times(*vectors, float(rng.uniform(0.05, 0.9)))))
    assert {len(each) for each in touched} > {0, 1, 2, 3, 4}
    as_recorded([len(each) for each in touched], "counts")
    as_recorded(np.concatenate(touched), "times", relative=1e-5)
    powers = [unit_roots(np.poly(rng.uniform(-0.5, 1.5, 4))[::-1]) for _ in range(30)]
    as_recorded([len(each) for each in powers], "numbers")
    as_recorded(np.concatenate(powers), "roots", relative=1e-5)


@pytest.mark.parametrize("tolerance", [0.3, 1.0, 2.3])
@pytest.mark.parametrize(("seed", "size", "share"), [(1, 40, 0.6), (2, 60, 0.8)])
def test_a_simplified_outline_is_as_recorded(bays, as_recorded, seed, size, share, tolerance):
    inside = bays(seed, size, share)
    outline = trace_cells(inside)
    assert outline.pinched.any()
    guards = wall_guards(inside, tolerance)
    as_recorded([outline.corners, outline.pinched, outline.starts], "cells")
    as_recorded(guards, "guards")
    as_recorded(simplify_outline(outline, guards, tolerance), "outline")


def test_a_long_thin_ring_is_simplified_as_recorded(as_recorded):
    # More vertices in a row than one chord may replace, and a ring that is begun twice.
    steps = np.cumsum(np.random.default_rng(5).integers(-1, 2, 700))
    inside = np.zeros((np.ptp(steps) + 12, 702), bool)
    for column, low in enumerate(steps - steps.min() + 3):
        inside[low : low + 5, column + 1] = True
    outline = trace_cells(inside)
    for tolerance in (0.8, 6.0, 400.0):
        rings = simplify_outline(outline, np.zeros((0, 2)), tolerance)
        as_recorded(rings, f"{tolerance}")


@pytest.mark.parametrize("unknown", ["occupied", "free"])
@pytest.mark.parametrize("tolerance", [None, 0.11])
def test_a_map_becomes_a_world_as_recorded(bays, as_recorded, unknown, tolerance):
    cells = np.where(bays(6, 60, 0.75), FREE, OCCUPIED).astype(np.uint8)
    rng = np.random.default_rng(7)
    cells[(rng.random(cells.shape) < 0.02)] = UNKNOWN
    occupancy = OccupancyMap(cells, 0.07, (3.0, -2.0, 0.4))
    options = OutlineOptions(unknown=unknown, min_obstacle_area=0.015, tolerance=tolerance)
    outline = outline_occupancy_map(occupancy, options)
    as_recorded([outline.world.boundary, *outline.world.obstacles], "rings")
    as_recorded(
        [
            outline.simplification_error,
            outline.cell_area,
            outline.speckle_area,
            outline.unreachable_area,
        ],
        "sizes",
    )


def test_a_drawn_arena_is_as_recorded(as_recorded):
    arena = Arena(side=5.0, obstacles=7, shortest=0.3, longest=1.3, gap=0.2)
    as_recorded(draw_arena(arena, 3).rings, "roomy")
    # So tight that all has to be drawn again.
    tight = Arena(side=3.1, obstacles=6, shortest=0.6, longest=0.8, gap=0.22)
    as_recorded([draw_arena(tight, seed).rings for seed in range(3)], "tight")


def test_degrees_and_metres_are_as_recorded(as_recorded):
    origin = np.array([-71.3, 42.6])
    degrees = origin + np.random.default_rng(8).uniform(-0.4, 0.4, (6, 2))
    metres = local_plane(degrees, origin)
    as_recorded(metres, "metres", relative=1e-9)
    as_recorded(from_local_plane(metres, origin), "degrees", relative=1e-9)


def test_lines_that_enter_obstacles_no_deeper_than_the_tolerance_are_clear(moved, random_world):
    world, _ = moved(random_world(7, 12), 0.7, True, 1.3, (-4.0, 11.0))
    index = build_edge_index(world)
    ring = world.obstacles[2]
    corners = np.flatnonzero(np.isin(ring[:, 0], world.corners.points[:, 0]))
    tested = 0
    for corner in corners:
        before, at, after = ring[corner - 1], ring[corner], ring[(corner + 1) % len(ring)]
        inwards = (before - at) / np.hypot(*(before - at)) + (after - at) / np.hypot(*(after - at))
        inwards /= np.hypot(*inwards)
        across = np.array([-inwards[1], inwards[0]])
        # Short enough to touch nothing else, long enough that the angle at the corner matters.
        for depth, clear in ((0.5, True), (-0.5, True), (1e4, False)):
            middle = at + depth * world.tolerance * inwards
            ends = np.array([middle - 0.02 * across, middle + 0.03 * across])
            if not are_clear(index, ends, ends).all():
                continue
            found = are_clear(index, ends[:1], ends[1:])
            assert found[0] == clear
            tested += 1
    assert tested >= 6
