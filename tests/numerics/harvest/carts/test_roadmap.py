"""Nodes and edges of a roadmap, against outlines of Shapely."""

from dataclasses import replace

import numpy as np
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.carts.cart_motion import CartMotion, trailer_angles
from sightfield.systems.numerics.harvest.carts.cut_times import cut_times, free_cells, opened
from sightfield.systems.numerics.harvest.carts.roadmap import (
    AFTER_CUT,
    BENT,
    BENT_AT_END,
    Edges,
    Roadmap,
    earliest_arrivals,
    make_roadmap,
    opens_to,
)
from sightfield.systems.numerics.harvest.carts.surroundings import field_lines
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Cart, Combine, cart_outline
from sightfield.systems.numerics.harvest.paths import MachinePath, TimedPath

POND = [(60.0, 50.0), (85.0, 55.0), (80.0, 75.0), (62.0, 70.0)]
FIELD = Field(make_world([(0, 0), (150, 10), (140, 120), (5, 110)], [POND]), 12.0)
CART = Cart(hitch_offset=0.5)


def lonely(path):
    at = path.stations_every(0.5)
    return TimedPath(path, np.arange(len(at)) * 1.0, at, np.zeros(len(at)))


def roadmap_of(cart):
    """On the field, whose right half is cut at 100 s and whose left at 700 s."""
    cut = cut_times(FIELD, Combine(), [])
    # The margin bears no crop.
    columns = np.arange(cut.times.shape[1])
    halves = np.where(columns * 0.5 + cut.corner[0] > 75.0, 100.0, 700.0)
    cut = cut._replace(times=np.where(cut.times == np.inf, halves, cut.times))
    ground = opened(free_cells(FIELD, cut), cut)
    swaths = [np.array([[x, 20.0], [x, 105.0]]) for x in np.arange(15.0, 140.0, 9.0)]
    return make_roadmap(ground, cart, field_lines(FIELD, Combine(), swaths))


def test_a_long_trailer_comes_into_line_on_each_edge():
    cart = replace(CART, length=9.0)
    edges = roadmap_of(cart).edges
    assert len(edges.source) > 2000
    ends = []
    for poses, lengths in zip(edges.poses[::5], edges.lengths[::5], strict=True):
        kept = np.concatenate([[True], lengths > 1e-9])
        path = MachinePath.of(poses[kept])
        bent = np.abs(trailer_angles(path, cart, 0.0, path.stations_every(0.5)))
        assert bent.max() <= BENT
        ends.append(bent[-1])
    # Some hardly do.
    assert 0.9 * BENT_AT_END < max(ends) <= BENT_AT_END == 0.35


def test_edges_keep_off_the_pond_and_on_the_ground(outlines_at, integrated):
    roadmap = roadmap_of(CART)
    edges = roadmap.edges
    assert 200 < len(roadmap.nodes) < 4000
    assert len(edges.source) > 3 * len(roadmap.nodes)
    tractor, trailer = (np.array(part)[None] for part in cart_outline(CART))
    left = shapely.box(-99, -99, 75.0, 299).intersection(FIELD.polygon)
    free = FIELD.ground
    rng = np.random.default_rng(5)
    late = 0
    for e in rng.choice(len(edges.source), 150, replace=False):
        kept = np.concatenate([[True], edges.lengths[e] > 1e-9])
        poses = edges.poses[e][kept]
        count = len(poses) - 1
        path = MachinePath(poses, np.ones(count), np.zeros(count, bool), np.zeros(count, int))
        assert np.abs(path.curvatures).max() <= 1 / CART.turning_radius
        off = poses[[0, -1]] - roadmap.nodes[[edges.source[e], edges.target[e]]]
        off[:, 2] = np.remainder(off[:, 2] + np.pi, 2 * np.pi) - np.pi
        assert np.abs(off).max() < 1e-6
        timed = lonely(path)
        hulls = [
            *outlines_at(tractor, timed.pose_at(timed.times))[:, 0],
            *outlines_at(trailer, integrated(CartMotion(timed, CART), timed.times))[:, 0],
        ]
        under = shapely.union_all(hulls)
        assert under.difference(free).area < 1e-9
        assert under.distance(FIELD.obstacles[0]) > 0.4
        # What it has to wait for is what lies under it.
        if under.intersection(left).area > 0.5:
            assert edges.opens[e] == 700.0 + AFTER_CUT
            late += 1
        else:
            assert edges.opens[e] < 700.0 or under.distance(left) < 0.6
    assert 20 < late < 130


def random_roadmap(rng, nodes=30, edges=90):
    """One that has no places: only who leads where, how long that takes, and from when on."""
    none = np.zeros(0)
    table = dict.fromkeys(Edges._fields, none) | {
        "source": rng.integers(0, nodes, edges),
        "target": rng.integers(0, nodes, edges),
        "duration": rng.uniform(3.0, 40.0, edges),
        "opens": np.where(rng.random(edges) < 0.5, -np.inf, rng.uniform(0.0, 300.0, edges)),
    }
    return Roadmap(np.zeros((nodes, 3)), np.full(nodes, -np.inf), Edges(**table), 0.0)


def test_arrivals_wait_for_ground_that_opens():
    rng = np.random.default_rng(8)
    for _ in range(20):
        roadmap = random_roadmap(rng)
        edges, begin = roadmap.edges, 70.0
        # By relaxing all edges as often as there are nodes.
        known = np.full(30, np.inf)
        known[4] = begin
        for _ in range(30):
            there = np.maximum(known[edges.source], edges.opens) + edges.duration
            np.minimum.at(known, edges.target, there)
        assert np.allclose(earliest_arrivals(roadmap, 4, begin), known)


def test_a_way_opens_with_the_last_of_its_edges():
    rng = np.random.default_rng(3)
    for _ in range(20):
        roadmap = random_roadmap(rng)
        edges = roadmap.edges
        closed = rng.random(len(edges.opens)) < 0.2
        found = opens_to(roadmap, np.array([5, 17]), closed)
        for time in (-np.inf, 40.0, 150.0, 400.0):
            inside = np.zeros(30, dtype=bool)
            inside[[5, 17]] = True
            usable = (edges.opens <= time) & np.logical_not(closed)
            for _ in range(30):
                inside[edges.source[usable & inside[edges.target]]] = True
            assert (inside == (found <= time)).all()
