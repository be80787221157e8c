"""What outlines may sweep on the ground, against Shapely both ways."""

import math

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine, CombineOutline, combine_outline
from sightfield.systems.numerics.harvest.turns.borders import (
    StandingCrop,
    border_distance,
    make_borders,
)
from sightfield.systems.numerics.harvest.turns.ground import Ground, make_footprint
from sightfield.systems.numerics.harvest.turns.turn import combine_footprint, path_of_pieces

COMBINE = Combine(header_width=6.5, header_depth=1.6, turning_radius=5.0, length=9.0, width=3.1)
FOOTPRINT = combine_footprint(COMBINE)
POND = [(30, 22), (34, 18), (41, 21), (40, 28), (33, 29)]
NEEDLE = [(58, 30), (58.05, 30), (64, 33)]
FIELD = Field(
    make_world([(0, 0), (90, 3), (84, 52), (40, 40), (5, 50)], [POND, NEEDLE]), margin=1.5
)


def swept(path, outline):
    """What header and body sweep: hulls of outlines 2 cm of way apart."""
    x, y, theta = path.pose_at(path.stations_every(0.02)).T[:, :, None]
    c, s = np.cos(theta), np.sin(theta)
    found = []
    for part in outline:
        ahead, left = part.T
        corners = np.stack([x + c * ahead - s * left, y + s * ahead + c * left], axis=-1)
        pairs = np.concatenate([corners[:-1], corners[1:]], axis=1)
        found.extend(shapely.convex_hull(shapely.multipoints(pairs)))
    return found


def random_pieces(rng):
    bends = rng.choice([-1, 0, 1], 3) / COMBINE.turning_radius
    return bends, rng.uniform(-9, 9, 3)


def moved_aside(outline, left):
    """The outline of a combine whose header and body are not before one another."""
    header, body = (part + np.array([0.0, each]) for part, each in zip(outline, left, strict=True))
    return CombineOutline(header, body)


@pytest.mark.parametrize("left", [(0.0, 0.0), (1.3, -0.4), (-0.8, 0.6)])
def test_a_way_is_admitted_where_its_sweep_is_on_the_ground_and_only_there(left):
    outline = moved_aside(combine_outline(COMBINE), left)
    footprint = make_footprint(outline)
    ground = Ground(FIELD.ground)
    around, within = ground.region.buffer(0.016), ground.region.buffer(-0.001)
    shapely.prepare([around, within])
    rng = np.random.default_rng(1)
    said = []
    while len(said) < 250:
        start = np.array([rng.uniform(0, 90), rng.uniform(0, 52), rng.uniform(-4, 4)])
        if not ground.admits_pose(start.tolist(), footprint):
            continue
        bends, lengths = random_pieces(rng)
        path = path_of_pieces(start, _end(start, bends, lengths), bends, lengths)
        said.append(ground.admits(path, footprint))
        assert said[-1] == ground.admits_pieces(start.tolist(), bends, lengths, footprint)
        if said[-1]:
            assert shapely.covers(around, swept(path, outline)).all()
        else:
            assert not shapely.covers(within, swept(path, outline)).all()
    assert 60 < sum(said) < 190


def _end(start, bends, lengths):
    x, y, theta = start
    for bend, length in zip(bends, lengths, strict=True):
        half = bend * length / 2
        chord = length * np.sinc(half / np.pi)
        x, y = x + chord * np.cos(theta + half), y + chord * np.sin(theta + half)
        theta += 2 * half
    return np.array([x, y, theta])


@pytest.mark.parametrize("across", [-3.2, -1.7, 0.0, 0.3, 2.9])
def test_no_pole_is_too_thin_to_stop_a_header(across):
    pole = shapely.Point(40.0, 30.0 + across).buffer(0.01)
    ground = Ground(shapely.box(0, 0, 90, 60).difference(pole))
    straight = np.zeros(1), np.array([60.0])
    assert not ground.admits_pieces((12, 30, 0.0), *straight, FOOTPRINT)
    assert not ground.admits_pieces((72, 30, 0.0), straight[0], -straight[1], FOOTPRINT)
    beside = (12, 30 + across + math.copysign(3.3, across), 0.0)
    assert ground.admits_pieces(beside, *straight, FOOTPRINT)


