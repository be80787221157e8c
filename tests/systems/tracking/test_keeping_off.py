"""The systems that keep robots off one another: whose radii, and which ports."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.tracking.collision_avoidance import CollisionAvoidance, CollisionStop

ROOM = make_world([[-9, -9], [9, -9], [9, 9], [-9, 9]])
PERIOD = 0.5
NEARLY = 1e-5


def make_avoidance(count=2, **options):
    return CollisionAvoidance([ROOM], count=count, period=PERIOD, top_speed=0.3, **options)


def make_stop(count=2, **options):
    limits = {"top_speed": 0.3, "top_turn_rate": 2.0}
    return CollisionStop([ROOM], count=count, period=PERIOD, **limits, **options)


def output_of(system, **inputs):
    """What the first output is while inputs stay."""
    context = system.CreateDefaultContext()
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, np.ravel(value).astype(float))
    return np.asarray(system.get_output_port(0).Eval(context)).reshape(-1, 2)


@pytest.mark.parametrize("make", [make_avoidance, make_stop])
def test_the_port_for_others_is_there_where_there_are_others(make):
    assert not make(radii=0.1).HasInputPort("other_position")
    assert not make(radii=0.1, other_radii=[]).HasInputPort("other_position")
    assert make(other_radii=[0.1, 0.1, 0.1]).GetInputPort("other_position").size() == 6


@pytest.mark.parametrize("make", [make_avoidance, make_stop])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"radii": -0.1}, "`radii` must be zero or positive; got -0.1"),
        ({"radii": [0.1, -0.2]}, "`radii` must be zero or positive; got -0.2"),
        ({"radii": [0.1, 0.1, 0.1]}, r"`radii` must have 2 entries; got \(3,\)"),
        ({"radii": [[0.1], [0.1]]}, r"`radii` must have 2 entries; got \(2, 1\)"),
        ({"radii": float("nan")}, "`radii` must be "),
        ({"other_radii": [0.1, -0.3]}, "`other_radii` must be zero or positive; got -0.3"),
        ({"count": 0}, "`count` must be a whole number of at least 1; got 0"),
    ],
)
def test_radii_that_no_body_has_are_refused(make, options, message):
    with pytest.raises(InvalidInput, match=message):
        make(**options)


def test_a_horizon_shorter_than_a_period_is_refused():
    with pytest.raises(InvalidInput, match=r"`horizon` must be at least the period of 0\.5 s"):
        make_stop(horizon=0.4)


def test_each_robot_that_stops_has_its_own_radius():
    # Two that look at each other 1 m apart, one of them by 0.1 m and one by 0.3 m wide.
    poses = [[0, 0, 0], [1, 0, np.pi]]
    commands = [[0.3, 0], [0.3, 0]]
    # 0.6 m between them, half of it each, in no less than 4 s.
    safe = output_of(make_stop(radii=[0.1, 0.3], horizon=4.0), pose=poses, command=commands)
    assert safe[:, 0] == pytest.approx([0.075, 0.075], rel=NEARLY)
    # A stranger before the second only: 0.2 m between bodies of 0.3 m and 0.5 m.
    safe = output_of(
        make_stop(radii=[0.1, 0.3], other_radii=[0.5], horizon=4.0),
        pose=[[0, 0, np.pi], [5, 0, 0]],
        command=commands,
        other_position=[6, 0],
    )
    assert safe[:, 0] == pytest.approx([0.3, 0.025], rel=NEARLY)


def test_one_radius_stands_for_all():
    poses, commands = [[0, 0, 0], [1, 0, np.pi]], [[0.3, 0], [0.3, 0]]
    one = output_of(make_stop(radii=0.2, horizon=4.0), pose=poses, command=commands)
    each = output_of(make_stop(radii=[0.2, 0.2], horizon=4.0), pose=poses, command=commands)
    np.testing.assert_array_equal(one, each)


@pytest.mark.parametrize(("radii", "contact"), [([0.05, 0.25], 0.3), ([0.25, 0.05], 0.3)])
def test_points_that_run_at_each_other_stop_at_the_sum_of_their_own_radii(radii, contact):
    lane = make_world([[-2, -0.26], [2, -0.26], [2, 0.26], [-2, 0.26]])
    system = CollisionAvoidance(
        shrink_world(lane, 0.25), count=2, period=PERIOD, top_speed=0.3, radii=radii
    )
    at = np.array([[-0.5, 0.0], [0.5, 0.0]])
    for _ in range(40):
        at += PERIOD * output_of(system, position=at, velocity=[[0.3, 0], [-0.3, 0]])
    distance = np.hypot(*(at[0] - at[1]))
    assert contact < distance < 1.15 * contact


def test_points_keep_off_strangers_by_the_strangers_radii():
    lane = make_world([[-3, -0.11], [3, -0.11], [3, 0.11], [-3, 0.11]])
    system = CollisionAvoidance(
        shrink_world(lane, 0.1),
        count=1,
        period=PERIOD,
        top_speed=0.3,
        radii=[0.1],
        other_radii=[0.2, 0.4],
    )
    strangers = [[-2, 0], [2, 0]]
    for direction, contact in ((-1, 0.3), (1, 0.5)):
        at = np.zeros((1, 2))
        for _ in range(40):
            velocity = [[0.3 * direction, 0.0]]
            at += PERIOD * output_of(
                system, position=at, velocity=velocity, other_position=strangers
            )
        assert contact < np.hypot(*(at[0] - [2.0 * direction, 0.0])) < 1.15 * contact


@pytest.mark.parametrize("make", [make_avoidance, make_stop])
def test_only_a_team_that_is_yielded_to_is_told_who_has_the_right_of_way(make):
    assert not make(radii=0.1).HasInputPort("right_of_way")
    assert not make(radii=0.1, rank=-1).HasInputPort("right_of_way")
    assert make(radii=0.1, rank=1).GetInputPort("right_of_way").size() == 2
    with pytest.raises(InvalidInput, match="`rank` must be one of -1, 0, 1; got 2"):
        make(rank=2)
    with pytest.raises(InvalidInput, match="`pace` must be positive"):
        make(rank=-1, pace=0.0)


def deflection_of(system, **inputs):
    context = system.CreateDefaultContext()
    for name, value in inputs.items():
        system.GetInputPort(name).FixValue(context, np.ravel(value).astype(float))
    return np.asarray(system.GetOutputPort("deflection").Eval(context))


def test_deflection_is_how_far_a_velocity_is_from_what_was_asked():
    # The first is stopped half of the gap of 0.1 m from the second, which goes away.
    system = make_avoidance(radii=[0.1, 0.1])
    positions, wishes = [[0.0, 0.0], [0.3, 0.0]], [[0.28, 0.0], [0.0, 0.2]]
    safe = output_of(system, position=positions, velocity=wishes)
    found = deflection_of(system, position=positions, velocity=wishes)
    assert found == pytest.approx(np.hypot(*(safe - wishes).T))
    assert found[0] > 0.05
    far = [[0.0, 0.0], [3.0, 0.0]]
    assert deflection_of(system, position=far, velocity=wishes) == pytest.approx([0, 0], abs=1e-12)


def test_who_has_the_right_of_way_is_not_deflected_by_a_teammate_in_its_path():
    system = make_avoidance(radii=[0.1, 0.1], rank=1)
    inputs = {"position": [[0.0, 0.0], [0.35, 0.01]], "velocity": [[0.3, 0.0], [0.0, 0.0]]}
    assert deflection_of(system, **inputs, right_of_way=[0, 0])[0] > 0.01
    first = output_of(system, **inputs, right_of_way=[1, 0])
    assert first[0] == pytest.approx([0.3, 0.0])
    # The other is pushed along.
    assert first[1, 0] > 0.2


def test_a_drive_is_slowed_by_how_much_it_says():
    system = make_stop(radii=[0.1, 0.1])
    poses, commands = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]], [[0.28, 0.1], [0.2, 0.0]]
    safe = output_of(system, pose=poses, command=commands)
    found = deflection_of(system, pose=poses, command=commands)
    assert found == pytest.approx([0.28 - safe[0, 0], 0.0])
    assert found[0] > 0.1
