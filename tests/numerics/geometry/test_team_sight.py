"""Sight between teams is sight along each line, and round bodies stand in its way."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.segment_sight import are_clear, build_corner_index
from sightfield.systems.numerics.geometry.sight_loss import first_loss
from sightfield.systems.numerics.geometry.team_sight import checked_radii, sight_matrix
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.sight_state import observe, split_sight


def pairs(a, b):
    """All pairs of rows, shape (n m, 2) each."""
    return np.repeat(a, len(b), axis=0), np.tile(b, (len(a), 1))


def test_the_matrix_holds_every_pair(random_world, free_points):
    world = random_world(1, 25)
    index = build_edge_index(world)
    viewers, targets = free_points(world, 2, 7), free_points(world, 3, 11)
    expected = are_clear(index, *pairs(viewers, targets))
    np.testing.assert_array_equal(sight_matrix(index, viewers.ravel(), targets.ravel()), expected)


ARENA = [[0, 0], [4, 0], [4, 4], [0, 4]]
EMPTY = build_edge_index(make_world(ARENA))
NEVER = (np.inf, -1)


def loss(viewers, targets, radii, index=EMPTY):
    """First loss; each mover is a pair of positions at the two ends of the interval."""
    v, t = np.array(viewers, dtype=float), np.array(targets, dtype=float)
    ends = [v[:, 0].ravel(), v[:, 1].ravel(), t[:, 0].ravel(), t[:, 1].ravel()]
    return first_loss(index, *ends, None if radii is None else np.array(radii, dtype=float))


def seen(viewers, targets, radii, index=EMPTY):
    """Sight as a list of zeros and ones."""
    flat = [np.array(points, dtype=float).ravel() for points in (viewers, targets)]
    return sight_matrix(index, *flat, np.array(radii, dtype=float)).tolist()


def stays(x, y):
    return [(x, y), (x, y)]


def test_a_body_that_drives_across_hides_what_is_behind_it_when_its_rim_arrives():
    # From y = 3.9 at 3.8 a step: 0.2 above the line y = 2 after 1.7 / 3.8 of it. It is gone again
    # at the end of the step.
    across = [(2.0, 3.9), (2.0, 0.1)]
    found = loss([stays(0.5, 2)], [stays(3.5, 2), across], [0.1, 0.1, 0.2])
    assert found == (pytest.approx(1.7 / 3.8, abs=1e-8), 0)


def test_a_line_that_turns_towards_a_body_ends_on_its_tangent():
    # A disc of 0.3 at 1.5: its tangent from the viewer has the sine 0.2, and the target, 3 away,
    # comes down from 3 above to 0.
    down = [(3.5, 3.5), (3.5, 0.5)]
    found = loss([stays(0.5, 0.5)], [stays(2.0, 0.5), down], [0.1, 0.3, 0.1])
    assert found == (pytest.approx(1.0 - 0.2 / np.sqrt(0.96), abs=1e-8), 1)


def test_a_body_that_comes_over_the_end_of_a_line_blocks_it_from_there():
    # Its rim reaches the target, at x = 3, from behind; the viewer sees the point that follows.
    behind = [(3.9, 2.0), (2.9, 2.0)]
    found = loss([stays(0.5, 2)], [stays(3.0, 2), behind], [0.0, 0.0, 0.4])
    assert found == (pytest.approx(0.5, abs=1e-8), 0)


def test_a_body_beside_or_behind_the_line_does_not_block_it():
    robots = [[0.5, 2]], [[3.0, 2], [3.5, 2]]
    assert seen(*robots, [0.3, 0.0, 0.49]) == [1, 1]
    assert seen(*robots, [0.3, 0.0, 0.51]) == [0, 1]
    assert seen([[0.5, 2]], [[3.0, 2], [2.0, 2.5]], [0.3, 0.3, 0.49]) == [1, 1]
    assert seen([[0.5, 2]], [[3.0, 2], [2.0, 2.5]], [0.3, 0.3, 0.51]) == [0, 1]


def test_pursuers_stand_in_each_others_way_and_so_do_evaders():
    pursuers, evaders = [[1, 2], [2, 2]], [[2.5, 2], [3.5, 2]]
    # The first sees none past the second, who sees the nearer evader alone.
    assert seen(pursuers, evaders, [0.1, 0.1, 0.1, 0.1]) == [0, 0, 1, 0]
    assert seen(pursuers, evaders, [0.1, 0.1, 0.0, 0.1]) == [0, 0, 1, 1]
    assert seen(pursuers, evaders, [0.1, 0.0, 0.1, 0.1]) == [1, 0, 1, 0]


def test_who_stands_inside_another_body_sees_that_robot_alone():
    pursuers, evaders = [[1, 2], [0.8, 2.4]], [[0.8, 2], [3.5, 3.5]]
    assert seen(pursuers, evaders, [0.1, 0.1, 0.3, 0.1]) == [1, 0, 1, 1]
    assert seen(pursuers, evaders, [0.1, 0.1, 0.5, 0.1]) == [1, 0, 1, 0]


def test_a_second_viewer_keeps_the_target():
    across = [(2.0, 3.9), (2.0, 0.1)]
    viewers = [stays(0.5, 2), stays(3.5, 0.2)]
    assert loss(viewers, [stays(3.5, 2), across], [0.1, 0.1, 0.1, 0.2]) == NEVER


def test_a_target_behind_a_body_from_the_start_is_lost_at_once():
    assert loss([stays(0.5, 2)], [stays(3.5, 2), stays(2, 2.1)], [0.1, 0.1, 0.2]) == (0.0, 0)


@pytest.mark.parametrize("angle", np.linspace(0.0, 6.0, 13))
def test_grazing_a_body_is_clear(angle):
    along = np.array([np.cos(angle), np.sin(angle)])
    across = np.array([-along[1], along[0]])
    centre = np.array([2.0, 2.0])
    viewer, target = centre - 1.3 * along, centre + 1.4 * along
    for depth, clear in ((0.0, True), (1e-4, False)):
        beside = centre + (0.3 - depth) * across
        assert (seen([viewer], [target, beside], [0.2, 0.2, 0.3])[0] == 1.0) == clear
        # It slides along the line, or comes as far as the line and leaves again.
        slides = [beside - 0.9 * along, beside + 0.9 * along]
        robots = [viewer] * 2, [target] * 2
        found = loss([robots[0]], [robots[1], slides], [0.0, 0.0, 0.3])
        assert found == NEVER if clear else (0.0, 0)
        # A line that swings past touches at one moment.
        swings = [target - 0.2 * across, target], [target, target - 0.2 * across]
        for swing in swings:
            found = loss([robots[0]], [swing, [beside] * 2], [0.0, 0.0, 0.3])
            assert (found == NEVER) == clear


def test_ones_own_body_and_the_targets_never_block():
    rng = np.random.default_rng(5)
    for _ in range(50):
        viewer, target = rng.uniform(0.1, 3.9, (2, 1, 2, 2))
        assert loss(viewer, target, [3.0, 2.0]) == NEVER
        assert seen(viewer[:, 0], target[:, 0], [3.0, 2.0]) == [1.0]


def distances(centres, starts, ends):
    """From points to segments [m], arrays of the same shape (..., 2)."""
    along = ends - starts
    square = np.maximum(np.sum(along * along, axis=-1), 1e-300)
    share = np.clip(np.sum((centres - starts) * along, axis=-1) / square, 0.0, 1.0)
    return np.linalg.norm(centres - starts - share[..., None] * along, axis=-1)


def sighted(index, at, n, radii):
    """Whether each target is seen by someone, for positions (k, n + m, 2): shape (k, m)."""
    starts, ends = np.broadcast_arrays(at[:, :n, None], at[:, None, n:])
    clear = are_clear(index, starts.reshape(-1, 2), ends.reshape(-1, 2)).reshape(starts.shape[:3])
    for k in range(at.shape[1]):
        free = distances(at[:, None, None, k], starts, ends) >= radii[k]
        if k < n:
            free[:, k] = True
        else:
            free[:, :, k - n] = True
        clear &= free
    return clear.any(axis=1)


def random_games(world, free_points, seed, count, n=2, m=2):
    """Games of a step through free space, in which everyone is in sight at first.

    Yields positions at the start and at the end, shape (n + m, 2), viewers first, and radii.
    """
    index = build_edge_index(world)
    rng = np.random.default_rng(seed)
    for starts in free_points(world, seed, count * (n + m)).reshape(-1, n + m, 2):
        ends = starts + rng.normal(0, 1.0, starts.shape)
        free = are_clear(index, starts, ends)
        ends[~free] = starts[~free]  # nobody walks through an obstacle
        radii = rng.uniform(0.05, 0.9, n + m)
        if sighted(index, starts[None], n, radii).all():
            yield starts, ends, radii


def played(index, starts, ends, radii, n=2):
    """First loss in such a game."""
    viewers, targets = (
        (starts[:n].ravel(), ends[:n].ravel()),
        (starts[n:].ravel(), ends[n:].ravel()),
    )
    return first_loss(index, *viewers, *targets, radii)


SAMPLES = np.linspace(0.0, 1.0, 401)
# Short against a loss of sight, long against what the world's tolerance makes of its moment.
MOMENT = 1e-5


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("n", [2, 3])
def test_agrees_with_dense_sampling(random_world, free_points, seed, n):
    world = random_world(seed, 8)
    index = build_edge_index(world)
    found = by_bodies = kept = 0
    for starts, ends, radii in random_games(world, free_points, seed, 500, n):
        fraction, lost = played(index, starts, ends, radii, n)

        def in_sight(times, starts=starts, ends=ends, radii=radii):
            at = starts + np.asarray(times)[:, None, None] * (ends - starts)
            return sighted(index, at, n, radii)

        assert in_sight(SAMPLES[fraction - MOMENT > SAMPLES]).all()
        if lost < 0:
            kept += 1
            continue
        assert in_sight([max(fraction - MOMENT, 0.0)]).all()
        assert not in_sight([fraction + MOMENT])[0, lost]
        found += 1
        by_bodies += played(index, starts, ends, None, n)[0] > fraction
    # Of all twelve together some hundreds each.
    assert (found >= 40, by_bodies >= 30, kept >= 100) == (True, True, True)


def test_sight_is_what_shapely_says_of_lines_and_discs(random_world, free_points):
    world = random_world(4, 15)
    index = build_edge_index(world)
    rng = np.random.default_rng(4)
    hidden = 0
    for points in free_points(world, 4, 2100).reshape(-1, 7, 2):
        radii = rng.uniform(0.0, 0.8, 7)
        viewers, targets = points[:3], points[3:]
        for (i, j), clear in zip(
            np.ndindex(3, 4), seen(viewers, targets, radii, index), strict=True
        ):
            line = shapely.LineString([viewers[i], targets[j]])
            free = world.polygon.covers(line)
            others = [k for k in range(7) if k not in (i, 3 + j)]
            past = all(line.distance(shapely.Point(points[k])) >= radii[k] for k in others)
            assert clear == (free and past)
            hidden += free and not past
    assert hidden > 300


def test_bodies_hide_evaders_and_no_corners():
    world = make_world(ARENA, [[[1, 1], [2, 1], [2, 2], [1, 2]]])
    index = build_edge_index(world)
    corners = build_corner_index(world, index)
    rng = np.random.default_rng(6)
    changed = 0
    for _ in range(100):
        pursuers, evaders = rng.uniform(2, 4, 6), rng.uniform(2, 4, 4)
        radii = rng.uniform(0.0, 0.5, 5)
        without = observe(index, corners, pursuers, evaders)
        sight = observe(index, corners, pursuers, evaders, radii)
        np.testing.assert_array_equal(sight[6:], without[6:])
        whom = split_sight(sight, 3, 2, 4)[0]
        np.testing.assert_array_equal(whom.ravel(), sight_matrix(index, pursuers, evaders, radii))
        changed += (sight[:6] != without[:6]).any()
    assert changed > 20


@pytest.mark.parametrize("mirror", [False, True])
def test_a_scene_turned_mirrored_and_scaled_is_lost_at_the_same_moment(
    random_world, free_points, moved, mirror
):
    world = random_world(2, 12)
    image, carry = moved(world, 0.7, mirror, 2.5, (3.0, -20.0))
    indices = build_edge_index(world), build_edge_index(image)
    losses = 0
    for starts, ends, radii in random_games(world, free_points, 2, 500):
        one = played(indices[0], starts, ends, radii)
        other = played(indices[1], carry(starts), carry(ends), 2.5 * radii)
        assert other == (pytest.approx(one[0], abs=1e-7), one[1])
        losses += one[1] >= 0
    assert losses > 30


def test_robots_counted_in_another_order_are_lost_at_the_same_moment(random_world, free_points):
    world = random_world(3, 12)
    index = build_edge_index(world)
    order = np.array([2, 0, 1, 4, 3])
    losses = 0
    for starts, ends, radii in random_games(world, free_points, 3, 500, n=3):
        fraction, lost = played(index, starts, ends, radii, n=3)
        again = played(index, starts[order], ends[order], radii[order], n=3)
        assert again[0] == pytest.approx(fraction, abs=1e-12)
        assert again[1] == (1 - lost if lost >= 0 else -1)
        losses += lost >= 0
    assert losses > 30


def test_half_a_step_comes_to_the_same_moment(random_world, free_points):
    world = random_world(5, 12)
    index = build_edge_index(world)
    losses = 0
    for starts, ends, radii in random_games(world, free_points, 2, 500):
        fraction, lost = played(index, starts, ends, radii)
        middle = 0.5 * (starts + ends)
        first = played(index, starts, middle, radii)
        if fraction < 0.5:
            assert first == (pytest.approx(2.0 * fraction, abs=1e-7), lost)
            losses += 1
        else:
            assert first == NEVER
            second = played(index, middle, ends, radii)
            assert second == (pytest.approx(2.0 * fraction - 1.0, abs=1e-7), lost)
    assert losses > 20


def test_bodies_of_no_size_or_out_of_the_way_change_no_bit(random_world, free_points):
    world = random_world(7, 25)
    index = build_edge_index(world)
    losses = 0
    for starts, ends, _ in random_games(world, free_points, 7, 600):
        without = played(index, starts, ends, None)
        assert played(index, starts, ends, np.zeros(4)) == without
        ways = (starts[:2].ravel(), starts[2:].ravel())
        nobody = sight_matrix(index, *ways)
        assert nobody.tobytes() == sight_matrix(index, *ways, np.zeros(4)).tobytes()
        losses += without[1] >= 0
    assert losses > 50


@pytest.mark.parametrize("radii", [[0.1], [0.1] * 3, [[0.1, 0.1]]])
def test_another_number_of_radii_is_refused(radii):
    one = np.array([1.0, 1.0])
    wrong = np.array(radii)
    with pytest.raises(InvalidInput, match=r"`radii` must have the shape \(2,\); got"):
        sight_matrix(EMPTY, one, one, wrong)
    with pytest.raises(InvalidInput, match=r"`radii` must have the shape \(2,\); got"):
        first_loss(EMPTY, one, one, one, one, wrong)


def test_radii_are_checked_by_name():
    assert checked_radii((), 3) is None
    np.testing.assert_array_equal(checked_radii([0, 0.2], 2), [0.0, 0.2])
    with pytest.raises(InvalidInput, match="`body_radii` must be empty or name 3 radii; got 2"):
        checked_radii([0.1, 0.2], 3)
    for wrong in (-0.1, np.inf, np.nan):
        with pytest.raises(InvalidInput, match=r"`body_radii\.1` must be .*; got"):
            checked_radii([0.1, wrong], 2)