def test_a_rear_that_swings_out_is_seen():
    # The header keeps off the border on the left; the rear swings towards it.
    ground = Ground(shapely.box(0, 0, 60, 33.3))
    start = (30.0, 30.0, 0.0)
    assert ground.admits_pieces(start, np.zeros(1), np.array([12.0]), FOOTPRINT)
    assert not ground.admits_pieces(start, np.array([-0.2]), np.array([4.0]), FOOTPRINT)


def test_machines_may_drive_along_borders():
    ground = Ground(shapely.box(0, 0, 60, 20))
    along = np.zeros(1), np.array([45.0])
    assert ground.admits_pieces((12, 3.25, 0.0), *along, FOOTPRINT)
    assert not ground.admits_pieces((12, 3.22, 0.0), *along, FOOTPRINT)


def test_distances_are_those_to_the_border_within_their_stated_error():
    ground = Ground(FIELD.ground)
    rng = np.random.default_rng(2)
    points = rng.uniform([-1, -1], [91, 53], (1500, 2))
    inside = shapely.contains_xy(ground.region, points)
    away = shapely.distance(ground.region.boundary, shapely.points(points))
    expected = np.clip(np.where(inside, away, -away), -12, 12)
    told = np.array([border_distance(ground.borders, x, y) for x, y in points])
    assert np.abs(told - expected).max() < 0.36
    assert np.abs(told - expected).mean() < 0.03
    assert border_distance(ground.borders, -50.0, 0.0) == -12
    borders = make_borders(shapely.box(3, 4, 80, 70))
    assert border_distance(borders, 30.3, 9.1) == pytest.approx(5.1, abs=1e-5)


def test_a_river_cuts_the_ground_of_a_field_in_two():
    # An obstacle from border to border of the margin leaves two parts.
    field = Field(make_world([(0, 0), (60, 0), (60, 40), (0, 40)], [[(28, 1), (32, 1), (30, 39)]]))
    ground = Ground(field.ground.difference(shapely.box(28, -20, 32, 60)))
    assert len(ground.region.geoms) == 2
    with pytest.raises(InvalidInput, match="ground"):
        Ground(field.ground.intersection(shapely.box(200, 200, 210, 210)))


def test_standing_crop_is_marked_as_it_is_cut():
    crop = StandingCrop(FIELD.polygon)
    assert crop.area == pytest.approx(FIELD.area, rel=5e-3)
    piece = shapely.LineString([(10, 6), (75, 14)]).buffer(3.25, cap_style="flat")
    before = crop.copy()
    crop.mark(piece, stands=False)
    assert before.area - crop.area == pytest.approx(
        piece.intersection(FIELD.polygon).area, rel=2e-2
    )
    again = crop.area
    crop.mark(shapely.MultiPolygon([piece]), stands=False)
    assert crop.area == again
    crop.mark(piece.intersection(FIELD.polygon), stands=True)
    assert (crop.cells == before.cells).all()
    crop.mark(piece, stands=False)
    ground = Ground(FIELD.ground)
    slope = math.atan2(8, 65)
    along = np.zeros(1), np.array([20.0])
    start = 10 + 22 * math.cos(slope), 6 + 22 * math.sin(slope), slope
    assert not ground.admits_pieces(start, *along, FOOTPRINT, before)
    assert ground.admits_pieces(start, *along, FOOTPRINT, crop)
    assert ground.admits_pieces(start, *along, FOOTPRINT)
    aside = start[0] + 2.4 * math.sin(slope), start[1] - 2.4 * math.cos(slope), slope
    assert ground.admits_pieces(aside, *along, FOOTPRINT)
    assert not ground.admits_pieces(aside, *along, FOOTPRINT, crop)
