"""Robots keep off one another and off walls: closed forms, safe steps, and no special frame."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.random_arena import Arena, draw_arena
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.collision_avoidance import YIELDING_TIME, avoid
from sightfield.systems.numerics.tracking.collision_stop import NEAR, still_waiting, take_turns

OPEN = [make_world([[-20, -20], [20, -20], [20, 20], [-20, 20]])]
TOP_SPEED, PERIOD = 0.3, 0.05


def flat(values):
    return np.ravel(np.array(values, dtype=float))


def avoided(
    regions,
    positions,
    velocities,
    radii,
    others=(),
    other_radii=(),
    period=PERIOD,
    turns=None,
    first=None,
    rank=0,
):
    return avoid(
        *build_edge_index(*regions),
        flat(positions),
        flat(velocities),
        flat(radii),
        flat(others),
        flat(other_radii),
        np.zeros(len(radii)) if turns is None else flat(turns),
        np.zeros(len(radii), dtype=bool) if first is None else np.array(first, dtype=bool),
        rank,
        NEAR * TOP_SPEED * period,
        YIELDING_TIME * TOP_SPEED,
        TOP_SPEED,
        period,
    ).reshape(-1, 2)


def free_spots(rng, regions, count, low=None, high=None):
    """Random points where centres may be, in a box if one is given."""
    free = shapely.union_all([region.polygon for region in regions])
    low, high = (free.bounds[:2], free.bounds[2:]) if low is None else (low, high)
    points = rng.uniform(low, high, (400, 2))
    return points[shapely.contains_properly(free, shapely.points(points))][:count]


class TestVelocities:
    def test_a_robot_alone_keeps_its_velocity(self):
        wished = [[0.12, -0.2]]
        assert avoided(OPEN, [[1, 2]], wished, [0.2]) == pytest.approx(np.array(wished), abs=1e-12)

    def test_robots_far_apart_keep_their_velocities(self):
        wished = np.array([[0.3, 0.0], [-0.3, 0.0]])
        kept = avoided(OPEN, [[0, 0], [9, 0]], wished, [0.2, 0.2], [[-9, 0]], [0.2])
        assert kept == pytest.approx(wished, abs=1e-12)

    def test_robots_without_bodies_pass_through_one_another(self):
        wished = np.array([[0.3, 0.0], [-0.3, 0.0]])
        assert avoided(OPEN, [[0, 0], [0.01, 0]], wished, [0, 0], [[0.005, 0]], [0]) == (
            pytest.approx(wished, abs=1e-12)
        )

    @pytest.mark.parametrize("left", [True, False])
    @pytest.mark.parametrize("teammate", [True, False])
    def test_a_robot_turns_aside_to_the_nearer_side_and_keeps_most_of_its_speed(
        self, left, teammate
    ):
        # The other stands ahead, a little to one side: the way past it on the other is shorter.
        other = [0.4, 0.03 if left else -0.03]
        if teammate:
            velocities = avoided(OPEN, [[0, 0], other], [[0.3, 0], [0, 0]], [0.12, 0.12])
        else:
            velocities = avoided(OPEN, [[0, 0]], [[0.3, 0]], [0.12], [other], [0.12])
        vx, vy = velocities[0]
        assert vx > 0.0
        assert (vy < 0.0) == left
        assert abs(vy) > 0.05
        assert math.hypot(vx, vy) > 0.8 * TOP_SPEED

    def test_nobody_turns_for_one_that_is_not_in_the_way(self):
        wished = [[0.3, 0.0]]
        beside = avoided(OPEN, [[0, 0]], wished, [0.12], [[0.3, 0.25]], [0.12])
        assert beside == pytest.approx(np.array(wished), abs=1e-12)

    def test_a_robot_turns_to_the_side_without_a_wall(self):
        # The nearer side past the other is the left, along which a wall runs.
        world = make_world([[-5, -5], [5, -5], [5, 0.15], [-5, 0.15]])
        other = [0.4, -0.03]
        vx, vy = avoided(shrink_world(world, 0.12), [[0, 0]], [[0.3, 0]], [0.12], [other], [0.12])[
            0
        ]
        assert vy < -0.05
        assert vx > 0.0

    @pytest.mark.parametrize("axis", [0, 1])
    def test_a_standing_teammate_is_pushed_aside_by_one_that_wants_to_pass(self, axis):
        # A lane in which there is no way round.
        lane = np.array([[-2, -0.15], [2, -0.15], [2, 0.15], [-2, 0.15]])
        positions = np.array([[0.0, 0.0], [0.26, 0.0]])
        wished = np.array([[0.3, 0.0], [0.0, 0.0]])
        if axis == 1:
            lane, positions, wished = lane[:, ::-1], positions[:, ::-1], wished[:, ::-1]
        velocities = avoided(shrink_world(make_world(lane), 0.12), positions, wished, [0.12, 0.12])
        assert velocities[1, axis] > 0.1 * TOP_SPEED
        assert velocities[0, axis] > 0.1 * TOP_SPEED

    def test_a_standing_stranger_is_not_pushed_but_stops_one_that_comes(self):
        lane = make_world([[-2, -0.15], [2, -0.15], [2, 0.15], [-2, 0.15]])
        regions, at = shrink_world(lane, 0.12), np.array([[0.0, 0.0]])
        for _ in range(200):
            at += PERIOD * avoided(regions, at, [[0.3, 0.0]], [0.12], [[1.0, 0.0]], [0.12])
        # It keeps a little room to turn.
        assert 0.24 < math.dist(at[0], [1.0, 0.0]) < 1.1 * 0.24

    def test_a_step_at_robots_is_also_clear_of_walls(self):
        # Both are driven into the wall; they slide along it and share the gap between them.
        world = make_world([[-2, 0], [2, 0], [2, 2], [-2, 2]])
        positions = np.array([[-0.2, 0.121], [0.2, 0.121]])
        wished = np.array([[0.2, -0.2], [-0.2, -0.2]])
        after = positions + avoided(shrink_world(world, 0.12), positions, wished, [0.12, 0.12])
        assert (after[:, 1] >= 0.12).all()


@lru_cache
def regions_of(seed, obstacles, radius):
    """Where robots of a radius may be in a random world."""
    return shrink_world(draw_arena(Arena(obstacles=obstacles, gap=0.2), seed), radius)


class Crowd(NamedTuple):
    """Robots of two teams, the first `size` of them of one, in some world."""

    regions: tuple
    spots: np.ndarray
    wished: np.ndarray
    radii: np.ndarray
    turns: np.ndarray
    size: int


@st.composite
def crowds(draw):
    """Two teams of robots, of any size, wishing anything, in a small part of some world."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    radius = draw(st.sampled_from([0.0, 0.05, 0.16]))
    regions = regions_of(draw(st.integers(0, 3)), draw(st.sampled_from([0, 3, 6])), radius)
    sizes = draw(st.integers(1, 5)), draw(st.integers(0, 3))
    low = rng.uniform(0, 3, 2)
    spots = free_spots(rng, regions, sum(sizes), low, low + draw(st.sampled_from([0.5, 1.5, 3.0])))
    assume(len(spots) == sum(sizes))
    radii = rng.uniform(0, 1, sum(sizes)) * draw(st.sampled_from([radius, 0.1, 0.3]))
    speed = TOP_SPEED * draw(st.sampled_from([0.3, 1.0, 5.0]))
    turns = np.maximum(rng.uniform(-2.0, 1.0, sum(sizes)), 0.0)
    return Crowd(regions, spots, speed * rng.normal(size=spots.shape), radii, turns, sizes[0])


