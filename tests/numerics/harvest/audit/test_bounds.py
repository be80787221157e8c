"""Where the checks of an audit begin: exactly at their limits nothing is wrong yet."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.crop import edges_of, ground_of
from sightfield.systems.numerics.harvest.audit.harvest_log import (
    FAR,
    Part,
    Site,
    SiteYields,
    faults_where,
    read_harvest,
    site_of,
    spells,
)
from sightfield.systems.numerics.harvest.audit.motion import (
    moving_outline,
    polygons_at,
    poses_between,
)
from sightfield.systems.numerics.harvest.audit.nearness import (
    TOLERANCE,
    nearness,
    nearness_to_edges,
)

TIME = np.array([0.0, 0.5, 1.0, 1.75, 3.5, 4.0, 6.0, 7.0])


@pytest.mark.parametrize(
    ("wrong", "runs"),
    [
        ([], []),
        ([0], [(0, 1)]),
        ([6], [(6, 7)]),
        ([2, 3], [(2, 4)]),
        # From 1.75 s to 3.5 s is less than two seconds, from 4 s to 6 s just as much.
        ([2, 4], [(2, 5)]),
        ([4, 6], [(4, 5), (6, 7)]),
        ([0, 1, 2, 4, 6], [(0, 5), (6, 7)]),
        ([0, 6], [(0, 1), (6, 7)]),
    ],
)
def test_spells_less_than_two_seconds_apart_are_one(wrong, runs):
    flags = np.zeros(len(TIME) - 1, dtype=bool)
    flags[wrong] = True
    assert list(spells(flags, TIME)) == runs


def test_a_fault_is_worst_where_it_is_farthest_beyond_its_limit():
    amounts = np.array([1.0, 2.0, 5.5, 7.0, 0.0, 3.0, 9.0])
    limits = np.array([1.0, 1.0, 1.0, 6.5, 0.0, 3.0, 2.0])
    first, last = faults_where("much", ("it",), amounts, limits, "kg", TIME)
    assert first == ("much", ("it",), 0.5, 3.5, 1.0, 5.5, 1.0, "kg")
    assert last == ("much", ("it",), 6.0, 7.0, 6.0, 9.0, 2.0, "kg")
    late = faults_where("much", (), amounts, limits, "kg", TIME, at_end=True)
    assert [fault.time for fault in late] == [1.75, 7.0]


def test_yields_of_a_site_are_those_of_the_nearest_cell():
    values = np.arange(6.0).reshape(2, 3) + 0.5
    yields = SiteYields(np.array([10.0, -4.0]), 5.0, values)
    places = np.array([[9.0, -9.0], [14.9, 0.9], [15.1, 1.1], [25.1, 3.0], [99.0, -99.0], [0, 99]])
    assert yields.at(places).tolist() == [0.5, 0.5, 4.5, 5.5, 2.5, 3.5]


SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]


def about(**more):
    machine = {"header": SQUARE, "body": SQUARE}
    return {"combines": [machine], "carts": [], "parts": [{"boundary": SQUARE}], "margin": 0.0} | (
        more
    )


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"yields": 3}, "`yields` must be an object"),
        ({"yields": {"corner": [0, 0, 1], "side": 1, "values": [[1]]}}, "`yields.corner`"),
        ({"yields": {"corner": [0, 0], "side": 0, "values": [[1]]}}, "`yields.side`"),
        ({"yields": {"corner": [0, 0], "side": 1, "values": [[-1]]}}, "`yields.values`"),
        ({"yields": {"corner": [0, 0], "side": 1, "values": [[]]}}, "`yields.values`"),
        ({"yields": {"corner": [0, 0], "side": 1, "values": [1]}}, "`yields.values`"),
        ({"yields": {"corner": [0, 0], "side": 1, "values": [[1], [1, 2]]}}, "`yields.values`"),
        ({"density": -0.1}, "`density`"),
        ({"combines": []}, "`combines`"),
        ({"parts": [{"boundary": [[0, 0], [1, 0], [1, 0], [0, 0]]}]}, "three corners; got 2"),
        ({"parts": [{"boundary": [[0, 0], [FAR, 0], [1, 1]]}]}, "`parts.0..boundary`"),
        ({"parts": [{"boundary": [[0, 0], [2e-5, 0], [0, 5e-5]]}]}, "`parts.0..boundary`"),
        ({"parts": [{"boundary": SQUARE, "no_go": 1}]}, "`parts.0..no_go`"),
        ({"parts": [{"boundary": SQUARE, "no_go": ["x" * 70]}]}, r"got '" + "x" * 56 + r"\.\.\.$"),
    ],
)
def test_sites_that_cannot_be_are_refused_with_what_is_wrong(change, said):
    with pytest.raises(InvalidInput, match=said):
        site_of(about(**change))


def test_what_a_site_may_just_be_is_taken():
    assert site_of(about()).yields is None
    no_crop = {"corner": [0, 0], "side": 1e-9, "values": [[0, 2]]}
    assert site_of(about(yields=no_crop)).yields.values.tolist() == [[0.0, 2.0]]
    assert site_of(about(combines=[], carts=[{"tractor": SQUARE, "trailer": SQUARE}])).margin == 0.0
    edge = [[0, 0], [FAR - 1, 0], [1, 1]]
    assert site_of(about(parts=[{"boundary": edge}])).parts[0].boundary.area > 1e5
    tiny = [[0, 0], [5e-5, 0], [0, 5e-5]]
    assert site_of(about(parts=[{"boundary": tiny}])).parts[0].boundary.area > 1e-9
    # Up to a millionth of the field a hole may stick out.
    hole = [[0.5, 0.5], [1 + 0.9e-6, 0.5], [1 + 0.9e-6, 1], [0.5, 1]]
    assert site_of(about(parts=[{"boundary": SQUARE, "holes": [hole]}])).parts[0].holes
    hole = [[0.5, 0.5], [1 + 2.2e-6, 0.5], [1 + 2.2e-6, 1], [0.5, 1]]
    with pytest.raises(InvalidInput, match="holes"):
        site_of(about(parts=[{"boundary": SQUARE, "holes": [hole]}]))
    clockwise = site_of(about(combines=[{"header": SQUARE[::-1], "body": SQUARE}]))
    assert shapely.LinearRing(clockwise.combines[0].front).is_ccw


@pytest.mark.parametrize(
    ("name", "place", "value", "fits"),
    [
        ("tractor_pose", (3, 0, 0), FAR - 1, True),
        ("tractor_pose", (3, 0, 0), -FAR, False),
        ("combine_pose", (0, 0, 1), FAR, False),
        ("trailer_pose", (9, 0, 1), -FAR + 1, True),
        ("cutting", (4, 0), 0.5, False),
        ("cutting", (4, 0), 1.0, True),
        ("time", 0, 0.25, False),
        ("time", 0, 0.2499, True),
    ],
)
def test_logs_are_taken_up_to_their_limits(by_hand, tmp_path, name, place, value, fits):
    by_hand.log[name][place] = value
    folder = by_hand.write(tmp_path)
    if fits:
        assert getattr(read_harvest(folder)[0], name)[place] == value
    else:
        with pytest.raises(InvalidInput, match=f"`{name}`"):
            read_harvest(folder)


def test_two_samples_are_a_log(by_hand, tmp_path):
    by_hand.log = {name: each[:2] for name, each in by_hand.log.items()}
    assert len(read_harvest(by_hand.write(tmp_path))[0].time) == 2


def turned_box(rng, convex=True):
    """The corners of a box or of an arrow, off their pose."""
    x, y = rng.uniform(0.4, 5.0, 2)
    ring = [[-x, -y], [x, -y], [x, y], [-x, y]]
    if not convex:
        ring = [[-x, -y], [x, -y], [0.3 * x, 0.1 * y], [x, y], [-x, y]]
    return np.array(ring) + rng.uniform(-3, 3, 2)


def walk(rng, samples, quick, spread):
    """Poses of a machine that moves and turns anyhow."""
    steps = rng.normal(size=(samples, 3)) * quick
    steps[:: rng.integers(3, 7)] = 0.0
    start = rng.uniform(-spread, spread, 2)
    return np.cumsum(steps, axis=0) + np.array([*start, rng.uniform(-9, 9)])


SHARES = np.linspace(0, 1, 61)


def everywhere(outline):
    """Polygons of an outline at many instants of each interval, (T - 1, 61)."""
    count = len(outline.poses) - 1
    number = np.repeat(np.arange(count), len(SHARES))
    return polygons_at(outline, number, np.tile(SHARES, count)).reshape(count, -1)


@pytest.mark.parametrize("seed", range(12))
def test_no_instant_of_a_whole_walk_is_nearer_than_what_is_found(seed):
    rng = np.random.default_rng([6, seed])
    asked = [0.8, 3.0, 30.0][seed % 3]
    quick = np.array([1.5, 1.5, [0.0, 0.1, 0.8, 2.0][seed % 4]])
    one, other = (
        moving_outline("it", turned_box(rng, seed % 2 == 0), walk(rng, 24, quick * size, 4.0))
        for size in (1.0, [0.0, 0.4, 1.0][seed // 4])
    )
    found = nearness(one, other, asked)
    brute = shapely.distance(everywhere(one), everywhere(other)).min(axis=1)
    number = np.arange(len(brute))
    near = brute < asked
    assert (found.least[near] <= brute[near] + TOLERANCE + 1e-9).all()
    seen = np.isfinite(found.least)
    there = shapely.distance(*(polygons_at(o, number, found.share) for o in (one, other)))
    assert found.least[seen] == pytest.approx(there[seen], abs=1e-9)
    assert found.nearest <= brute.min() + TOLERANCE + 1e-9
    # Where only the nearest of all times is asked for, it is found as well.
    assert nearness(one, other, 0.0).nearest == pytest.approx(found.nearest, abs=TOLERANCE + 1e-9)
    least = nearness(one, other, 0.0, best=0.5 * brute.min())
    assert least.nearest == 0.5 * brute.min()


POND = shapely.Polygon(
    [(0, 0), (8, 0), (8, 6), (5, 6), (4, 2), (3, 6), (0, 6)],
    [[(1, 1), (1, 3), (2.5, 3), (2.5, 1)]],
)
GROUND = shapely.Polygon([(-12, -12), (12, -12), (12, 12), (2, 12), (0, 9), (-2, 12), (-12, 12)])


@pytest.mark.parametrize("seed", range(9))
@pytest.mark.parametrize("inside", [True, False])
def test_no_instant_of_a_walk_is_nearer_to_forbidden_ground_than_what_is_found(seed, inside):
    rng = np.random.default_rng([7, seed])
    quick = np.array([0.7, 0.7, [0.0, 0.3, 1.1][seed % 3]])
    walked = walk(rng, 24, quick, [3.0, 12.0, 20.0][seed // 3])
    one = moving_outline("it", 0.4 * turned_box(rng, seed % 2 == 0), walked)
    region, asked = (POND, 2.5) if inside else (GROUND, 1.5)
    found = nearness_to_edges(one, edges_of(region), inside=inside, asked=asked)
    polygons = everywhere(one)
    if inside:
        brute = shapely.distance(polygons, region).min(axis=1)
    else:
        out = ~shapely.contains_properly(region, polygons)
        brute = np.where(out, 0.0, shapely.distance(polygons, region.exterior)).min(axis=1)
    near = brute < asked
    assert (found.least[near] <= brute[near] + TOLERANCE + 1e-9).all()
    assert found.nearest <= max(brute.min(), 0.0) + TOLERANCE + 1e-9
    # What is found occurs; farther than asked for, some edges are not looked at.
    seen = np.flatnonzero((found.least < asked) & (found.least > 0))
    there = polygons_at(one, seen, found.share[seen])
    edge = region if inside else region.exterior
    assert found.least[seen] == pytest.approx(shapely.distance(there, edge), abs=1e-9)
    zero = np.flatnonzero(found.least == 0.0)
    at = polygons_at(one, zero, found.share[zero])
    off = shapely.distance(at, region) if inside else shapely.distance(at, region.exterior)
    outside = np.zeros(len(zero), bool) if inside else ~shapely.contains_properly(region, at)
    assert ((off <= 1e-9) | outside).all()
    assert (found.least[brute > 1.0] > 0.0).all()


def test_half_a_turn_is_made_along_half_a_circle():
    poses = np.array([[1.0, 2.0, 0.3], [1.0 + 4.0, 2.0, 0.3 + math.pi]])
    found = poses_between(poses, np.zeros(3, dtype=int), np.array([0.0, 0.5, 1.0]))
    middle = np.array([3.0, 2.0])
    assert np.hypot(*(found[:, :2] - middle).T) == pytest.approx([2.0, 2.0, 2.0])
    assert found[1] == pytest.approx([3.0, 0.0, 0.3 + math.pi / 2])


def test_ground_has_no_obstacle_where_another_part_grows_and_none_vanishes():
    outer, hole = shapely.box(0, 0, 40, 30), shapely.box(10, 10, 20, 20)
    island = shapely.box(12, 12, 14, 15)
    pole = shapely.box(30.0, 5.0, 30.015, 5.015)
    ditch = shapely.box(-3, 0, -1, 9)
    parts = (Part(outer, (hole, pole), (ditch,)), Part(island, ()))
    ground = ground_of(Site((), (), parts, 2.5))
    assert ground.crop.area == pytest.approx(1200 - 100 - 0.015**2 + 6)
    assert ground.obstacles.area == pytest.approx(100 - 6 + 0.015**2 + 18)
    assert ground.allowed.area == pytest.approx(1200 + 140 * 2.5 + math.pi * 2.5**2, abs=0.01)
    # Shrunk by a centimetre all round, but for the pole, which would vanish.
    shrunk = 9.98**2 - 2.02 * 3.02 + 1.98 * 8.98 + 0.015**2
    assert ground.core.area == pytest.approx(shrunk, abs=1e-6)
    assert ground.touched.bounds == pytest.approx((-2.51, -2.51, 42.51, 32.51), abs=1e-4)
    assert len(edges_of(ground.crop)) == 4 * 4
    assert edges_of(shapely.Polygon()).shape == (0, 4)
