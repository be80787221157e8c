"""The moment of loss is located exactly, whatever the step."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear, segment_is_clear
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.world import make_world

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1, 1], [2, 1], [2, 2], [1, 2]]
INDEX = build_edge_index(make_world(ARENA, [BOX]))


def loss(viewers, targets, index=INDEX):
    """First loss; each mover is a pair of positions at the two ends of the interval."""
    v, t = np.array(viewers, dtype=float), np.array(targets, dtype=float)
    ends = [v[:, 0].ravel(), v[:, 1].ravel(), t[:, 0].ravel(), t[:, 1].ravel()]
    return first_loss(index, *ends)


def test_a_target_that_walks_behind_a_box_is_lost_at_its_corner():
    # Seen from (1.5, 0), the ray past (2, 1) meets the line y = 1.5 at x = 2.25.
    assert loss([[(1.5, 0), (1.5, 0)]], [[(3, 1.5), (2, 1.5)]])[0] == pytest.approx(0.75)


def test_a_target_that_stays_in_view_is_not_lost():
    assert loss([[(1.5, 0), (1.5, 0)]], [[(3, 0.5), (0, 0.5)]]) == (np.inf, -1)


def test_a_short_loss_inside_a_long_step_is_found():
    # From (0, 3) straight over the box: visible at both ends of the step.
    fraction, lost = loss([[(1.5, 0), (1.5, 0)]], [[(0, 2.2), (4, 2.2)]])
    # The ray past (1, 1) meets y = 2.2 at x = 0.4.
    assert (fraction, lost) == (pytest.approx(0.1), 0)


def test_a_second_viewer_keeps_the_target():
    first, second = [(1.5, 0), (1.5, 0)], [(1.5, 4), (1.5, 4)]
    assert loss([first, second], [[(0, 2.2), (4, 2.2)]]) == (np.inf, -1)


def test_the_loss_of_a_team_is_the_moment_its_last_member_looks_away():
    # The first loses the target at 0.1 (see above); the second never saw it.
    first, second = [(1.5, 0), (1.5, 0)], [(3, 0.5), (3, 0.5)]
    fraction, lost = loss([second, first], [[(3.5, 0.1)] * 2, [(0, 2.2), (0.8, 2.2)]])
    assert (fraction, lost) == (pytest.approx(0.5), 1)


def test_grazing_a_vertex_is_not_a_loss():
    assert loss([[(0, 1), (0, 1)]], [[(3, 0.5), (3, 1.0)]]) == (np.inf, -1)


def test_a_target_unseen_from_the_start_is_lost_at_once():
    assert loss([[(0.5, 1.5), (0.5, 1.4)]], [[(3, 1.5), (3, 1.5)]]) == (0.0, 0)


@pytest.mark.parametrize("seed", range(5))
def test_agrees_with_dense_sampling(random_world, free_points, seed):
    world = random_world(seed, 30)
    index = build_edge_index(world)
    rng = np.random.default_rng(seed)
    starts = free_points(world, seed, 100).reshape(-1, 4, 2)
    samples = np.linspace(0.0, 1.0, 2001)
    found = 0
    for quad in starts:
        ends = quad + rng.normal(0, 0.3, quad.shape)
        if not are_clear(index, quad, ends).all():
            continue  # nobody walks through an obstacle
        fraction, lost = loss(
            list(zip(quad[:2], ends[:2], strict=True)),
            list(zip(quad[2:], ends[2:], strict=True)),
            index,
        )
        at = quad[None] + samples[:, None, None] * (ends - quad)
        unseen = np.array(
            [
                [not any(segment_is_clear(index, *q[v], *q[t]) for v in (0, 1)) for t in (2, 3)]
                for q in at
            ]
        )
        if unseen.any():
            first = int(np.argmax(unseen.any(axis=1)))
            assert samples[max(first - 1, 0)] - 1e-9 <= fraction <= samples[first] + 1e-9
            assert lost == int(np.argmax(unseen[first]))
            found += first > 0
    assert found > 0