def two_teams(crowd, period, first=None):
    """What both teams do, each with the other as the others, shape (n, 2) [m/s].

    With `first`, those of the first team that have the right of way, the others yield to it.
    """
    regions, spots, wished, radii, turns, size = crowd
    velocities = np.empty_like(wished)
    ours = np.arange(len(spots)) < size
    for team in (ours, ~ours):
        if team.any():
            velocities[team] = avoided(
                regions,
                spots[team],
                wished[team],
                radii[team],
                spots[~team],
                radii[~team],
                period,
                turns[team],
                first[team] if first is not None and team[0] else None,
                0 if first is None else 1 if team[0] else -1,
            )
    return velocities


@given(
    crowd=crowds(),
    period=st.sampled_from([0.01, 0.05, 1.0]),
    ranked=st.booleans(),
    order=st.randoms(use_true_random=False),
)
def test_no_two_bodies_touch_and_no_centre_leaves_its_region_at_any_moment_of_a_step(
    least_distances, crowd, period, ranked, order
):
    regions, spots, _, radii, _, _ = crowd
    first = np.array([order.random() < 0.5 for _ in spots]) if ranked else None
    steps = period * two_teams(crowd, period, first)
    for (i, j), distance in least_distances(spots, steps).items():
        # Those that overlap at the start come no nearer.
        begun = math.dist(spots[i], spots[j])
        assert distance >= min(radii[i] + radii[j], begun) - 1e-12
    free = shapely.union_all([region.polygon for region in regions]).buffer(1e-8)
    paths = shapely.linestrings(np.stack([spots, spots + steps], axis=1))
    assert shapely.covers(free, paths).all()


