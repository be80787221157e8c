"""What the rules of a game of tracking say exactly at their limits, and just beside them."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking import collision_avoidance, corner_policies, lookahead
from sightfield.systems.numerics.tracking.adversarial_evasion import (
    adversarial_velocities,
    corner_stance,
)
from sightfield.systems.numerics.tracking.assignment.holding import hold_or_choose
from sightfield.systems.numerics.tracking.assignment.matching import nearer_first
from sightfield.systems.numerics.tracking.assignment.team_view import TeamView, names_evaders
from sightfield.systems.numerics.tracking.assignment.voting import kemeny_scores
from sightfield.systems.numerics.tracking.collision_avoidance import avoid
from sightfield.systems.numerics.tracking.collision_stop import (
    MARGIN,
    count_contacts,
    gap_to_paths,
    gap_to_runners,
    gaps_between_samples,
    half_gap_part,
    still_waiting,
    stop_at_walls,
    take_turns,
)
from sightfield.systems.numerics.tracking.corner_game import (
    HIDDEN,
    IN_STAR,
    REGION_1,
    REGION_2,
    REGION_3,
    REGION_4,
    REGION_5,
    corner_table,
    dash,
    escape_time,
    margins,
    region,
    to_corner_frame,
)
from sightfield.systems.numerics.tracking.corner_policies import (
    FARTHEST,
    evader_policy,
    inside_obstacle,
    margin_field,
    require_near,
    table_evader_policy,
    table_field,
)
from sightfield.systems.numerics.tracking.mobile_agents import turn_first_command
from sightfield.systems.numerics.tracking.risk import RISK_VECTORS, risk_weights, team_risk
from sightfield.systems.numerics.tracking.sight_state import sight_size
from sightfield.systems.numerics.tracking.team_pursuit import modified_velocities

OPEN = build_edge_index(make_world([(-20, -20), (20, -20), (20, 20), (-20, 20)]))
PERIOD = 0.05


def flat(values):
    return np.ravel(np.array(values, dtype=float))


def avoided(positions, velocities, radii, others=(), other_radii=(), top_speed=1.0, region=OPEN):
    count = len(radii)
    return avoid(
        *region,
        flat(positions),
        flat(velocities),
        flat(radii),
        flat(others),
        flat(other_radii),
        np.zeros(count),
        np.zeros(count, dtype=bool),
        0,
        0.2,
        0.5,
        top_speed,
        PERIOD,
    ).reshape(-1, 2)


def test_points_without_bodies_do_as_they_wish():
    wishes = np.array([[3.0, 0.0], [0.0, -2.0]])
    assert avoided([[0, 0], [0.1, 0]], wishes, [0, 0]) == pytest.approx(wishes)
    alone = avoided([[0, 0]], wishes[:1], [0], [[0.1, 0.0]], [0.0])
    assert alone == pytest.approx(wishes[:1])


def test_only_who_has_somebody_near_is_kept_to_the_top_speed():
    away = [[-3.0, 0.0], [3.0, 0.0]]
    for apart, pace in ((1.0, 3.0), (1.0 - 1e-6, 0.25)):
        found = avoided([[0, 0], [apart, 0]], away, [0.25, 0.25], top_speed=0.25)
        assert abs(found[:, 0]) == pytest.approx([pace, pace])
    # To strangers there is half a metre of room.
    for apart, pace in ((0.75, 3.0), (0.75 - 1e-6, 0.25)):
        stranger = [[apart, 0.0]], [0.125]
        found = avoided([[0, 0]], away[:1], [0.125], *stranger, top_speed=0.25)
        assert abs(found[0, 0]) == pytest.approx(pace)


def test_two_discs_meet_when_their_rims_touch():
    def meeting(*game):
        return collision_avoidance._meeting_time(*(float(each) for each in game))

    assert meeting(1.5, 0, 1, 0, 0.5) == pytest.approx(1.0)
    assert meeting(2, 1, 1, 0, 1) == 2.0
    assert meeting(2, 1.001, 1, 0, 1) == math.inf
    assert meeting(1, 0, 1, 0, 1) == 0.0
    assert meeting(0.5, 0, 1, 0, 1) == 0.0
    # Points, one at rest, and one that goes away.
    assert meeting(1, 0, 1, 0, 0) == math.inf
    assert meeting(1, 0, 0, 0, 0.5) == math.inf
    assert meeting(1, 0, -1, 0, 0.5) == math.inf


def test_whom_one_would_meet_within_a_second_one_turns_aside_for_to_the_left():
    ahead, radii = [[1.0, 0.0], [0.0, 0.0]], [0.25, 0.25]
    at_once = avoided([[0, 0], [1.5, 0]], ahead, radii)
    assert at_once[0] == pytest.approx([1.0, 0.0])
    turned = avoided([[0, 0], [1.49, 0]], ahead, radii)
    assert turned[0, 1] > 0.1
    assert np.hypot(*turned[0]) == pytest.approx(1.0)
    upwards = avoided([[0, 0], [0, 1.49]], [[0.0, 1.0], [0.0, 0.0]], radii)
    assert upwards == pytest.approx(turned[:, ::-1] * [-1.0, 1.0])
    # One that rests has nowhere to turn, and moves for nobody so far away.
    assert turned[1] == pytest.approx([0.0, 0.0])


def constraints(most):
    rows = np.zeros((most, 2)), np.zeros(most), np.zeros(most, np.int64), np.zeros(most, np.int64)
    return collision_avoidance.Constraints(*rows)


@pytest.mark.parametrize(
    ("dx", "contact", "room", "j", "rate"),
    [
        (1.0, 0.5, 0.0, 0, -0.485 / 0.15),
        (1.0, 0.5, 0.0, -1, -0.2425 / 0.15),
        (1.0, 0.5, 0.25, 2, -0.25 / 0.15),
        (0.25, 0.5, 0.0, 0, 0.015 / 0.15),
        (1.5, 0.5, 0.0, 0, None),
        (1.0, 0.0, 0.0, 0, None),
        (0.0, 0.5, 0.0, 0, None),
    ],
)
def test_how_fast_a_gap_may_close(dx, contact, room, j, rate):
    written = constraints(2)
    kept = collision_avoidance._keep_gap(written, 1, dx, 0.0, contact, 1.0, room, 3, j)
    assert kept == (rate is not None)
    if kept:
        assert written.rates[1] == pytest.approx(rate)
        assert written.normals[1].tolist() == [1.0, 0.0]
        assert (written.first[1], written.second[1]) == (3, j)


def test_walls_within_reach_are_eight_at_most_and_on_the_free_side():
    turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = build_edge_index(make_world(np.column_stack([np.cos(turns), np.sin(turns)])))
    far = math.cos(math.pi / 12)
    for reach, least in ((far - 1e-6, 0), (far + 1e-6, 8)):
        written = constraints(20)
        found = collision_avoidance._keep_walls(written, 3, ring, np.zeros(2), 0, reach)
        assert found == 3 + least
    assert written.rates[3:11] == pytest.approx(np.full(8, -far / 0.15), rel=1e-5)
    assert np.hypot(*written.normals[3:11].T) == pytest.approx(np.ones(8))
    assert (written.second[3:11] == -1).all()
    # A box's walls have no free side within, and one at a wall has no direction from it.
    box = build_edge_index(make_world([(0, 0), (4, 0), (4, 4), (0, 4)]))
    for at, count in (([2.0, 1.0], 0), ([2.0, 0.5], 1), ([2.0, 0.0], 0), ([2.0, -0.5], 0)):
        written = constraints(20)
        assert collision_avoidance._keep_walls(written, 0, box, np.array(at), 0, 1.0) == count


def test_a_right_of_way_counts_in_gaps_below_the_limit():
    gap = 2.0 - 0.5 * (1.0 + MARGIN)

    def part(rank, near, contact=0.5, apart=2.0):
        return half_gap_part(0.0, 0.0, 4.0, 0.0, apart, 0.0, contact, rank, near)

    assert part(1, gap) == pytest.approx(0.5 * gap / 4.0)
    assert part(-1, gap) == pytest.approx(0.5 * gap / 4.0)
    assert part(1, gap + 1e-9) == pytest.approx(gap / 4.0)
    assert part(0, gap + 1e-9) == pytest.approx(0.5 * gap / 4.0)
    assert part(-1, gap + 1e-9) == 0.0
    assert half_gap_part(0.0, 0.0, 4.0, 0.0, 2.0, 0.0, 0.5, 0, 0.0) == pytest.approx(
        0.5 * gap / 4.0
    )
    # Points, and two at one place.
    assert part(0, 0.0, contact=0.0) == 1.0
    assert part(0, 0.0, apart=0.0) == 1.0
    assert part(0, 0.0, apart=0.3) == 0.0


def test_who_drives_straight_into_a_wall_does_not_turn():
    room = build_edge_index(make_world([(0, 0), (4, 0), (4, 4), (0, 4)]))
    pose, limits = np.array([3.9, 2.0, 0.2]), np.array([1.0, 30.0])
    speed, rate = stop_at_walls(*room, pose, np.array([1.0, 0.0]), limits, 0.5)
    assert 0.0 < speed < 0.3
    assert rate == 0.0


def test_gaps_of_robots_that_stand_are_what_they_are():
    samples = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 3.0]]] * 3)
    with np.errstate(all="raise"):
        gaps = gaps_between_samples(samples, np.array([0.25, 0.75, 1.0]))
    assert gaps.tolist() == [[0.0, 1.75, math.sqrt(10) - 1.75]] * 2
    # Bodies that just touch do not overlap.
    assert count_contacts(gaps) == 0
    assert count_contacts(gaps - 1e-9) == 1
    assert count_contacts(np.array([[-1.0], [-1.0], [0.0], [-1.0], [1.0]])) == 2


def test_gaps_to_nobody_and_to_those_who_stand():
    start, end, contacts = np.zeros(2), np.array([2.0, 0.0]), np.array([0.25])
    nobody = np.zeros((0, 2)), np.zeros(0)
    assert gap_to_runners(start, end, (0.0, 1.0), *nobody, 1.0) == math.inf
    assert gap_to_paths(start, end, np.zeros((0, 4)), np.zeros(0)) == math.inf
    standing = np.array([[1.0, 1.0, 1.0, 1.0]])
    with np.errstate(all="raise"):
        assert gap_to_paths(start, end, standing, contacts) == 0.75
    runners = np.array([[1.0, 1.0]])
    assert gap_to_runners(start, end, (0.0, 1.0), runners, contacts, 0.0) == 0.75
    assert gap_to_runners(start, start, (1.0, 2.0), runners, contacts, 0.5) == pytest.approx(
        math.sqrt(2) - 0.25 - 1.0
    )


def test_who_moves_at_a_tenth_of_its_wish_waits_no_longer_and_at_half_no_more():
    paces = np.array([0.0, 0.09, 0.11, 0.49, 0.51, 0.0])
    wishes = np.array([1.0, 1.0, 1.0, 1.0, 1.0, 0.0])
    positions = np.column_stack([0.5 * paces, np.zeros(6)]).ravel()
    velocities = np.column_stack([np.zeros(6), wishes]).ravel()
    waited = still_waiting(np.full(6, 0.3), np.zeros(12), positions, velocities, 0.5)
    assert waited == pytest.approx([0.8, 0.8, 0.3, 0.3, 0.0, 0.0])


def test_turns_come_to_the_patient_one_in_each_group():
    apart = np.array([0.0, 0.0, 1.15, 0.0])
    nobody = np.empty(0)

    def turns(positions, waiting, left=(0.0, 0.0), others=nobody):
        found, waited = take_turns(
            flat(left), flat(waiting), flat(positions), np.full(2, 0.5), flat(others), 0.5
        )
        assert (waited[found > 0] == 0.0).all()
        return found.tolist()

    # Bodies that are just too far from each other are no group.
    assert turns(apart, [0.6, 0.7]) == [1.5, 1.5]
    beside = apart - [0.0, 0.0, 1e-6, 0.0]
    assert turns(beside, [0.6, 0.7]) == [0.0, 1.5]
    assert turns(beside, [0.59, 0.59]) == [0.0, 0.0]
    assert turns(beside, [0.6, 0.59]) == [1.5, 0.0]
    # Of two that waited as long it is the nearer one's turn, then the first one's.
    assert turns(beside, [0.7, 0.7], others=[3.0, 0.0]) == [0.0, 1.5]
    assert turns(beside, [0.7, 0.7], others=[0.575 - 5e-7, 9.0]) == [1.5, 0.0]
    # A turn that goes on is nobody else's, and half a period is left of it.
    assert turns(beside, [0.9, 0.0], left=[0.0, 0.75]) == [0.0, 0.25]
    assert turns(beside, [0.9, 0.0], left=[0.0, 0.74]) == [1.5, 0.0]


# With a = 1/2 and r_p = 2 a pursuer is worth an evader's distance of 1.
@pytest.mark.parametrize(
    ("phi_p", "r_e", "phi_e", "code"),
    [
        (0.0, 1.0, 1.0, IN_STAR),
        (0.4, 1.0, 1.0, IN_STAR),
        (-1.0, 1.0, math.pi - 1.0, REGION_3),
        (-1.0, 1.0, math.pi - 0.999, HIDDEN),
        (-2.0, 1.0, 0.0, REGION_3),
        (-2.0, 1.0 - 1e-9, 0.0, REGION_1),
        (-1.0, 0.9, 0.5 * math.pi, REGION_2),
        (-1.0, 0.9, 0.5 * math.pi + 1e-6, REGION_4),
        (-1.0, 1.0, 0.3, REGION_3),
        (-1.0, 1.0 - 1e-9, 0.3, REGION_2),
        (-1.0, 2.0, 0.3, REGION_5),
        (-1.0, 2.0 - 1e-9, 0.3, REGION_3),
    ],
)
def test_borders_of_the_regions_belong_to_the_pursuer(phi_p, r_e, phi_e, code):
    assert region(2.0, phi_p, r_e, phi_e, 0.6, 0.5) == code


def test_a_pursuer_or_an_evader_at_the_corner():
    assert region(0.0, -1.0, 1.0, 1.0, 0.6, 0.5) == IN_STAR
    assert margin_field(0.0, -1.0, 1.0, 1.0, 0.6, 0.5) == (0.0, 0.0, 0.0)
    # From the corner an evader is at edge A at once.
    m1, m2, d_p, d_e, gap = margins(2.0, -1.0, 0.0, 3.0, 0.6, 0.5)
    assert (m2, d_e) == (0.0, 0.0)
    assert gap == pytest.approx(math.pi / 2 - 1.0)
    assert m1 == -0.5 * d_p
    assert margins(2.0, -2.0, 0.0, 3.0, 0.6, 0.5)[4] == 0.0
    assert escape_time(2.0, -1.0, 0.0, 0.5, 0.6, 0.5, 1.0) == 0.0
    assert dash(2.0, -1.0, 0.3, math.pi - 1.0, 0.5) == pytest.approx(0.0, abs=1e-12)
    assert table_evader_policy(2.0, -1.0, 0.0, 0.5, 0.6, 0.5) == (-1.0, 0.0)
    assert table_evader_policy(2.0, -1.0, 0.5, math.pi, 0.6, 0.5) == (-1.0, 0.0)
    assert evader_policy(2.0, -1.0, 0.0, 0.5, 0.6, 0.5) == (-1.0, 0.0)
    assert evader_policy(2.0, 0.3, 0.0, 0.5, 0.6, 0.5) == (-1.0, 0.0)
    assert evader_policy(2.0, 0.3, 0.5, 0.5, 0.6, 0.5) == (-math.cos(0.5), -math.sin(0.5))


def test_left_of_the_corner_begins_beyond_a_right_angle():
    game = 0.05, 0.3, 0.6, 0.5
    assert table_field(2.0, -0.5 * math.pi, *game)[:2] == pytest.approx((1.0, 0.0), abs=1e-6)
    beyond = -0.5 * math.pi - 1e-9
    assert table_field(2.0, beyond, *game)[:2] == pytest.approx((0.0, 1.0), abs=1e-6)


def test_a_pursuer_at_the_rim_of_the_star_region_is_in_it():
    def angle(phi, alpha=0.7):
        at = math.cos(phi), math.sin(phi)
        _, phi_p, _, _, mirrored = to_corner_frame(*at, 1.0, 1.0, 0.0, 0.0, 0.0, alpha)
        return phi_p, mirrored

    assert angle(-0.9e-9) == (0.0, False)
    assert angle(-1.2e-9)[0] == pytest.approx(-1.2e-9, rel=1e-3)
    assert angle(0.7 + 0.9e-9) == (0.7, False)
    assert angle(0.7 + 1.2e-9)[0] == pytest.approx(-1.2e-9, rel=1e-3)
    assert angle(0.7 + 1.2e-9)[1]
    assert angle(0.3)[0] == pytest.approx(0.3)


def test_positions_are_near_enough_up_to_a_thousand_kilometres():
    require_near("points", np.array([[FARTHEST, -FARTHEST]]))
    require_near("points", np.zeros((0, 2)))
    with pytest.raises(InvalidInput, match=r"`points` must be within 1e\+06 m of the corner"):
        require_near("points", np.array([[0.0, -1.01 * FARTHEST]]))


@pytest.mark.parametrize("alpha", [0.0, math.pi, -1.0, 4.0, math.nan])
def test_no_obstacle_has_such_an_angle(alpha):
    with pytest.raises(InvalidInput, match="`alpha` must"):
        inside_obstacle([0.0, 1.0], alpha)


@pytest.mark.parametrize("a", [0.0, 1.0, math.inf])
def test_no_evader_is_as_fast(a):
    with pytest.raises(InvalidInput, match="`a` must"):
        corner_policies.partition([1.0, 1.0], [0.0, 1.0], 1.0, a)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ("here", r"`points` must be positions \[x, y\]; got 'here'"),
        (3.0, r"`points` must be positions \[x, y\]; got an array of shape \(\)"),
        ([1.0, 2.0, 3.0], r"`points` must be positions \[x, y\]; got an array of shape \(3,\)"),
        ([[1.0, math.nan]], "`points` must be finite; got NaN or an infinity"),
    ],
)
def test_what_is_no_position_is_refused(points, message):
    with pytest.raises(InvalidInput, match=message):
        inside_obstacle(points, 1.0)


def test_the_edges_of_an_obstacle_are_free():
    x, y = math.cos(1.0 - math.pi), math.sin(1.0 - math.pi)
    edges = np.array([[-2.0, 0.0], [3.0 * x, 3.0 * y], [0.0, 0.0]])
    assert not inside_obstacle(edges, 1.0).any()
    inner = [[-2.0, -1e-9], [3.0 * x - 1e-9, 3.0 * y + 1e-9], [-1.0, -0.5]]
    assert inside_obstacle(inner, 1.0).all()
    for name in ("pursuer", "evader"):
        ask = {"pursuer": corner_policies.partition, "evader": corner_policies.pursuer_partition}
        with pytest.raises(InvalidInput, match=f"`{name}` must not be inside the obstacle"):
            ask[name]([-1.0, -0.5], [1.0, 1.0], 1.0, 0.5)
        with pytest.raises(InvalidInput, match=f"`{name}` must be one position"):
            ask[name]([[1.0, 0.5]], [1.0, 1.0], 1.0, 0.5)


def test_weights_of_equal_threats_and_of_one_at_hand():
    two = np.array([0.5, 0.5])
    assert risk_weights(RISK_VECTORS["majority"], two).tolist() == [1.0, 0.0]
    assert risk_weights(RISK_VECTORS["uniform"], two).tolist() == [0.5, 0.5]
    at_hand = risk_weights(RISK_VECTORS["proportional"], np.array([0.0, 1.0, 2e-6]))
    assert at_hand * 1e6 == pytest.approx(np.array([1e6, 1.0, 5e5]) / 1.500001)
    for code in RISK_VECTORS.values():
        assert risk_weights(code, np.zeros(0)).tolist() == []


def test_an_evader_at_a_corner_is_as_near_as_can_be():
    corners = np.array([[1.0, 1.0, 0, 1, 1, 1], [1.0, 3.0, 0, 1, 1, 1]])
    sight = np.ones(sight_size(3, 1, 2))
    risk = team_risk(np.array([0, 1, 2]), np.array([1.0, 1.0]), sight, corners)
    assert risk.ravel() == pytest.approx([1e6 + 0.5, 1e6, 0.5e6 + 0.25])
    sight[3:9] = 0.0
    assert not team_risk(np.array([0, 1, 2]), np.array([1.0, 1.0]), sight, corners).any()


def test_a_pursuer_at_its_evader_waits():
    for distance, moves in ((0.8e-9, False), (1.2e-9, True)):
        teams = np.zeros(2), np.array([distance, 0.0]), np.zeros(1), np.zeros(2)
        found = modified_velocities(0.5, 0.7, 0.2, 0.1, *teams)
        assert found.any() == moves


def test_evaders_that_no_corner_hides_run_from_whom_they_are_not_at():
    corners = np.zeros((0, 6))
    pursuers, evader = np.array([1.0, 1.0, 0.0, 1.0]), np.array([1.0, 1.0])
    found = adversarial_velocities(pursuers, evader, np.ones(2), corners, 0.5, 0.3, 0.0)
    assert found == pytest.approx([0.3, 0.0])
    alone = adversarial_velocities(pursuers[:2], evader, np.ones(1), corners, 0.5, 0.3, 0.0)
    assert alone.tolist() == [0.0, 0.0]


@pytest.mark.parametrize(
    ("angle", "reach"), [(0.4, 2.0), (math.pi / 3, 2.0), (math.pi / 2, 2**0.5)]
)
def test_a_stance_is_two_standoffs_from_a_sharp_corner(angle, reach):
    offset = corner_stance(3.0, 4.0, 0.7, angle, 0.1)
    assert np.hypot(*offset) == pytest.approx(0.1 * reach)
    assert math.atan2(*offset[::-1]) == pytest.approx(0.7 + 0.5 * angle)


def test_margins_of_an_edge_reach_to_its_end():
    def margin(x, y, u, v):
        return lookahead._edge_margin(float(x), float(y), float(u), float(v), 2.0, 0.5)

    # Evaders before the edge, beyond its end, and at the corner's side; pursuers round it.
    assert margin(1.0, -0.6, -1.0, 0.4) == pytest.approx(0.4 - 0.3)
    assert margin(1.0, 0.6, -2.0, 0.4) == pytest.approx(0.4 + 0.3)
    assert margin(-0.3, -0.4, -5.0, 4.0) == pytest.approx(5.0 - 0.25)
    assert margin(-0.3, 0.4, 3.0, 4.0) == pytest.approx(5.0 + 0.25)


def test_a_held_assignment_is_left_for_more_than_a_quarter_of_the_risk():
    risk = np.array([[1.0, 0.75, 0.74]])
    view = TeamView(np.ones((1, 3), bool), risk, np.zeros((1, 2)), np.zeros((3, 2)))
    for target, left in ((1, False), (2, True)):
        chosen = hold_or_choose(view, np.array([0]), lambda _, to=target: np.array([to]), "cost")
        assert chosen.tolist() == [target if left else 0]


def test_who_is_at_one_place_is_no_nearer_than_another():
    risk = np.array([[1.0, 2.0]])
    assert nearer_first(risk, np.ones(2), np.ones(4), False).tolist() == risk.tolist()


def test_who_has_to_turn_by_a_right_angle_turns_its_front():
    headings, velocities = np.zeros(3), np.array([[0.0, 1.0], [0.0, -1.0], [-1.0, 0.0]])
    commands = turn_first_command(headings, velocities, 0.5)
    assert commands == pytest.approx(np.array([[0.0, np.pi], [0.0, -np.pi], [-1.0, 0.0]]))
    # Hardly astray it drives already.
    for error, ahead in ((0.9e-7, math.cos(0.9e-7)), (1.1e-7, 0.0)):
        astray = np.array([[math.cos(error), math.sin(error)]])
        assert turn_first_command(np.zeros(1), astray, 0.5)[0, 0] == pytest.approx(ahead)


def test_who_is_named_is_an_evader_or_nobody():
    assert names_evaders(np.array([-1.0, 0.0, 2.0]), 3)
    for wrong in (-2.0, 3.0, 0.5, math.nan):
        assert not names_evaders(np.array([0.0, wrong]), 3)


def test_twelve_evaders_can_be_ranked_and_no_more():
    risk = np.random.default_rng(1).uniform(1, 2, (1, 13))
    ranked = np.ones((1, 13), bool)
    scores = kemeny_scores(risk[:, :12], ranked[:, :12])
    assert scores.tolist() == np.argsort(np.argsort(risk[0, :12])).tolist()
    with pytest.raises(InvalidInput, match="`evaders` must be at most 12 for kemeny; got 13"):
        kemeny_scores(risk, ranked)


def test_corners_of_a_world_are_in_its_table():
    world = make_world([(0, 0), (4, 0), (4, 4), (2, 4), (2, 2), (0, 2)])
    assert corner_table(world)[0, [0, 1, 3, 4, 5]] == pytest.approx([2, 2, math.pi / 2, 2, 2])
    with pytest.raises(InvalidInput, match="`world` must be of type World"):
        corner_table(world.boundary)
