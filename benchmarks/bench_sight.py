"""Clear-segment tests against Shapely, visibility polygons against VisiLibity."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.occupancy_outline import OutlineOptions
from sightfield.systems.numerics.geometry.segment_sight import are_clear
from sightfield.systems.numerics.geometry.visibility_polygon import visibility_polygon
from sightfield.systems.numerics.geometry.world_files import load_world

pytestmark = pytest.mark.benchmarks

PAIRS = 100_000
PEER = Path(__file__).with_name("peers") / "visilibity_peer.py"
# Made by `make peers`.
PEER_PYTHON = Path("build/peers/visilibity/bin/python")


def segments(world, kind, rng):
    """Random pairs of points of the bounding box, or short ones that mostly are clear."""
    low, high = world.bounds[:2], world.bounds[2:]
    a = rng.uniform(low, high, (PAIRS, 2))
    if kind == "random":
        return a, rng.uniform(low, high, (PAIRS, 2))
    index = build_edge_index(world)
    free = a[[point_is_free(index, x, y) for x, y in a]]
    spread = 0.02 * world.size
    return free, free + rng.normal(0.0, spread, free.shape)


def compare(world, kind, time_pair):
    index = build_edge_index(world)
    a, b = segments(world, kind, np.random.default_rng(0))
    polygon = world.polygon
    shapely.prepare(polygon)

    def peer():
        return shapely.covers(polygon, shapely.linestrings(np.stack([a, b], axis=1)))

    clear = are_clear(index, a, b)
    np.testing.assert_array_equal(clear, peer())
    pair = time_pair(lambda: are_clear(index, a, b), peer)
    print(
        f"\nclear segments, {world.vertex_count} edges, {kind} pairs ({clear.mean():.0%} clear): "
        f"{1e9 * pair.ours / len(a):.0f} ns, Shapely {1e9 * pair.peer / len(a):.0f} ns, "
        f"{pair.ratio:.1f} times as fast"
    )


@pytest.mark.parametrize("kind", ["random", "short"])
@pytest.mark.parametrize("edges", [200, 2000])
def test_clear_segments_in_polygon_worlds(edges, kind, polygon_world, time_pair):
    compare(polygon_world(edges), kind, time_pair)


@pytest.mark.parametrize("kind", ["random", "short"])
def test_clear_segments_in_a_map_of_yours(kind, time_pair):
    """Name a ROS map in SIGHTFIELD_MAP; its outlines are kept as fine as its cells."""
    if "SIGHTFIELD_MAP" not in os.environ:
        pytest.skip("name a ROS map: make bench SIGHTFIELD_MAP=.../map.yaml")
    options = OutlineOptions(tolerance=1e-6)
    world = load_world(Path(os.environ["SIGHTFIELD_MAP"]), options=options).world
    compare(world, kind, time_pair)


@pytest.mark.parametrize("edges", [50, 200, 1000])
def test_visibility_polygons(edges, polygon_world, time_pair):
    if not PEER_PYTHON.exists():
        pytest.skip("the peer is not installed: make peers")
    world = polygon_world(edges)
    index = build_edge_index(world)
    points = np.random.default_rng(1).uniform(0, 10, (200, 2))
    points = np.array([p for p in points if point_is_free(index, *p)])[:50]
    job = {
        "rings": [world.boundary.tolist(), *(ring.tolist() for ring in world.obstacles)],
        "points": points.tolist(),
    }
    areas = [shapely.Polygon(visibility_polygon(index, p)).area for p in points]

    def peer():
        done = subprocess.run(
            [PEER_PYTHON, PEER], input=json.dumps(job), capture_output=True, text=True, check=True
        )
        return json.loads(done.stdout)

    answer = peer()
    # VisiLibity works to an accuracy of its own; a view that differs is said, not hidden.
    same = np.isclose(areas, answer["areas"], rtol=1e-3)
    pair = time_pair(lambda: [visibility_polygon(index, p) for p in points], lambda: None)
    ours, theirs = pair.ours / len(points), answer["seconds"] / len(points)
    print(
        f"\nvisibility polygons, {world.vertex_count} edges: {1e6 * ours:.0f} us, "
        f"VisiLibity {1e6 * theirs:.0f} us, {theirs / ours:.1f} times as fast; "
        f"same area for {same.sum()} of {len(same)} points"
    )
