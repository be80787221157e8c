"""The ground that machines cover, against their outlines at many poses."""

import itertools

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.machines import Cart, cart_outline
from sightfield.systems.numerics.harvest.paths import MachinePath
from sightfield.systems.numerics.harvest.timing.sweep import (
    cart_sweep,
    grid_stations,
    outline_ways,
    sweep_of,
    towed_poses,
)

CART = Cart(length=6.0, hitch_offset=0.9, width=2.7, turning_radius=5.5)


def cart_way(drive, moves, bend):
    """A tractor's path and the poses of its trailer, by small steps of the hitch's kinematics."""
    path = drive((3.0, -2.0, 0.4), *moves)
    fine = path.pose_at(np.linspace(0, path.length, 200 * len(path.poses) + 1))
    heading = fine[0, 2] - bend
    hitch = fine[:, :2] - CART.hitch_offset * np.column_stack(
        [np.cos(fine[:, 2]), np.sin(fine[:, 2])]
    )
    headings = [heading]
    for step in np.diff(hitch, axis=0):
        heading += (-np.sin(heading) * step[0] + np.cos(heading) * step[1]) / CART.length
        headings.append(heading)
    headings = np.array(headings)
    axle = hitch - CART.length * np.column_stack([np.cos(headings), np.sin(headings)])
    trailer = np.column_stack([axle, headings])
    stations = np.linspace(0, path.length, len(fine))
    told = np.unique(np.concatenate([path.stations, path.stations_every(0.4)]))
    gears = path.gears[path.piece_at((told[:-1] + told[1:]) / 2)]
    poses = path.pose_at(told)
    at = np.column_stack([np.interp(told, stations, column) for column in trailer.T])
    count = len(poses) - 1
    whole = MachinePath(poses, gears, np.zeros(count, dtype=bool), np.zeros(count, dtype=int))
    return whole, at, stations, trailer


def beyond(cover, shapes):
    """How far shapes reach beyond what is told to be covered [m]."""
    corners = shapely.points(shapely.get_coordinates(shapely.GeometryCollection(list(shapes))))
    return shapely.distance(cover, corners).max()


def test_all_that_a_combine_covers_lies_within_the_margins_of_its_cells(fleets):
    rng = np.random.default_rng(5)
    for kind in fleets.kinds:
        for path in kind(rng, 2):
            sweep = fleets.journey(path).sweep
            largest = 0.0
            for cell in rng.integers(0, sweep.cells, 30):
                at = np.linspace(*sweep.stations[cell : cell + 2], 21)
                shapes = fleets.outlines_at(path, fleets.outline, at).ravel()
                largest = max(
                    largest, beyond(fleets.cover_of(sweep, cell), shapes) - sweep.margins[cell]
                )
            assert largest < 1e-9
            assert sweep.margins.max() < 0.02


def test_a_cell_covers_hardly_more_than_the_machine_does(fleets):
    path = fleets.drive((1.0, 2.0, 0.3), (10.0, 0.1), (-6.0, 0.12), (9.0, 0.0))
    sweep = sweep_of(path, fleets.outline, grid_stations(path))
    for cell in range(sweep.cells):
        at = np.linspace(*sweep.stations[cell : cell + 2], 41)
        for part, points in enumerate(fleets.polygons_of(sweep, cell)):
            covered = shapely.union_all(fleets.outlines_at(path, fleets.outline, at)[part])
            assert shapely.Polygon(points).area < covered.area * 1.04 + 0.02


def test_tractor_and_trailer_lie_within_the_margins_of_their_cells(fleets):
    moves = ((25.0, 0.0), (14.0, 0.16), (12.0, -0.17), (-5.0, 0.0), (16.0, 0.1))
    path, trailer, stations, true = cart_way(fleets.drive, moves, bend=0.5)
    outline = cart_outline(CART)
    sweep = cart_sweep(path, trailer, outline, grid_stations(path, 1.2))
    own = MachinePath(true, *[np.zeros(len(true) - 1, dtype=int)] * 3)
    for cell in range(sweep.cells):
        low, high = sweep.stations[cell : cell + 2]
        at = np.linspace(low, high, 15)
        tractor = fleets.outlines_at(path, [outline.tractor], at).ravel()
        number = np.flatnonzero((stations >= low) & (stations <= high))
        box = fleets.outlines_at(own, [outline.trailer], own.stations[number]).ravel()
        assert beyond(fleets.cover_of(sweep, cell), tractor) <= sweep.margins[cell] + 1e-9
        # Between dense poses the trailer's true way differs from a twist by millimetres.
        assert beyond(fleets.cover_of(sweep, cell), box) <= sweep.margins[cell] + 5e-3


