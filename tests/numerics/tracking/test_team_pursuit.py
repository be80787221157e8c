"""The weighted sum of pursuit fields (2.2)."""

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.team_sight import sight_matrix
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.corner_game import corner_table
from sightfield.systems.numerics.tracking.corner_policies import FIELDS, corner_field
from sightfield.systems.numerics.tracking.risk import RISK_VECTORS
from sightfield.systems.numerics.tracking.sight_state import observe
from sightfield.systems.numerics.tracking.team_pursuit import sample_field, team_pursuit

ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
BOX = [[1.6, 1.5], [2.4, 1.5], [2.4, 2.5], [1.6, 2.5]]
WORLD = make_world(ARENA, [BOX])
INDEX = build_edge_index(WORLD)
CORNERS = corner_table(WORLD)
MARGIN = FIELDS["margin"]

# A room with one reflex corner, at the origin: its obstacle fills the third quadrant.
ONE_CORNER = make_world([[0, 0], [0, -4], [4, -4], [4, 4], [-4, 4], [-4, 0]])


def pursue(
    pursuers,
    evaders,
    assignment,
    *,
    weighting="proportional",
    speed=0.3,
    period=0.0,
    world=WORLD,
):
    p, e = np.ravel(pursuers).astype(float), np.ravel(evaders).astype(float)
    index, corners = build_edge_index(world), corner_table(world)
    return team_pursuit(
        MARGIN,
        np.full(len(assignment), RISK_VECTORS[weighting]),
        p,
        e,
        observe(index, build_corner_index(world, index), p, e),
        np.array(assignment, dtype=float),
        corners,
        0.3,
        speed,
        period,
    ).reshape(-1, 2)


def threats(p, e):
    """Fields and distances of the corners that both see and that threaten, by hand."""
    found = []
    for x, y, heading, angle in CORNERS[:, :4]:
        both = sight_matrix(INDEX, np.array([*p, *e]), np.array([x, y]))
        if both.all():
            ux, uy, reach = corner_field(MARGIN, *p, *e, x, y, heading, angle, 0.3)
            if reach > 0:
                found.append((np.array([ux, uy]), np.hypot(e[0] - x, e[1] - y), reach))
    return found


# Both look along the box's lower side; two corners threaten.
P, E = (0.5, 1.0), (3.5, 1.2)


def test_majority_follows_the_field_of_the_nearest_corner():
    field, _, _ = min(threats(P, E), key=lambda each: each[1])
    np.testing.assert_allclose(pursue([P], [E], [0], weighting="majority"), [0.3 * field])


def test_uniform_and_proportional_weigh_all_that_threaten():
    found = threats(P, E)
    for weighting, weights in (
        ("uniform", [1.0] * len(found)),
        ("proportional", [1 / d for _, d, _ in found]),
    ):
        total = sum(w * field for w, (field, _, _) in zip(weights, found, strict=True))
        expected = 0.3 * total / np.hypot(*total)
        np.testing.assert_allclose(pursue([P], [E], [0], weighting=weighting), [expected])


def test_pursuers_without_an_evader_or_a_threat_rest():
    velocity = pursue([P, (0.5, 0.5)], [E], [-1, -1])
    assert not velocity.any()
    # From the star region of the only corner nothing can hide.
    assert not pursue([(1.0, 1.0)], [(-1.0, 1.0)], [0], world=ONE_CORNER).any()
    assert pursue([(1.0, -1.0)], [(-0.5, 1.0)], [0], world=ONE_CORNER).any()


def test_a_step_does_not_overshoot_the_star_region():
    # The star region begins 1 cm north of the pursuer.
    p, e = (1.0, -0.01), (-0.5, 1.0)
    fast = pursue([p], [e], [0], speed=5.0, world=ONE_CORNER)[0]
    assert np.hypot(*fast) == pytest.approx(5.0)
    capped = pursue([p], [e], [0], speed=5.0, period=0.1, world=ONE_CORNER)[0]
    assert 0.1 * np.hypot(*capped) == pytest.approx(0.01)
    np.testing.assert_allclose(capped / np.hypot(*capped), fast / np.hypot(*fast))


def test_sampled_field_is_the_direction_of_pursuit():
    points = np.array([P, (0.5, 0.7), (2.0, 2.0), (1.0, 3.8), (9.0, 9.0)])
    sampled = sample_field(INDEX, points, *E, CORNERS, MARGIN, RISK_VECTORS["uniform"], 0.3)
    for point, direction in zip(points[:2], sampled[:2], strict=True):
        expected = pursue([point], [E], [0], weighting="uniform")[0] / 0.3
        np.testing.assert_allclose(direction, expected)
    # In the box, behind it, outside the world.
    assert not sampled[2:].any()
