"""No path of the cart is faster than its lower bound, and the bound is nearly reached."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.car_paths import (
    advance,
    dubins_lengths,
    reeds_shepp_lengths,
)
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.lower_bound import _gaps, lower_bound, word_families
from sightfield.systems.numerics.planning.trailer import Trailer

START = (1.0, 1.0, 0.0, 0.0)
GOAL = (4.0, 4.0, 0.0, 0.0)
DRIVES = pytest.mark.parametrize("reverse", [False, True], ids=["forward", "reverse"])


@DRIVES
def test_every_family_of_words_is_there(reverse):
    families = list(word_families(reverse))
    names = {(f.turns, f.coefficients.tobytes(), f.fixed.tobytes()) for f in families}
    assert len(families) == len(names) == (48 if reverse else 6)


def test_to_a_point_it_is_the_length_of_the_car():
    assert lower_bound(Trailer(), START, Goal(state=GOAL)) == pytest.approx(4.46243, abs=5e-6)
    free = Goal(state=GOAL, tolerance=(0, 0, 0, math.inf))
    assert lower_bound(Trailer(), START, free) == pytest.approx(4.46243, abs=5e-6)


def test_it_scales_with_the_cart():
    trailer = Trailer(speed=2.0, turn_rate=0.5, length=3.0)
    goal = Goal(state=(16.0, 16.0, 0.0, 0.0))
    bound = lower_bound(trailer, (4.0, 4.0, 0.0, 1.0), goal)
    assert bound == pytest.approx(2 * 4.46243, abs=1e-5)
    box = Goal(state=(16.0, 16.0, 0.0, 0.0), tolerance=(0.8, 0.8, 0.251, 0.251))
    normal = lower_bound(Trailer(), START, Goal(state=GOAL, tolerance=THESIS_TOLERANCE))
    assert lower_bound(trailer, (4, 4, 0, 1), box) == pytest.approx(2 * normal, abs=1e-9)


@DRIVES
@pytest.mark.parametrize(
    "tolerance", [THESIS_TOLERANCE, (0.2, 0, 0, 0), (0, 0, math.inf, 0), (0.5, 0.1, 1.0, 0)]
)
@pytest.mark.parametrize("goal", [GOAL, (-0.5, 2.0, -1.0, 0.0)])
def test_into_a_box_it_is_what_a_dense_search_finds(reverse, tolerance, goal):
    trailer = Trailer(reverse=reverse)
    bound = lower_bound(trailer, START, Goal(state=goal, tolerance=tolerance))
    widths = np.minimum(tolerance[:3], math.pi)
    axes = [np.linspace(-w, w, 33 if w else 1) for w in widths]
    gaps = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 3)
    # The box turns with the goal.
    c, s = math.cos(goal[2]), math.sin(goal[2])
    poses = np.array(goal[:3]) + gaps @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    lengths = reeds_shepp_lengths if reverse else dubins_lengths
    searched = lengths(START[:3], poses, 1.0).min()
    assert bound <= searched
    # As near as the steps of the search allow.
    assert bound == pytest.approx(searched, abs=0.05)


@DRIVES
def test_no_random_path_into_the_box_is_faster(reverse):
    random = np.random.default_rng(3)
    count = 200_000
    poses, driven = np.tile([0.0, 0.0, 0.0], (count, 1)), np.zeros(count)
    for _ in range(4):
        ways = random.normal(size=count)
        ways = ways if reverse else np.abs(ways)
        poses = advance(poses, random.integers(-1, 2, size=count).astype(float), ways)
        driven += np.abs(ways)
    goal = Goal(state=(1.6, 1.0, 0.5, 0.0), tolerance=(0.4, 0.4, 0.4, 0.0))
    c, s = math.cos(0.5), math.sin(0.5)
    gaps = (poses - goal.state[:3]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    gaps[:, 2] = np.remainder(gaps[:, 2] + math.pi, math.tau) - math.pi
    inside = np.all(np.abs(gaps) <= goal.tolerance[:3], axis=1)
    assert inside.sum() > 100
    bound = lower_bound(Trailer(reverse=reverse), (0, 0, 0, 0), goal)
    assert bound <= driven[inside].min() <= bound + 0.3


@DRIVES
def test_a_larger_box_is_no_farther(reverse):
    trailer = Trailer(reverse=reverse)
    bounds = [
        lower_bound(trailer, START, Goal(state=GOAL, tolerance=(w, w, w, 0)))
        for w in (0.0, 0.01, 0.1, 0.5, 2.0)
    ]
    assert bounds == sorted(bounds, reverse=True)
    assert bounds[1] == pytest.approx(bounds[0], abs=0.06)


@DRIVES
@pytest.mark.parametrize("turn", [0.5, -2.0, 3.0])
def test_with_the_position_free_it_is_the_time_to_turn(reverse, turn):
    goal = Goal(state=(3.0, 2.0, turn, 0.0), tolerance=(math.inf, math.inf, 0, 0))
    bound = lower_bound(Trailer(reverse=reverse), (0, 0, 0, 0), goal)
    # Arcs of many words are equally short: here the bound is looser than elsewhere.
    assert abs(turn) - 0.06 <= bound <= abs(turn)


@DRIVES
def test_with_the_heading_free_it_is_the_arc_and_its_tangent(reverse):
    goal = Goal(state=(3.0, 2.0, 0.0, 0.0), tolerance=(0, 0, math.inf, 0))
    distance, course = math.hypot(3, 1), math.atan2(1, 3)
    straight = math.sqrt(distance**2 - 1)
    arc = course + math.atan2(1, straight)
    bound = lower_bound(Trailer(reverse=reverse), (0, 0, 0, 0), goal)
    assert bound == pytest.approx(arc + straight, abs=2e-3)
    assert bound <= arc + straight


def test_inside_the_box_it_is_nothing():
    goal = Goal(state=START, tolerance=THESIS_TOLERANCE)
    assert lower_bound(Trailer(), (1.1, 0.9, 0.1, 0.0), goal) == 0


@pytest.mark.parametrize(
    ("start", "tolerance", "name"),
    [((0, 0, 0), 1e-3, "start"), ((0, 0, math.nan, 0), 1e-3, "start"), (START, 0, "tolerance")],
)
def test_bad_input_is_refused(start, tolerance, name):
    with pytest.raises(InvalidInput, match=name):
        lower_bound(Trailer(), start, Goal(state=GOAL), tolerance)


@DRIVES
def test_words_of_a_cell_end_as_near_to_its_middle_as_the_bound_says(reverse):
    """The slacks of `_gaps` hold to first order for small cells, and are not much too large."""
    rng = np.random.default_rng(8)
    start, half = np.array([0.4, -0.7, 1.1]), np.array([2e-4, 1e-4, 3e-4])
    corners = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])

    def ends(family, choices):
        poses = np.tile(start, (len(choices), 1))
        ways = choices @ family.coefficients.T + family.fixed
        for turn, way in zip(family.turns, ways.T, strict=True):
            poses = advance(poses, float(turn), way)
        return poses

    tightness = []
    for family in word_families(reverse):
        for _ in range(6):
            cell = rng.uniform(0.2, np.minimum(family.limits, 3.0))
            (middle,) = ends(family, cell[None])
            moved = ends(family, cell + half * np.vstack([corners, corners / 2]))
            centre, widths = middle + np.array([0.3, -0.4, 0.25]), np.array([0.1, 0.1, 0.05])
            gaps, slacks = _gaps(start, family, cell[None], half, centre, widths)
            # Outside the box by 0.2 and 0.3, and by 0.2 in heading.
            np.testing.assert_allclose(gaps[0], [math.hypot(0.2, 0.3), 0.2], atol=1e-9)
            shifts = np.hypot(*(moved - middle)[:, :2].T)
            twists = np.abs(np.remainder(moved[:, 2] - middle[2] + math.pi, math.tau) - math.pi)
            assert shifts.max() <= slacks[0, 0] * (1 + 2e-3)
            assert twists.max() <= slacks[0, 1] + 1e-12
            tightness.append(shifts.max() / slacks[0, 0])
    # The bound adds the arms of all pieces, which seldom pull the same way.
    assert max(tightness) > 0.95
    assert np.median(tightness) > 0.5
