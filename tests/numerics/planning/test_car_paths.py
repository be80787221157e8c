"""Dubins and Reeds-Shepp paths lead where they should, and nothing is shorter."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.planning.car_paths import (
    CarPath,
    advance,
    dubins_lengths,
    dubins_paths,
    reeds_shepp_lengths,
    reeds_shepp_paths,
)

ORIGIN = (0.0, 0.0, 0.0)
BOTH = pytest.mark.parametrize(
    ("paths", "lengths"),
    [(dubins_paths, dubins_lengths), (reeds_shepp_paths, reeds_shepp_lengths)],
    ids=["dubins", "reeds-shepp"],
)


def random_poses(count, seed=1):
    return np.random.default_rng(seed).uniform([-5, -5, -7], [5, 5, 7], size=(count, 3))


def random_ends(count, reverse, seed=2):
    """Ends of random paths from the origin with radius 1, and the lengths of these paths."""
    random = np.random.default_rng(seed)
    poses, driven = np.zeros((count, 3)), np.zeros(count)
    for _ in range(6):
        ways = random.normal(size=count) * random.choice([0, 0.3, 1, 3], size=count)
        ways = ways if reverse else np.abs(ways)
        poses = advance(poses, random.integers(-1, 2, size=count).astype(float), ways)
        driven += np.abs(ways)
    return poses, driven


@BOTH
def test_every_word_ends_at_its_goal_and_the_first_is_the_shortest(paths, lengths):
    start, radius, words = (0.3, -0.2, 0.7), 1.3, set()
    ends = random_poses(150)
    for end, least in zip(ends, lengths(start, ends, radius), strict=True):
        found = paths(start, end, radius)
        for path in found:
            np.testing.assert_allclose(path.end[:2], end[:2], atol=1e-9)
            assert math.remainder(path.end[2] - end[2], math.tau) == pytest.approx(0, abs=1e-9)
            words.add(path.word.replace("-", ""))
        assert [each.length for each in found] == sorted(each.length for each in found)
        assert found[0].length == pytest.approx(least)
    expected = {"LSL", "RSR", "LSR", "RSL", "LRL", "RLR"}
    assert words == expected if paths is dubins_paths else words > expected


@pytest.mark.parametrize(
    ("lengths", "reverse"),
    [(dubins_lengths, False), (reeds_shepp_lengths, True)],
    ids=["dubins", "reeds-shepp"],
)
def test_no_random_path_is_shorter(lengths, reverse):
    ends, driven = random_ends(20_000, reverse)
    least = lengths(ORIGIN, ends, 1.0)
    assert np.all(least <= driven + 1e-9)
    # Nor is it shorter than the turn and the straight way.
    turns = np.abs(np.remainder(ends[:, 2] + math.pi, math.tau) - math.pi)
    assert np.all(least >= np.maximum(turns, np.hypot(ends[:, 0], ends[:, 1])) - 1e-9)


@pytest.mark.parametrize(
    "turns", [(1,), (0,), (1, -1), (1, 0), (0, -1), (1, 0, 1), (1, 0, -1)], ids=str
)
@pytest.mark.parametrize("scale", [1, 1e-3, 1e-6, 1e-9])
def test_words_that_lack_an_arc_are_no_longer_for_rounding(turns, scale):
    random = np.random.default_rng(5)
    start, radius = (0.37, -1.3, 0.9), 1.7
    ends, driven = np.tile(start, (2000, 1)), np.zeros(2000)
    for turn in turns:
        ways = random.uniform(0, 3, size=2000) * (1 if turn else scale)
        ends = advance(ends, turn / radius, ways)
        driven += ways
    for lengths in (dubins_lengths, reeds_shepp_lengths):
        assert np.all(lengths(start, ends, radius) <= driven + 1e-9)
    for paths in (dubins_paths, reeds_shepp_paths):
        for end in ends[:20]:
            found = np.array(paths(start, end, radius)[0].end)
            np.testing.assert_allclose(found[:2], end[:2], atol=1e-9)
            assert math.remainder(found[2] - end[2], math.tau) == pytest.approx(0, abs=1e-9)


def test_the_thesis_case_has_the_known_dubins_length():
    path = dubins_paths((1, 1, 0), (4, 4, 0), 1.0)[0]
    assert path.word == "LSR"
    assert path.length == pytest.approx(4.46243, abs=5e-6)


@pytest.mark.parametrize(
    ("lengths", "end", "known"),
    [
        (dubins_lengths, (3, 0, 0), 3),
        (dubins_lengths, (0, 2, math.pi), math.pi),
        (dubins_lengths, (0, 0, math.pi), 7 * math.pi / 3),
        (reeds_shepp_lengths, (-3, 0, 0), 3),
        (reeds_shepp_lengths, (0, 0, math.pi), math.pi),
        (reeds_shepp_lengths, (1, 1, math.pi / 2), math.pi / 2),
        (reeds_shepp_lengths, (-1, 1, -math.pi / 2), math.pi / 2),
    ],
)
def test_simple_moves_have_the_lengths_one_sees(lengths, end, known):
    assert lengths(ORIGIN, np.array([end]), 1.0)[0] == pytest.approx(known)


@BOTH
def test_lengths_do_not_depend_on_the_frame_and_scale_with_the_radius(paths, lengths):
    ends = random_poses(200)
    least = lengths(ORIGIN, ends, 1.0)
    c, s = math.cos(0.8), math.sin(0.8)
    moved = np.stack(
        [
            2 + c * ends[:, 0] - s * ends[:, 1],
            -1 + s * ends[:, 0] + c * ends[:, 1],
            ends[:, 2] + 0.8,
        ],
        axis=1,
    )
    np.testing.assert_allclose(lengths((2.0, -1.0, 0.8), moved, 1.0), least, rtol=1e-9)
    scaled = ends * [2.5, 2.5, 1.0]
    np.testing.assert_allclose(lengths(ORIGIN, scaled, 2.5), 2.5 * least, rtol=1e-9)


@BOTH
def test_lengths_are_those_of_the_mirror_image_and_of_the_way_back(paths, lengths):
    ends = random_poses(200)
    least = lengths(ORIGIN, ends, 1.0)
    np.testing.assert_allclose(lengths(ORIGIN, ends * [1, -1, -1], 1.0), least, rtol=1e-9)
    # Driven from the end to the start with both headings turned round, the path is the same.
    for end, length in zip(ends[:50], least[:50], strict=True):
        x, y, theta = end
        back = lengths((x, y, theta + math.pi), np.array([[0, 0, math.pi]]), 1.0)[0]
        assert back == pytest.approx(length, rel=1e-9)


def test_with_reverse_time_can_run_backwards():
    ends = random_poses(200)
    np.testing.assert_allclose(
        reeds_shepp_lengths(ORIGIN, ends * [-1, 1, -1], 1.0),
        reeds_shepp_lengths(ORIGIN, ends, 1.0),
        rtol=1e-9,
    )


def test_poses_along_a_path_are_as_far_apart_as_their_distances():
    path = CarPath((1.0, 2.0, 0.5), (1, 0, -1), (1.0, -2.0, 0.5), 2.0)
    assert path.word == "LS-R"
    assert path.length == 3.5
    poses = path.poses(np.linspace(0, 3.5, 3501))
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    np.testing.assert_allclose(steps, 1e-3, rtol=1e-6)
    np.testing.assert_allclose(poses[0], path.start)
    np.testing.assert_allclose(poses[-1], path.end)
    np.testing.assert_allclose(np.ptp(poses[:, 2]), 0.5)


@pytest.mark.parametrize("paths", [dubins_paths, reeds_shepp_paths])
def test_a_radius_must_be_positive(paths):
    with pytest.raises(InvalidInput, match="radius"):
        paths(ORIGIN, (1, 1, 0), 0.0)
