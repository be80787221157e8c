"""Paths of machines, their times, and the fastest ways to drive them."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.paths import (
    MachinePath,
    TimedPath,
    cornering_limits,
    fastest_profile,
    join_paths,
    keep_acceleration,
    poses_between,
    rounded_path,
    runs_of,
)


def arc_path(start, radius, turn, gear, pieces):
    """Along a circle, in a few pieces; a turn is to the left where it is positive."""
    share = np.linspace(0.0, 1.0, pieces + 1)
    theta = start[2] + turn * share
    side = np.sign(turn) * gear
    # The centre is to the left of the heading when the turn and the gear agree.
    centre = np.array(start[:2]) + side * radius * np.array([-np.sin(start[2]), np.cos(start[2])])
    points = centre + side * radius * np.column_stack([np.sin(theta), -np.cos(theta)])
    return MachinePath(
        np.column_stack([points, theta]),
        np.full(pieces, gear),
        np.ones(pieces, dtype=bool),
        np.full(pieces, 3),
    )


@pytest.mark.parametrize("gear", [1, -1])
@pytest.mark.parametrize("turn", [2.3, -1.1])
def test_a_few_poses_tell_the_whole_arc(gear, turn):
    start, radius = (3.0, -2.0, 0.7), 6.5
    coarse = arc_path(start, radius, turn, gear, 3)
    fine = arc_path(start, radius, turn, gear, 300)
    assert coarse.length == pytest.approx(radius * abs(turn), abs=1e-9)
    assert coarse.pose_at(np.linspace(0, coarse.length, 301)) == pytest.approx(fine.poses, abs=1e-9)
    assert np.abs(coarse.curvatures) == pytest.approx(1 / radius)


def test_short_pieces_bend_as_long_ones_do():
    fine = arc_path((3.0, -2.0, 0.7), 6.5, 2.3, 1, 60)
    assert fine.lengths.max() < 0.3
    assert fine.curvatures == pytest.approx(np.full(60, 1 / 6.5))
    assert fine.pose_at(np.array([0.1]))[0, 2] == pytest.approx(0.7 + 0.1 / 6.5)


def test_stations_beyond_the_ends_are_clipped():
    path = arc_path((0.0, 0.0, 0.4), 4.0, 1.0, 1, 2)
    assert path.pose_at([-1.0, 99.0]) == pytest.approx(path.poses[[0, -1]])


def test_a_joined_path_turns_on_and_has_a_cusp_where_the_gear_changes():
    first = arc_path((0.0, 0.0, 0.4), 4.0, 1.0, 1, 2)
    x, y, theta = first.poses[-1]
    second = arc_path((x, y, theta + 2 * np.pi), 4.0, -0.5, -1, 2)
    both = join_paths([first, second])
    assert both.length == pytest.approx(first.length + second.length)
    assert both.cusps == pytest.approx([first.length])
    assert np.abs(np.diff(both.poses[:, 2])).max() < 0.6
    with pytest.raises(InvalidInput, match="begin where"):
        join_paths([second, second])


def test_a_single_pose_is_a_path_of_no_length():
    none = np.zeros(0, dtype=int)
    path = MachinePath(np.array([[1.0, 2.0, 0.3]]), none, none.astype(bool), none)
    assert path.length == 0
    assert path.pose_at([0.0, 5.0]) == pytest.approx(np.array([[1.0, 2.0, 0.3]] * 2))


def test_paths_are_joined_across_a_single_pose():
    first = arc_path((0.0, 0.0, 0.0), 5.0, 1.0, 1, 3)
    end = first.poses[-1]
    none = np.zeros(0, dtype=int)
    stands = MachinePath(end[None], none, none.astype(bool), none)
    second = arc_path(end, 5.0, 1.0, 1, 3)
    joined = join_paths([first, stands, second])
    assert joined.length == pytest.approx(first.length + second.length)
    np.testing.assert_allclose(joined.poses[-1], second.poses[-1])


def test_evenly_spaced_stations_reach_both_ends():
    path = arc_path((0.0, 0.0, 0.4), 4.0, 1.3, 1, 2)
    at = path.stations_every(1.0)
    assert at[[0, -1]] == pytest.approx([0.0, path.length])
    assert np.diff(at).max() <= 1.0


STRAIGHT = MachinePath(
    np.array([[1.0, 2.0, 0.5], [1.0 + 20 * np.cos(0.5), 2.0 + 20 * np.sin(0.5), 0.5]]),
    np.array([1]),
    np.array([True]),
    np.array([0]),
)
# From rest to 2 m/s in 4 s, 6 s at that, to rest in 4 s.
TIMED = TimedPath(
    STRAIGHT,
    np.array([3.0, 7.0, 13.0, 17.0]),
    np.array([0.0, 4.0, 16.0, 20.0]),
    np.array([0.0, 2.0, 2.0, 0.0]),
)


def test_stations_and_speeds_follow_the_accelerations():
    times = [0.0, 3.0, 5.0, 7.0, 10.0, 15.0, 17.0, 40.0]
    assert TIMED.station_at(times) == pytest.approx([0, 0, 1, 4, 10, 19, 20, 20])
    assert TIMED.speed_at(times) == pytest.approx([0, 0, 1, 2, 2, 1, 0, 0])
    assert TIMED.end == 17.0


def test_poses_lie_on_the_path():
    way = TIMED.station_at(9.0)
    expected = [1.0 + way * np.cos(0.5), 2.0 + way * np.sin(0.5), 0.5]
    assert TIMED.pose_at(9.0) == pytest.approx(expected)


def test_what_decreases_is_refused():
    with pytest.raises(InvalidInput, match="stations"):
        TimedPath(STRAIGHT, np.array([0.0, 1.0]), np.array([1.0, 0.0]), np.zeros(2))
    with pytest.raises(InvalidInput, match="times"):
        TimedPath(STRAIGHT, np.array([1.0, 0.0]), np.array([0.0, 1.0]), np.zeros(2))


def straights(lengths, gears=None):
    """A path along a line, of pieces driven to and fro."""
    ways = np.asarray(lengths, dtype=float)
    driven = np.ones(len(ways), dtype=int) if gears is None else np.array(gears)
    along = np.concatenate([[0.0], np.cumsum(ways * driven)])
    poses = np.column_stack([2 + along * np.cos(0.4), 3 + along * np.sin(0.4), 0 * along + 0.4])
    return MachinePath(poses, driven, np.zeros(len(ways), dtype=bool), np.zeros(len(ways), int))


def integrated(path, limits, acceleration, step=0.0005):
    """Time by a fine integration: what each small step of way allows, forwards and backwards."""
    count = int(np.ceil(path.length / step))
    stations = np.linspace(0, path.length, count + 1)
    spacing = stations[1]
    piece = np.searchsorted(path.stations, stations[:-1] + spacing / 2) - 1
    squares = np.full(count + 1, np.inf)
    squares[:-1] = np.array(limits)[piece] ** 2
    squares[1:] = np.minimum(squares[1:], np.array(limits)[piece] ** 2)
    for station in path.cusps:
        squares[round(station / spacing)] = 0.0
    squares[0] = squares[-1] = 0.0
    for k in range(count):
        squares[k + 1] = min(squares[k + 1], squares[k] + 2 * acceleration * spacing)
    for k in range(count)[::-1]:
        squares[k] = min(squares[k], squares[k + 1] + 2 * acceleration * spacing)
    speeds = np.sqrt(squares)
    return (2 * spacing / (speeds[1:] + speeds[:-1])).sum()


def test_a_long_straight_from_rest_to_rest_costs_one_stop_more_than_its_way():
    timed = fastest_profile(straights([30.0, 10.0]), 1.5, 0.5)
    assert timed.end == pytest.approx(40 / 1.5 + 1.5 / 0.5)
    assert timed.speed_at(1.0) == pytest.approx(0.5)


def test_a_short_way_is_a_triangle():
    timed = fastest_profile(straights([2.0]), 3.0, 0.7)
    assert timed.end == pytest.approx(2 * np.sqrt(2.0 / 0.7))
    assert timed.speeds.max() == pytest.approx(np.sqrt(2.0 * 0.7))


def test_it_brakes_before_a_slower_piece_and_speeds_up_behind_it():
    timed = fastest_profile(straights([20.0, 5.0, 30.0]), [2.0, 0.8, 3.0], 0.4)
    starting, braking = 4 / 0.8, (4 - 0.64) / 0.8
    gaining, slowing = (9 - 0.64) / 0.8, 9 / 0.8
    expected = 2.0 / 0.4 + (20 - starting - braking) / 2 + 1.2 / 0.4 + 5 / 0.8
    expected += 2.2 / 0.4 + (30 - gaining - slowing) / 3 + 3.0 / 0.4
    assert timed.end == pytest.approx(expected)
    assert timed.speeds[timed.stations == 20.0] == pytest.approx(0.8)


def test_cusps_are_stops():
    timed = fastest_profile(straights([12.0, 4.0, 9.0], [1, -1, 1]), 1.5, 0.5)
    # Three runs between stops, of which one is too short for 1.5 m/s.
    assert timed.end == pytest.approx(12 / 1.5 + 3 + 2 * np.sqrt(4 / 0.5) + 9 / 1.5 + 3)
    assert timed.speeds[timed.stations == 12.0] == pytest.approx(0.0)


@pytest.mark.parametrize("seed", range(8))
def test_it_is_the_fastest_within_limits(seed):
    rng = np.random.default_rng(seed)
    lengths = np.round(rng.uniform(0.2, 9.0, 12), 1)
    gears = rng.choice([1, 1, -1], 12)
    path = straights(lengths, gears)
    limits, acceleration = rng.uniform(0.4, 4.0, 12), rng.uniform(0.2, 1.2)
    timed = fastest_profile(path, limits, acceleration)
    assert timed.end == pytest.approx(integrated(path, limits, acceleration), rel=2e-3)
    times = np.linspace(0, timed.end, 4001)
    speeds, stations = timed.speed_at(times), timed.station_at(times)
    assert np.abs(np.diff(speeds)).max() <= acceleration * times[1] * (1 + 1e-6)
    inside = np.abs(stations[:, None] - path.stations).min(axis=1) > 1e-6
    assert (speeds[inside] <= limits[path.piece_at(stations[inside])] + 1e-9).all()
    # Stations are the integral of the speeds, between which they change evenly.
    ways = (timed.speeds[1:] + timed.speeds[:-1]) / 2 * np.diff(timed.times)
    assert np.diff(timed.stations) == pytest.approx(ways, abs=1e-9)
    for halt in path.cusps:
        at = np.abs(timed.stations - halt) < 1e-9
        assert timed.speeds[at] == pytest.approx(0.0)


@pytest.mark.parametrize("seed", [2, 15, 16, 25])
def test_stations_never_decrease_where_whole_pieces_are_spent_on_speeding_up(seed):
    # Rounding had one in ten of such paths go back by a few atoms' widths, which was refused.
    lengths = np.random.default_rng(seed).uniform(0.5, 6.0, 12)
    timed = fastest_profile(straights(lengths.tolist()), 6.0, 1.0)
    assert (np.diff(timed.stations) >= 0).all()
    assert timed.stations[-1] == pytest.approx(lengths.sum())


def test_a_bend_limits_the_speed_by_the_acceleration_across():
    angle = np.linspace(0, 1.2, 4)
    arc = np.column_stack([8 * np.sin(angle), 8 - 8 * np.cos(angle), angle])
    poses = np.vstack([[-5.0, 0.0, 0.0], arc])
    path = MachinePath(poses, np.ones(4, int), np.zeros(4, bool), np.zeros(4, int))
    assert cornering_limits(path.curvatures, 6.0, 2.0) == pytest.approx([6.0, 4.0, 4.0, 4.0])


def test_what_cannot_be_driven_is_refused():
    path = straights([3.0])
    with pytest.raises(InvalidInput, match="limits"):
        fastest_profile(path, 0.0, 0.5)
    with pytest.raises(InvalidInput, match="acceleration"):
        fastest_profile(path, 1.0, 0.0)


def test_a_single_pose_takes_no_time():
    none = np.zeros(0, dtype=int)
    path = MachinePath(np.array([[1.0, 2.0, 0.3]]), none, none.astype(bool), none)
    assert fastest_profile(path, 1.0, 0.5).end == 0.0


def test_a_path_of_poses_has_one_gear_or_one_for_each_piece():
    poses = [[0.0, 0.0, 0.1], [3.0, 0.3, 0.1], [1.0, 0.1, 0.1]]
    path = MachinePath.of(poses, gears=[1, -1], cutting=True)
    assert path.gears.tolist() == [1, -1]
    assert path.cutting.tolist() == [True, True]
    assert path.work.tolist() == [0, 0]
    up = MachinePath.of(poses)
    assert up.gears.tolist() == [1, 1]
    assert up.cutting.tolist() == [False, False]
    assert up.cusps.tolist() == []


@pytest.mark.parametrize("shape", [(3,), (0, 3), (2, 4), (2, 2, 3)])
def test_poses_are_rows_of_three(shape):
    none = np.zeros(1, dtype=int)
    with pytest.raises(InvalidInput, match=r"`poses` must be \(n, 3\)"):
        MachinePath(np.zeros(shape), none, none.astype(bool), none)


@pytest.mark.parametrize("name", ["gears", "cutting", "work"])
@pytest.mark.parametrize("count", [1, 3])
def test_each_piece_has_a_gear_a_header_and_a_work(name, count):
    told = {each: np.zeros(2, dtype=int) for each in ("gears", "cutting", "work")}
    MachinePath(np.zeros((3, 3)), **told)
    with pytest.raises(InvalidInput, match=f"`{name}` must be"):
        MachinePath(np.zeros((3, 3)), **{**told, name: np.zeros(count, dtype=int)})


def test_a_piece_begins_at_its_station():
    path = straights([2.0, 0.5, 3.0], [1, -1, 1])
    at = [-1.0, 0.0, 1.9, 2.0, 2.4, 2.5, 5.4, 5.5, 9.0]
    assert path.piece_at(at).tolist() == [0, 0, 0, 1, 1, 2, 2, 2, 2]
    piece, driven, share = path.share_at(np.array([1.5, 2.2, 5.5]))
    assert piece.tolist() == [0, 1, 2]
    assert driven == pytest.approx([1.5, 0.2, 3.0])
    assert share == pytest.approx([0.75, 0.4, 1.0])
    # A piece of no length has no share, and no curvature, though it turns.
    turning = MachinePath.of([[1.0, 2.0, 0.3], [1.0, 2.0, 0.8], [4.0, 2.0, 0.8]])
    assert turning.curvatures.tolist() == [0.0, 0.0]
    assert turning.pose_at(0.0) == pytest.approx([1.0, 2.0, 0.8])
    standing = MachinePath.of([[1.0, 2.0, 0.3], [1.0, 2.0, 0.3]])
    assert standing.share_at(np.array([0.0]))[2].tolist() == [0.0]


@pytest.mark.parametrize(
    ("length", "spacing", "count"),
    [(6.0, 2.0, 3), (6.0 + 1e-10, 2.0, 3), (6.0 + 1e-8, 2.0, 4), (5.9, 2.0, 3), (0.3, 2.0, 1)],
)
def test_stations_are_no_farther_apart_than_asked_but_for_rounding(length, spacing, count):
    at = straights([length]).stations_every(spacing)
    assert at == pytest.approx(np.linspace(0.0, length, count + 1))
    assert len(at) == count + 1


def test_a_twist_turns_evenly_and_moves_along_its_heading():
    rng = np.random.default_rng(4)
    for _ in range(20):
        start, length, turn = rng.uniform(-3, 3, 3), rng.uniform(0.5, 9), rng.uniform(-3, 3)
        steps = 20_000
        middles = (np.arange(steps) + 0.5) / steps
        headings = start[2] + turn * middles
        walked = np.cumsum(np.column_stack([np.cos(headings), np.sin(headings)]), axis=0)
        place = start[:2] + length / steps * walked
        end = np.append(place[-1], start[2] + turn)
        part = int(0.37 * steps)
        found = poses_between(start, end, np.float64(0.37), np.float64(0.37 * length))
        assert found == pytest.approx([*place[part - 1], start[2] + 0.37 * turn], abs=1e-6)


def test_corners_are_rounded_by_arcs_from_half_of_the_shorter_edge():
    points = np.array([[1.0, 2.0], [9.0, 2.0], [9.0, 6.0], [6.0, 9.0], [3.0, 12.0], [-3.0, 12.0]])
    path = rounded_path(points, cutting=True)
    assert path.cutting.all()
    # Half of the shorter edge is 2.0, 2.0, and 2.1213; the fourth point is no corner.
    diagonal = 3 / np.sqrt(2)
    half = np.array([diagonal, diagonal]) / np.sqrt(2)
    expected = [
        [1.0, 2.0],
        [7.0, 2.0],
        [9.0, 4.0],
        [9.0, 4.0],
        [9.0 - np.sqrt(2), 6.0 + np.sqrt(2)],
        [3.0 + half[0], 12.0 - half[1]],
        [3.0 - diagonal, 12.0],
        [-3.0, 12.0],
    ]
    headings = np.array([0.0, 0.0, 2.0, 2.0, 3.0, 3.0, 4.0, 4.0]) * np.pi / 4
    kept = [0, 1, 2, 4, 5, 6, 7]
    np.testing.assert_allclose(path.poses, np.column_stack([expected, headings])[kept], atol=1e-9)
    assert path.curvatures[[1, 2, 4]] == pytest.approx(
        [1 / 2, np.tan(np.pi / 8) / 2, np.tan(np.pi / 8) / diagonal]
    )


def test_points_in_one_place_are_a_path_of_no_length():
    path = rounded_path(np.array([[3.0, 4.0], [3.0, 4.0]]))
    assert path.poses[:, :2].tolist() == [[3.0, 4.0], [3.0, 4.0]]
    assert not path.cutting.any()


@pytest.mark.parametrize(("off", "fits"), [(0.9e-6, True), (1.1e-6, False)])
def test_joined_paths_meet_to_a_micrometre(off, fits):
    first, second = straights([4.0]), straights([2.0])
    poses = second.poses + first.poses[-1] - second.poses[0] + np.array([off, 0.0, 4 * np.pi])
    second = MachinePath.of(poses)
    if fits:
        joined = join_paths([first, second])
        assert joined.poses[:, 2] == pytest.approx(np.full(3, first.poses[0, 2]))
        return
    with pytest.raises(InvalidInput, match="begin where the one before ends"):
        join_paths([first, second])
    with pytest.raises(InvalidInput, match="`paths` must be at least one"):
        join_paths([])


def test_times_stations_and_speeds_are_as_many_and_may_repeat():
    three = np.array([1.0, 1.0, 4.0])
    timed = TimedPath(STRAIGHT, three, np.array([2.0, 2.0, 2.0]), np.zeros(3))
    assert timed.station_at([0.0, 1.0, 2.5, 9.0]) == pytest.approx([2.0] * 4)
    assert timed.speed_at([1.0, 4.0]).tolist() == [0.0, 0.0]
    for name in ("stations", "speeds"):
        told = {"times": three, "stations": np.ones(3), "speeds": np.ones(3), name: np.ones(2)}
        with pytest.raises(InvalidInput, match=f"`{name}` must have shape"):
            TimedPath(STRAIGHT, **told)
    for times in (np.zeros(0), np.zeros((1, 1))):
        with pytest.raises(InvalidInput, match=r"`times` must be \(k,\)"):
            TimedPath(STRAIGHT, times, times, times)
    # At the moments themselves it drives, before and after it stands.
    moving = TimedPath(STRAIGHT, np.array([1.0, 3.0]), np.array([0.0, 5.0]), np.array([2.0, 3.0]))
    assert moving.speed_at([0.99, 1.0, 2.0, 3.0, 3.01]) == pytest.approx([0, 2, 2.5, 3, 0])


def test_the_speed_in_bends_is_bounded_on_straights_too():
    assert cornering_limits(np.array([0.0, -1e-9]), 1e9, 2.0) == pytest.approx([2e6**0.5] * 2)
    assert cornering_limits(np.array([-0.5, 0.08]), 3.0, 0.5) == pytest.approx([1.0, 2.5])


def test_runs_are_told_by_their_first_and_one_after_their_last():
    assert runs_of(np.array([1, 1, 0, 0, 1, 0, 1])) == [(0, 2), (4, 5), (6, 7)]
    assert runs_of(np.zeros(3)) == []
    assert runs_of(np.zeros(0)) == []
    assert runs_of(np.ones(2)) == [(0, 2)]


def test_squared_speeds_are_lowered_no_more_than_gains_ask_for():
    rng = np.random.default_rng(9)
    for size in (1, 2, 7, 30):
        squares, gains = rng.uniform(0, 9, size), rng.uniform(0.1, 2, size - 1)
        at = np.concatenate([[0.0], np.cumsum(gains)])
        expected = (squares + np.abs(at[:, None] - at)).min(axis=1)
        keep_acceleration(squares, gains)
        assert squares == pytest.approx(expected)
