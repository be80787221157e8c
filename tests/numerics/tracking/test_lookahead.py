"""Pursuers that look ahead take the best of the steps that they try."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.special import logsumexp

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.wall_sliding import slide
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking import lookahead
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.lookahead import lookahead_velocities, signed_margin
from sightfield.systems.numerics.tracking.sight_state import observe, split_sight

ROOM = np.array([[0, 0], [4, 0], [4.2, 4], [0, 3.8]])
BOXES = [
    np.array([[1.1, 0.9], [1.9, 1.0], [1.8, 1.9], [1.0, 1.7]]),
    np.array([[2.6, 2.1], [3.3, 2.3], [2.9, 3.0]]),
]
RADIUS, RATIO, SPEED = 0.1, 0.3, 0.3
WORLD = make_world(ROOM, BOXES)


def sight_of(world, pursuers, evaders):
    index = build_edge_index(world)
    return observe(index, build_corner_index(world, index), np.ravel(pursuers), np.ravel(evaders))


def velocities_of(world, pursuers, evaders, assignment, speed=SPEED, radius=RADIUS):
    return lookahead_velocities(
        build_edge_index(*shrink_world(world, radius)),
        np.ravel(pursuers).astype(float),
        np.ravel(evaders).astype(float),
        sight_of(world, pursuers, evaders),
        np.array(assignment, dtype=float),
        corner_table(world),
        RATIO,
        speed,
    ).reshape(-1, 2)


@st.composite
def games(draw):
    """Places of up to three pursuers and three evaders, and an assignment within sight."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n, m = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    free = shapely.union_all([part.polygon for part in shrink_world(WORLD, RADIUS)])
    points = rng.uniform(0, 4, (60, 2))
    points = points[shapely.contains_properly(free, shapely.points(points))][: n + m]
    pursuers, evaders = points[:n], points[n:]
    seen = split_sight(sight_of(WORLD, pursuers, evaders), n, m, len(WORLD.corners))[0] > 0.5
    choices = [[-1, *np.flatnonzero(row)] for row in seen]
    return pursuers, evaders, [int(rng.choice(each)) for each in choices]


def soft_minimum(values):
    values = [value for value in values if value < math.inf]
    width = lookahead.SOFTNESS * SPEED
    return -width * logsumexp(-np.array(values) / width) if values else math.inf


def score_of(i, place, pursuers, evaders, assignment):
    """How good it is for pursuer i to be at a place, by the definition."""
    corners, n, m = corner_table(WORLD), len(pursuers), len(evaders)
    sight = sight_of(WORLD, pursuers, evaders)
    seen, by_pursuer, by_evader = (each > 0.5 for each in split_sight(sight, n, m, len(corners)))

    def in_hand(k, at, j):
        shared = np.flatnonzero(by_pursuer[k] & by_evader[j])
        return soft_minimum([signed_margin(*at, *evaders[j], corners, c, RATIO) for c in shared])

    values = []
    for j in np.flatnonzero(seen[i]):
        value = in_hand(i, place, j)
        if j != assignment[i]:
            others = [in_hand(k, pursuers[k], j) for k in range(n) if k != i and seen[k, j]]
            value = max([value, *others])
        values.append(value)
    return soft_minimum(values)


def ring_of(i, pursuers, evaders, assignment):
    """The places that pursuer i tries, staying first."""
    seen = split_sight(
        sight_of(WORLD, pursuers, evaders), len(pursuers), len(evaders), len(WORLD.corners)
    )[0]
    offsets = evaders - pursuers[i]
    target = assignment[i]
    if target < 0:
        target = np.argmin(np.where(seen[i] > 0.5, np.hypot(*offsets.T), np.inf))
    forward = math.atan2(offsets[target, 1], offsets[target, 0])
    region = build_edge_index(*shrink_world(WORLD, RADIUS))
    reach, places = SPEED * lookahead.AHEAD, [pursuers[i]]
    for k in range(lookahead.DIRECTIONS):
        angle = forward + 2.0 * math.pi * k / lookahead.DIRECTIONS
        step = slide(region, *pursuers[i], reach * math.cos(angle), reach * math.sin(angle))
        places.append(pursuers[i] + step)
    return np.array(places)


@settings(max_examples=30)
@given(game=games())
def test_the_step_taken_is_the_best_of_the_ring(game):
    pursuers, evaders, assignment = game
    velocities = velocities_of(WORLD, pursuers, evaders, assignment)
    seen = split_sight(
        sight_of(WORLD, pursuers, evaders), len(pursuers), len(evaders), len(WORLD.corners)
    )[0]
    for i, velocity in enumerate(velocities):
        if not seen[i].any():
            assert velocity.tolist() == [0.0, 0.0]
            continue
        places = ring_of(i, pursuers, evaders, assignment)
        scores = [score_of(i, place, *game) for place in places]
        taken = np.hypot(*(places - pursuers[i] - lookahead.AHEAD * velocity).T) < 1e-9
        assert taken.any()
        assert max(np.array(scores)[taken]) >= max(scores) - 1e-9 or max(scores) == math.inf


@settings(max_examples=30)
@given(
    game=games(),
    angle=st.floats(-math.pi, math.pi),
    mirrored=st.booleans(),
    scale=st.sampled_from([1.0, 1.7]),
    order=st.randoms(use_true_random=False),
)
def test_velocities_turn_mirror_move_rescale_and_renumber_with_the_game(
    game, angle, mirrored, scale, order
):
    pursuers, evaders, assignment = game
    c, s = math.cos(angle), math.sin(angle)
    matrix = scale * np.array([[c, -s], [s, c]]) @ np.diag([1.0, -1.0 if mirrored else 1.0])

    def carry(points):
        return np.asarray(points) @ matrix.T + [3.0, -2.0]

    ours, theirs = list(range(len(pursuers))), list(range(len(evaders)))
    order.shuffle(ours)
    order.shuffle(theirs)
    renamed = [-1 if assignment[i] < 0 else theirs.index(assignment[i]) for i in ours]
    straight = velocities_of(WORLD, pursuers, evaders, assignment)
    moved = velocities_of(
        make_world(carry(ROOM), [carry(box) for box in BOXES]),
        carry(pursuers[ours]),
        carry(evaders[theirs]),
        renamed,
        scale * SPEED,
        scale * RADIUS,
    )
    # Two steps of a ring that are equally good, as seldom as they are, may be exchanged.
    for k, i in enumerate(ours):
        places = ring_of(i, pursuers, evaders, assignment)
        scores = sorted(score_of(i, place, *game) for place in places)
        assume(scores[-1] == math.inf or scores[-1] > scores[-2] + 1e-9)
        assert moved[k] == pytest.approx(matrix @ straight[i], abs=1e-9)


def test_a_pursuer_at_one_corner_runs_to_where_the_margin_grows_fastest():
    # The obstacle fills the third quadrant; the evader threatens to go behind its upper edge.
    world = make_world([[0, 0], [0, -4], [4, -4], [4, 4], [-4, 4], [-4, 0]])
    ((vx, vy),) = velocities_of(world, [[1.0, -1.0]], [[-0.5, 0.6]], [0], radius=0.0)
    assert math.hypot(vx, vy) == pytest.approx(SPEED)
    assert vy > 0.99 * SPEED


def test_who_sees_nobody_stays():
    pursuers, evaders = [[0.5, 0.5]], [[3.3, 3.3]]
    velocities = velocities_of(WORLD, pursuers, evaders, [-1])
    assert velocities.tolist() == [[0.0, 0.0]]