@given(crowd=crowds())
def test_nor_do_those_that_the_others_know_nothing_of(least_distances, crowd):
    # The others stand, which keeps the rule too.
    regions, spots, wished, radii, turns, size = crowd
    ours = slice(size)
    velocities = avoided(
        regions,
        spots[ours],
        wished[ours],
        radii[ours],
        spots[size:],
        radii[size:],
        turns=turns[ours],
    )
    steps = np.concatenate([PERIOD * velocities, np.zeros((len(spots) - size, 2))])
    for (i, j), distance in least_distances(spots, steps).items():
        if j < size:
            begun = math.dist(spots[i], spots[j])
            assert distance >= min(radii[i] + radii[j], begun) - 1e-12


@given(
    crowd=crowds(),
    angle=st.floats(-math.pi, math.pi),
    mirrored=st.booleans(),
    scale=st.sampled_from([0.3, 1.0, 1.7]),
    shift=st.tuples(st.floats(-9, 9), st.floats(-9, 9)),
    order=st.randoms(use_true_random=False),
)
def test_velocities_turn_mirror_move_rescale_and_renumber_with_the_game(
    crowd, angle, mirrored, scale, shift, order
):
    regions, spots, wished, radii, turns, size = crowd
    c, s = math.cos(angle), math.sin(angle)
    matrix = scale * np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirrored else 1.0])
    ours, others = list(range(size)), list(range(size, len(spots)))
    order.shuffle(ours)
    order.shuffle(others)

    def carry(points):
        return np.asarray(points) @ matrix.T + shift

    carried = [make_world(*_carried_rings(region, carry)) for region in regions]
    velocities = avoid(
        *build_edge_index(*carried),
        carry(spots[ours]).ravel(),
        (wished[ours] @ matrix.T).ravel(),
        scale * radii[ours],
        carry(spots[others]).ravel(),
        scale * radii[others],
        turns[ours],
        np.zeros(len(ours), dtype=bool),
        0,
        0.0,
        0.0,
        scale * TOP_SPEED,
        PERIOD,
    ).reshape(-1, 2)
    straight = avoided(
        regions,
        spots[:size],
        wished[:size],
        radii[:size],
        spots[size:],
        radii[size:],
        turns=turns[:size],
    )
    assert velocities == pytest.approx(straight[ours] @ matrix.T, abs=1e-9)


def _carried_rings(region, carry):
    return carry(region.boundary), [carry(ring) for ring in region.obstacles]


class TestRightOfWay:
    def test_it_goes_straight_through_between_teammates_that_make_room(self):
        spots = np.array([[0.0, 0.0], [0.5, 0.03], [0.9, -0.05]])
        radii, goal = [0.12, 0.12, 0.12], np.array([1.6, 0.0])
        for _ in range(150):
            way = goal - spots[0]
            wish = TOP_SPEED * way / max(np.hypot(*way), TOP_SPEED * PERIOD)
            moves = avoided(
                OPEN, spots, [wish, [0, 0], [0, 0]], radii, first=[True, False, False], rank=1
            )
            assert moves[0] == pytest.approx(wish, abs=1e-9)
            spots = spots + PERIOD * moves
        assert spots[0] == pytest.approx(goal, abs=1e-6)

    def test_who_yields_to_another_team_keeps_away_from_it(self):
        stranger, radii = [[0.3, 0.0]], [0.12]
        yielding = avoided(OPEN, [[0.0, 0.02]], [[0.0, 0.0]], radii, stranger, radii, rank=-1)
        # Straight away from it.
        assert yielding[0] == pytest.approx(
            np.hypot(*yielding[0]) * np.array([-0.3, 0.02]) / np.hypot(0.3, 0.02)
        )
        assert 0.1 < np.hypot(*yielding[0]) <= TOP_SPEED + 1e-9
        among_equals = avoided(OPEN, [[0.0, 0.02]], [[0.0, 0.0]], radii, stranger, radii)
        assert among_equals[0] == pytest.approx([0, 0], abs=1e-12)


def go_to(regions, starts, goals, radii, seconds, others=(), other_radii=()):
    """Tracks of a team whose robots go straight for their goals at top speed, (T, n, 2) [m]."""
    track, goals = [np.array(starts, dtype=float)], np.array(goals, dtype=float)
    turns, waiting = np.zeros(len(starts)), np.zeros(len(starts))
    for _ in range(round(seconds / PERIOD)):
        way = goals - track[-1]
        distance = np.hypot(way[:, 0], way[:, 1])[:, None]
        wished = way / np.maximum(distance, 1e-12) * np.minimum(TOP_SPEED, distance / PERIOD)
        before = track[max(0, len(track) - 2)].ravel()
        waiting = still_waiting(waiting, before, track[-1].ravel(), wished.ravel(), PERIOD)
        turns, waiting = take_turns(
            turns, waiting, track[-1].ravel(), flat(radii), flat(others), PERIOD
        )
        safe = avoided(regions, track[-1], wished, radii, others, other_radii, turns=turns)
        track.append(track[-1] + PERIOD * safe)
    return np.array(track)