def test_the_trailer_meets_its_poses_and_turns_evenly_between_them():
    path = MachinePath(
        np.array([[0.0, 0, 0.3], [1.0, 0.2, 0.3], [1.9, 0.9, 0.9]]), *[np.ones(2, dtype=int)] * 3
    )
    poses = np.array([[-5.0, 0.1, 0.2], [-4.1, 0.4, 0.5], [-3.2, 1.0, 0.4]])
    assert towed_poses(path, poses, path.stations) == pytest.approx(poses)
    middle = (path.stations[0] + path.stations[1]) / 2
    half = towed_poses(path, poses, middle)
    assert half[2] == pytest.approx(0.35)
    # Half of an arc is as far from both ends.
    ends = np.hypot(*(poses[:2, :2] - half[:2]).T)
    assert ends[0] == pytest.approx(ends[1])


def test_a_grid_has_both_ends_twice_and_cusps_and_stops_once(fleets):
    path = fleets.drive((1.0, 2.0, 0.3), (10.3, 0.1), (-6.1, 0.12), (9.0, 0.0))
    stations = grid_stations(path, 1.0, stops=[7.77, 12.0])
    assert stations[:2] == pytest.approx([0, 0])
    assert stations[-2:] == pytest.approx([path.length] * 2)
    assert (np.diff(stations[1:-1]) > 0).all()
    assert np.diff(stations).max() <= 1.0 + 1e-9
    for wanted in [*path.cusps, 7.77, 12.0]:
        assert np.abs(stations - wanted).min() < 1e-9
    with pytest.raises(InvalidInput, match="stops"):
        grid_stations(path, 1.0, stops=[99.0])


def test_no_point_of_a_machine_goes_farther_than_told_on_a_cell_even_in_turns(fleets):
    path = fleets.drive((1.0, 2.0, 0.3), (30.3, 0.0), (12.0, 0.15), (-9.1, -0.16), (9.0, 0.0))
    most = 0.2

    def farthest(stations):
        far = 0.0
        for begin, end in itertools.pairwise(stations):
            at = np.linspace(begin, end, 9)
            for shapes in fleets.outlines_at(path, fleets.outline, at):
                corners = np.array([shapely.get_coordinates(shape) for shape in shapes])
                steps = np.hypot(*np.moveaxis(np.diff(corners, axis=0), -1, 0))
                far = max(far, steps.sum(axis=0).max())
        return far

    by_outline = grid_stations(path, most, moved=outline_ways(path.poses, fleets.outline))
    assert 0.9 * most < farthest(by_outline) <= most + 1e-6
    # The reference point alone does not tell.
    assert farthest(grid_stations(path, most)) > 1.5 * most
    # On straights cells are as long as told.
    assert np.diff(by_outline).max() == pytest.approx(most, rel=0.02)


def test_a_machine_without_a_way_has_one_cell(fleets):
    none = np.zeros(0, dtype=int)
    path = MachinePath(np.array([[4.0, 5.0, 0.6]]), none, none, none)
    sweep = sweep_of(path, fleets.outline, grid_stations(path))
    assert sweep.cells == 1
    shapes = fleets.outlines_at(path, fleets.outline, np.zeros(1)).ravel()
    for points, shape in zip(fleets.polygons_of(sweep, 0), shapes, strict=True):
        assert shapely.Polygon(points).symmetric_difference(shape).area < 1e-9


def test_a_trailer_needs_a_pose_for_each_of_the_path(fleets):
    path = fleets.drive((1.0, 2.0, 0.3), (10.3, 0.1))
    with pytest.raises(InvalidInput, match="trailer_poses"):
        cart_sweep(path, np.zeros((2, 3)), cart_outline(CART), grid_stations(path))
