"""The moment of loss is located exactly, whatever the step."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.edge_index import build_edge_index
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


def walks(world, rng, teams, members):
    """Straight walks through free space, of a metre or so, shape (teams, 2 ends, members, 2)."""
    starts = rng.uniform(world.bounds[:2], world.bounds[2:], (4 * teams * members, 2))
    ends = starts + rng.normal(0, 1.0, starts.shape)
    lines = np.stack([starts, ends], axis=1)
    free = lines[shapely.covers(world.polygon, shapely.linestrings(lines))][: teams * members]
    return free.reshape(teams, members, 2, 2).swapaxes(1, 2)


def sighted(world, teams, times, viewers):
    """Whether each target is in someone's sight at each team's time, by Shapely, (teams, targets).

    The first `viewers` of a team look at the others.
    """
    at = teams[:, 0] + times[:, None, None] * (teams[:, 1] - teams[:, 0])
    lines = np.broadcast_arrays(at[:, :viewers, None], at[:, None, viewers:])
    clear = shapely.covers(world.polygon, shapely.linestrings(np.stack(lines, axis=-2)))
    return clear.any(axis=1)


def moments_by_bisection(world, teams, viewers):
    """When a sample first finds a target out of sight, shape (teams,); inf where none does."""

    def all_sighted(which, times):
        return sighted(world, teams[which], times, viewers).all(axis=1)

    last, first = np.zeros(len(teams)), np.full(len(teams), np.inf)
    keeping = np.arange(len(teams))
    for sample in np.linspace(0.0, 1.0, 65):
        kept = all_sighted(keeping, np.full(len(keeping), sample))
        first[keeping[~kept]] = sample
        keeping = keeping[kept]
        last[keeping] = sample
    losing = np.flatnonzero((first > 0.0) & np.isfinite(first))
    for _ in range(40):
        middle = 0.5 * (last[losing] + first[losing])
        kept = all_sighted(losing, middle)
        last[losing[kept]], first[losing[~kept]] = middle[kept], middle[~kept]
    return first


def test_when_all_walk_the_first_loss_is_where_sampling_and_bisection_find_it(random_world):
    agreeing = 0
    for viewers in (1, 2, 3):
        world = random_world(viewers - 1, 30)
        shapely.prepare(world.polygon)
        index = build_edge_index(world)
        teams = walks(world, np.random.default_rng(viewers), 1500, viewers + 2)
        found = [
            loss(team[:, :viewers].swapaxes(0, 1), team[:, viewers:].swapaxes(0, 1), index)
            for team in teams
        ]
        fractions, lost = np.array(found).T
        expected = moments_by_bisection(world, teams, viewers)
        # What samples show unseen is not found later. They overlook short losses, so right before
        # the moment all targets are to be in sight, and right after it the lost one is not.
        assert (fractions <= expected + 1e-9).all()
        losing = np.flatnonzero(np.isfinite(fractions) & (fractions > 0.0))
        before = sighted(world, teams[losing], fractions[losing] - 1e-7, viewers)
        after = sighted(world, teams[losing], fractions[losing] + 1e-7, viewers)
        assert before.all()
        assert not after[np.arange(len(losing)), lost[losing].astype(int)].any()
        agreeing += np.sum(np.abs(fractions[losing] - expected[losing]) < 1e-9)
    assert agreeing >= 1000