class TestGoingPast:
    @pytest.mark.parametrize("offset", [0.0, 1e-3, 0.1])
    def test_two_teammates_that_meet_head_on_in_the_open_pass(self, offset):
        starts, goals = [[-1, 0], [1, offset]], [[1, 0], [-1, offset]]
        track = go_to(OPEN, starts, goals, [0.16, 0.16], 10.0)
        # Straight and alone they would need 6.7 s.
        assert np.hypot(*(track[-1] - goals).T).max() < 0.01
        assert np.hypot(*(track[:, 0] - track[:, 1]).T).min() > 0.32

    def test_four_that_cross_in_the_middle_all_arrive(self):
        angles = np.array([0.1, 1.5, 3.3, 4.9])
        starts = np.column_stack([np.cos(angles), np.sin(angles)])
        track = go_to(OPEN, starts, -starts, np.full(4, 0.16), 30.0)
        assert np.hypot(*(track[-1] + starts).T).max() < 0.01

    @pytest.mark.parametrize("offset", [0.0, 0.05])
    @pytest.mark.parametrize("teammate", [True, False])
    def test_one_that_stands_in_the_way_in_the_open_is_passed(self, offset, teammate):
        standing, radius = [0.0, offset], 0.16
        if teammate:
            track = go_to(OPEN, [[-1, 0], standing], [[1, 0], standing], [radius] * 2, 10.0)
        else:
            track = go_to(OPEN, [[-1, 0]], [[1, 0]], [radius], 10.0, [standing], [radius])
        assert np.hypot(*(track[-1, 0] - [1, 0])) < 0.01

    def test_in_a_narrow_lane_one_that_stands_is_pushed_along(self):
        lane = make_world([[-2, -0.25], [2, -0.25], [2, 0.25], [-2, 0.25]])
        # It wants nothing, neither here nor there.
        regions, at = shrink_world(lane, 0.16), np.array([[-1.0, 0.02], [0.0, -0.01]])
        for _ in range(round(12.0 / PERIOD)):
            at += PERIOD * avoided(regions, at, [[0.3, 0.0], [0.0, 0.0]], [0.16, 0.16])
        # They touch at -0.3 m after 2.3 s, and go on together at a sixth of top speed or more.
        assert at[0, 0] > 0.18
        assert at[1, 0] > at[0, 0]
        assert math.dist(*at) > 0.32


class TestTurns:
    @pytest.mark.parametrize("whose", [0, 1])
    def test_head_on_in_a_lane_the_one_whose_turn_it_is_drives_the_other_back(self, whose):
        lane = make_world([[-2, -0.15], [2, -0.15], [2, 0.15], [-2, 0.15]])
        regions, positions = shrink_world(lane, 0.12), [[-0.125, 0.0], [0.125, 0.0]]
        wished, radii = [[0.3, 0.0], [-0.3, 0.0]], [0.12, 0.12]
        equal = avoided(regions, positions, wished, radii)
        assert equal[:, 0] == pytest.approx([0.0, 0.0], abs=0.02)
        driven = avoided(regions, positions, wished, radii, turns=np.eye(2)[whose])
        assert (driven[:, 0] * wished[whose][0] > 0.01).all()

    @pytest.mark.parametrize("mirrored", [1.0, -1.0])
    def test_one_between_a_stranger_and_a_teammate_gets_away_past_the_teammate(self, mirrored):
        # On a wall, a stranger ahead, and behind it a teammate that presses on.
        world = make_world([[-3, -3 * mirrored], [3, -3 * mirrored], [3, 0], [-3, 0]])
        regions, radius = shrink_world(world, 0.16), 0.16
        at = np.array([[0.0, -0.1601], [-0.3, -0.303]]) * [1.0, mirrored]
        strangers = np.array([[0.33, -0.1601]]) * [1.0, mirrored]
        wished = np.array([[0.3, 0.0], [0.25, 0.1 * mirrored]])
        for turns, way in ((None, [0.0, 0.02]), ([1.0, 0.0], [0.15, np.inf])):
            places = at.copy()
            for _ in range(round(1.0 / PERIOD)):
                places += PERIOD * avoided(
                    regions, places, wished, [radius] * 2, strangers, [radius], turns=turns
                )
            assert way[0] <= math.dist(places[0], at[0]) <= way[1]
