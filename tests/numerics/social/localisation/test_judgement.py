"""Which poses and places are kept, joined and believed: just within each limit and just beyond."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.forward_camera import ForwardCamera
from sightfield.systems.numerics.social.landmarks.maze import MarkerBlock
from sightfield.systems.numerics.social.localisation import location, relative
from sightfield.systems.numerics.social.localisation.location import (
    CameraPose,
    Outcome,
    _average,
    _fit,
    _in_world,
    _judge,
    camera_poses,
    locate_evader,
    nearest_free,
)
from sightfield.systems.numerics.social.localisation.relative import (
    EvaderPlace,
    Relative,
    _faces,
    evader_place,
    relative_poses,
)
from sightfield.systems.numerics.social.recognition.matching import Matches
from sightfield.systems.numerics.social.recognition.recognition import Recognition, Stance

WORLD = make_world([[0, 0], [4, 0], [4, 3], [0, 3]], [[[1.5, 1], [2, 1], [2, 2], [1.5, 2]]])
BLOCK = MarkerBlock()
ROOM = SimpleNamespace(
    world=WORLD,
    marker=BLOCK,
    camera=ForwardCamera(),
    landmark=lambda number: SimpleNamespace(side=0.2, middle_height=0.2, number=number),
)


def pose(x, y, heading=0.0, cost=0.0, used=(1,), spread=1e-4):
    return CameraPose(np.array([x, y, heading]), spread * np.eye(3), cost, used)


@pytest.fixture
def fits(monkeypatch):
    """A function of poses: those that all fits come to."""

    def use(*poses):
        single = [SimpleNamespace(pose=each) for each in poses]
        monkeypatch.setattr(location, "relative_poses", lambda *_: single)
        monkeypatch.setattr(location, "_placed", lambda landmark, each: each)
        monkeypatch.setattr(location, "_fit", lambda maze, landmarks, start: start)
        found = camera_poses(ROOM, [SimpleNamespace(subject=1)], "level")
        return [(each.pose[0], each.cost) for each in found]

    return use


def test_poses_that_are_alike_outside_or_much_worse_are_dropped(fits):
    assert fits(pose(0.5, 0.5, cost=30.0), pose(3.0, 0.5, cost=5.1)) == [(3.0, 5.1), (0.5, 30.0)]
    assert fits(pose(0.5, 0.5, cost=30.2), pose(3.0, 0.5, cost=5.1)) == [(3.0, 5.1)]
    for apart, kept in ((0.0099, 1), (0.0101, 2)):
        assert len(fits(pose(0.5, 0.5), pose(0.5 + apart, 0.5, cost=1.0))) == kept
        assert len(fits(pose(0.5, 0.5), pose(0.5, 0.5 - apart, cost=1.0))) == kept
        turned = pose(0.5, 0.5, math.pi - 0.4 * apart)
        assert len(fits(turned, pose(0.5, 0.5, 0.6 * apart - math.pi, cost=1.0))) == kept
    for inside, kept in ((0.0499, 1), (0.0501, 0)):
        assert len(fits(pose(-inside, 0.5))) == kept
    assert fits(None, pose(0.5, 0.5)) == [(0.5, 0.0)]


def test_landmarks_that_agree_are_averaged_by_their_information():
    single = [
        pose(1.0, 1.0, 0.1, cost=1.0, used=(1,), spread=0.01),
        pose(1.2, 1.0, 0.1, cost=2.0, used=(2,), spread=0.02),
        pose(9.0, 9.0, 0.1, cost=0.0, used=(2,), spread=0.02),
        pose(5.0, 1.0, 0.1, cost=0.0, used=(3,), spread=0.02),
    ]
    found = _average(single, single[0])
    assert found.used == (1, 2)
    # Of twice the variance it counts half.
    assert found.pose == pytest.approx([1.0 + 0.2 / 3, 1.0, 0.1], abs=1e-6)
    assert np.diag(found.covariance) == pytest.approx(1 / (100 + 50), rel=1e-5)
    second, third = 2.0 + 0.04 / 0.03, 16.0 / 0.03
    robust = sum(60 * each / (60 + each) for each in (1.0, second, third))
    assert found.cost == pytest.approx(robust, rel=1e-5)
    # What is farther off than the square of 60 is not used, and neither is anything else.
    for square, used in ((59.9, (1, 2)), (60.1, (1,))):
        off = math.sqrt(square * 0.03)
        other = pose(1.0 + off, 1.0, 0.1, used=(2,), spread=0.02)
        assert _average([single[0], other], single[0]).used == used
    assert _average([pose(1, 1, cost=60.1)], pose(1, 1)) is None


def test_evaders_beyond_the_world_are_believed_as_far_as_their_doubt_goes():
    camera = pose(0.5, 0.5)
    depth = BLOCK.depth

    def outcome(x, y, deviation):
        return _judge(ROOM, camera, np.array([x, y]), deviation**2 * np.diag([0.2, 1.0]))

    for deviation in (0.01, 0.05):
        limit = 3 * deviation + depth
        assert outcome(1.0, -(limit - 0.001), deviation) == Outcome.LOCATED
        assert outcome(1.0, -(limit + 0.001), deviation) == Outcome.EVADER_OUTSIDE
    # And never farther than 0.3 m.
    assert outcome(1.0, -0.299, 0.2) == Outcome.LOCATED
    assert outcome(1.0, -0.301, 0.2) == Outcome.EVADER_OUTSIDE


def test_evaders_behind_a_wall_are_believed_if_they_may_be_beside_it():
    camera = pose(0.5, 1.5)

    def outcome(y, deviation):
        return _judge(ROOM, camera, np.array([3.0, y]), deviation**2 * np.eye(2))

    # The wall's shadow at 3 m ends where the lines past its corners come to.
    edge = 1.5 + (2.0 - 1.5) / (1.5 - 0.5) * 2.5
    assert outcome(edge + 0.01, 0.001) == Outcome.LOCATED
    # Across the line of sight the shadow is narrower than along the wall.
    for deviation in (0.001, 0.02):
        reach = BLOCK.radius + 3 * deviation
        ends = []
        for y in np.linspace(edge, edge - 0.5, 501):
            if outcome(y, deviation) != Outcome.LOCATED:
                break
            ends.append(y)
        way = np.array([2.5, ends[-1] - 1.5])
        aside = reach * np.array([-way[1], way[0]]) / np.hypot(*way)
        seen = np.array([3.0, ends[-1]]) + aside
        slope = (seen[1] - 1.5) / (seen[0] - 0.5)
        assert slope == pytest.approx(0.5, abs=2e-3)


def test_places_turn_with_the_camera_and_so_do_their_doubts():
    camera = pose(1.0, 2.0, 0.6, spread=0.0)
    place = EvaderPlace(np.array([2.0, 0.5]), np.diag([0.04, 0.01]), 1)
    position, covariance = _in_world(camera, place)
    c, s = math.cos(0.6), math.sin(0.6)
    turn = np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(position, [1.0, 2.0] + turn @ [2.0, 0.5])
    # With what no camera is surer than: two millimetres, and a milliradian.
    across = turn @ [-0.5, 2.0]
    least = 4e-6 * np.eye(2) + 1e-6 * np.outer(across, across)
    np.testing.assert_allclose(covariance, turn @ place.covariance @ turn.T + least, rtol=1e-5)


@pytest.fixture
def locate(monkeypatch):
    """A function of poses, places in the world and their variances: what is located."""

    def find(poses, places, variance=1e-4):
        monkeypatch.setattr(location, "camera_poses", lambda *_: list(poses))
        place = EvaderPlace(np.zeros(2), np.eye(2), 2)
        monkeypatch.setattr(location, "evader_place", lambda *_: place)
        told = iter(places)
        monkeypatch.setattr(
            location, "_in_world", lambda *_: (np.array(next(told)), variance * np.eye(2))
        )
        upright = SimpleNamespace(stance=Stance.UPRIGHT, subject=1)
        marker = SimpleNamespace(stance=Stance.UPRIGHT, subject=-1)
        empty = Matches(np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2)))
        return locate_evader(Recognition((upright, marker), empty), ROOM)

    return find


def test_places_from_several_poses_are_weighed_by_their_costs(locate):
    poses = [pose(0.5, 0.5, cost=1.0), pose(0.6, 0.5, cost=5.0), pose(0.5, 0.6, cost=0.0)]
    found = locate(poses, [(0.8, 0.5), (0.9, 0.5), (9.0, 9.0)])
    second = math.exp(-0.5 * 4.0 / 4.0)
    share = second / (1 + second)
    assert found.position == pytest.approx([0.8 + 0.1 * share, 0.5])
    spread = 1e-4 + 0.01 * share * (1 - share)
    assert found.covariance == pytest.approx(np.diag([spread, 1e-4]))
    assert (found.outcome, found.copies) == (Outcome.LOCATED, 2)
    assert found.camera is poses[0]
    assert locate(poses[2:], [(9.0, 9.0)]).outcome == Outcome.EVADER_OUTSIDE


def test_a_place_that_is_surer_than_half_a_metre_counts(locate):
    for deviation, outcome in ((0.499, Outcome.LOCATED), (0.501, Outcome.TOO_UNSURE)):
        assert locate([pose(0.5, 0.5)], [(0.8, 0.5)], deviation**2).outcome == outcome
    wall = locate([pose(0.5, 0.5)], [(0.8, -0.05)])
    assert (wall.outcome, wall.position.tolist()) == (Outcome.AT_A_WALL, [0.8, 0.0])
    assert wall.outcome.has_location
    assert not Outcome.NO_PICTURE.has_location
    assert Outcome.AT_A_WALL.words == "at a wall"
    assert nearest_free(ROOM, np.array([1.6, 1.5])) == pytest.approx([1.5, 1.5])


def test_sides_of_a_block_that_agree_are_joined(monkeypatch):
    for square, copies in ((24.9, 2), (25.1, 1)):
        off = math.sqrt(square * 0.03)
        told = iter(
            [
                EvaderPlace(np.array([1.0 + off, 0.5]), 0.02 * np.eye(2), 1),
                None,
                EvaderPlace(np.array([1.0, 0.5]), 0.01 * np.eye(2), 1),
            ]
        )
        monkeypatch.setattr(relative, "_by_pose", lambda *_, told=told: next(told))
        found = evader_place(ROOM.camera, BLOCK, [None] * 3, "level")
        assert found.copies == copies
        moved = off / 3 if copies == 2 else 0.0
        assert found.place == pytest.approx([1.0 + moved, 0.5])
        assert np.diag(found.covariance) == pytest.approx(1 / 150 if copies == 2 else 0.01)


def test_poses_of_one_square_that_are_alike_are_one_and_the_cheaper_comes_first(monkeypatch):
    seen = SimpleNamespace(corners=np.zeros((4, 2)), covariance=np.eye(8))
    monkeypatch.setattr(relative, "starting_poses", lambda *_: [0, 1])
    for apart, kept in ((0.00099, 1), (0.00101, 2)):
        found = [
            Relative(np.array([1.0, 0.0, 3.0]), np.eye(3), 2.0),
            Relative(np.array([1.0, 0.0, 3.0 + apart]), np.eye(3), 1.0),
        ]
        monkeypatch.setattr(relative, "_fitted", lambda *words, found=found: found[words[-1]])
        costs = [each.cost for each in relative_poses(None, seen, 0.2, 0.2, "level")]
        assert costs == ([2.0] if kept == 1 else [1.0, 2.0])


def test_a_square_faces_the_camera_from_which_it_is_seen():
    for facing, good in ((math.pi / 2 + 0.01, True), (math.pi / 2 - 0.01, False)):
        assert bool(_faces(np.array([1.0, 0.0, facing]))) is good
        assert bool(_faces(np.array([1.0, 0.0, -facing]))) is good
    assert not _faces(np.array([-1.0, 0.0, 0.0]))
    assert not _faces(np.array([0.0, 1.0, -math.pi / 2]))
    assert _faces(np.array([1.0, 1.0, -math.pi / 2]))


def test_nothing_that_fits_is_no_pose(maze, detect, look):
    seen = look([1.25, 1.0, 0.9], [1]).landmarks
    behind = np.array([1.25, 1.0, 0.9 + math.pi])
    assert _fit(maze, seen, behind) is None
    far = detect(1, seen[0].corners + 300.0, 0.01)
    assert _fit(maze, [far], np.array([1.25, 1.0, 0.9])) is None
