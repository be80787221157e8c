"""What planners take and what they refuse, on either side of every limit."""

import math

import numpy as np
import pytest
from scipy.linalg import expm

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import (
    Discs,
    covering_discs,
    deepest_overlap,
    discs_from_text,
    require_clear_ends,
    walls_part,
)
from sightfield.systems.numerics.planning.goal import (
    Goal,
    checked_start,
    require_plannable,
    require_plannable_cart,
)
from sightfield.systems.numerics.planning.path_tracking import make_path_tracker, tracking_error
from sightfield.systems.numerics.planning.plan import (
    Plan,
    TrailerPath,
    driven_path,
    refined_path,
    require_path,
)
from sightfield.systems.numerics.planning.trailer import (
    Trailer,
    control_excess,
    half_angle_map,
    held_states,
    hold_beta,
    trailer_rates,
)

# A turning radius of two metres.
CART = Trailer(speed=3.0, turn_rate=1.5, length=1.7, hitch_offset=0.4)
AT_ORIGIN = Goal(state=(0.0, 0.0, 0.0, 0.0))
ROOM = make_world([(0, 0), (10, 0), (10, 4), (0, 4)])


@pytest.mark.parametrize(
    ("within", "beyond", "name"),
    [
        ({"length": 2e-3, "hitch_offset": 0.1}, {"length": 1.99e-3}, "length"),
        ({"length": 2e3}, {"length": 2.01e3}, "length"),
        ({"hitch_offset": 170.0}, {"hitch_offset": 170.1}, "hitch_offset"),
        ({"hitch_offset": -170.0}, {"hitch_offset": -170.1}, "hitch_offset"),
    ],
)
def test_carts_are_refused_beyond_their_ranges(within, beyond, name):
    values = {"speed": 3.0, "turn_rate": 1.5, "length": 1.7, "hitch_offset": 0.4}
    require_plannable_cart(Trailer(**{**values, **within}))
    with pytest.raises(InvalidInput, match=name):
        require_plannable_cart(Trailer(**{**values, **beyond}))


@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ((2e7, -2e7, 0, 0), (2e7, -2e7, 0, 0)),
        ((0, 0, 1e6, -1e6), (0, 0, -1e6, 1e6)),
        ((1.2e4, 1.6e4, 0, 0), (0, 0, 0, 0)),
    ],
)
@pytest.mark.parametrize("entry", range(4))
def test_questions_are_refused_beyond_their_ranges(start, goal, entry):
    require_plannable(CART, start, Goal(state=goal))
    farther = [list(start), list(goal)]
    for each in farther:
        each[entry] += math.copysign(1e3, each[entry])
    if start[entry]:
        with pytest.raises(InvalidInput, match="start"):
            require_plannable(CART, farther[0], Goal(state=goal))
        if goal[entry]:
            with pytest.raises(InvalidInput, match="goal"):
                require_plannable(CART, start, Goal(state=tuple(farther[1])))


def test_starts_are_refused_beyond_the_jackknife_limit_alone():
    cart = Trailer(jackknife=0.9)
    for beta in (0.9, -0.9, 0.5 + math.tau):
        np.testing.assert_array_equal(
            checked_start(cart, (1, 2, 3, beta), AT_ORIGIN), [1, 2, 3, beta]
        )
    for start in ((1, 2, 3, 0.901), (1, 2, 3, -0.901), (1, 2, 3), (1, 2, 3, math.inf), "five", 7):
        with pytest.raises(InvalidInput, match="start"):
            checked_start(cart, start, AT_ORIGIN)
    with pytest.raises(InvalidInput, match="length"):
        checked_start(Trailer(length=1e4), (1, 2, 3, 0), AT_ORIGIN)


def test_a_goal_counts_as_reached_within_a_rounding_alone():
    goal = Goal(state=(1.0, 2.0, 0.0, 0.0), tolerance=(0.3, 0.2, 0.1, 0.4))
    for place, expected in ((0.9e-9, True), (1.3e-9, False)):
        assert goal.reached((1.3 + place, 2.0, 0.0, 0.0)) is expected
        assert goal.reached((1.0, 2.2 + place, 0.0, 0.0)) is expected
        assert goal.reached((1.0, 2.0, 0.1 + place, 0.0)) is expected
        assert goal.reached((1.0, 2.0, 0.0, -0.4 - place)) is expected


def test_the_edge_of_a_box_belongs_to_it():
    goal = Goal(state=(1.0, 2.0, 0.0, 0.25), tolerance=(0.5, 0.25, 0.125, 0.5))
    for edge in np.vstack([np.diag(goal.tolerance), -np.diag(goal.tolerance)]):
        assert goal.contains(np.array(goal.state) + edge)
        assert not goal.contains(np.array(goal.state) + 1.001 * edge)
    assert Goal(state=(0, 0, 0, 0)).is_point
    assert not Goal(state=(0, 0, 0, 0), tolerance=(0, 0, 0, 0.1)).is_point
    assert goal.centred.state == (0.0, 0.0, 0.0, 0.25)
    assert goal.gaps((0, 0, -math.pi, 0.25 + math.pi))[2:].tolist() == [-math.pi, -math.pi]


@pytest.mark.parametrize(
    "wrong",
    [
        {"state": (0, 0, 0)},
        {"state": (0, 0, 0, math.nan)},
        {"state": (0, 0, 0, 0), "tolerance": (0, 0, 0)},
        {"state": (0, 0, 0, 0), "tolerance": (0, 0, -1e-9, 0)},
        {"state": (0, 0, 0, 0), "tolerance": (0, 0, math.nan, 0)},
    ],
)
def test_boxes_that_are_none_are_refused(wrong):
    with pytest.raises(InvalidInput):
        Goal(**wrong)


def test_a_jackknife_limit_is_at_most_half_a_turn():
    assert Trailer(jackknife=math.pi).jackknife == math.pi
    assert Trailer(speed=3.0, turn_rate=1.5).radius == 2.0
    for wrong in ({"jackknife": 0.0}, {"jackknife": 3.15}, {"reverse": 1}):
        with pytest.raises(InvalidInput):
            Trailer(**wrong)


def test_discs_lie_in_rows_no_farther_apart_than_half_a_width():
    discs = covering_discs(Trailer(length=2.0, hitch_offset=0.5), 0.8)
    assert discs.bodies == (0,) * 5 + (1,) * 5
    np.testing.assert_allclose(discs.offsets[:5], np.linspace(-0.5, 1.0, 5))
    np.testing.assert_allclose(discs.offsets[5:], [0.0, 0.4, 0.8, 1.2, 1.6])
    assert set(discs.radii) == {0.4}
    ahead = covering_discs(Trailer(length=2.0, hitch_offset=-0.5))
    np.testing.assert_allclose(ahead.offsets, [0.0, 0.5, 1.0, 0.0, 0.5, 1.0, 1.5])
    assert set(ahead.radii) == {0.5}
    assert ahead.length == 2.0
    with pytest.raises(InvalidInput, match="width"):
        covering_discs(CART, 0.0)


def test_discs_are_where_the_bodies_are():
    discs = Discs((0, 1), (0.7, 0.3), (0.1, 0.1), 1.7, 0.4)
    x, y, theta, beta = 1.0, 2.0, 0.6, 1.1
    ahead, along = (
        np.array([math.cos(theta), math.sin(theta)]),
        np.array([math.cos(theta - beta), math.sin(theta - beta)]),
    )
    np.testing.assert_allclose(discs.centre(0, (x, y, theta, beta)), [x, y] + 0.7 * ahead)
    axle = [x, y] - 0.4 * ahead - 1.7 * along
    np.testing.assert_allclose(discs.centre(1, (x, y, theta, beta)), axle + 0.3 * along)


def test_discs_that_are_written_out_are_read_up_to_their_limits():
    discs = discs_from_text(CART, "Tractor -0.5 0.4, trailer 0.25 0.75")
    assert discs == Discs((0, 1), (-0.5, 0.25), (0.4, 0.75), 1.7, 0.4)
    discs_from_text(CART, "tractor -210 210")
    assert len(discs_from_text(CART, ",".join(["tractor 0 1"] * 64))) == 64
    for wrong in (
        "tractor -210.1 1",
        "tractor 0 210.1",
        ",".join(["tractor 0 1"] * 65),
        "tractor 0 0",
        "tractor inf 1",
        "tractor 0",
        "tractor 0 1 2",
        "wagon 0 1",
        "",
    ):
        with pytest.raises(InvalidInput, match="discs"):
            discs_from_text(CART, wrong)


def test_ends_may_touch_a_wall_and_no_more():
    discs = Discs((0,), (0.0,), (0.5,), 1.7, 0.4)
    goal = Goal(state=(3.0, 3.5, 0.0, 0.0), tolerance=(0.2, 0.2, 0.1, 0.1))
    require_clear_ends(ROOM, discs, (2.0, 0.5, 0.0, 0.0), goal)
    assert deepest_overlap(ROOM, discs, np.array([[2.0, 0.3, 0, 0], [2.0, 1.0, 0, 0]])) == (
        pytest.approx(0.2)
    )
    with pytest.raises(InvalidInput, match="start"):
        require_clear_ends(ROOM, discs, (2.0, 0.49, 0.0, 0.0), goal)
    inside = Goal(state=(3.0, 3.51, 0.0, 0.0))
    with pytest.raises(InvalidInput, match="goal"):
        require_clear_ends(ROOM, discs, (2.0, 0.5, 0.0, 0.0), inside)


@pytest.mark.parametrize(
    ("gap", "discs", "parted"),
    [
        (1.02, Discs((0, 1), (0.0, 0.0), (0.5, 0.9), 1.7, 0.4), False),
        (0.98, Discs((0, 1), (0.0, 0.0), (0.5, 0.1), 1.7, 0.4), True),
        # A disc ahead of the axle need not go where the axle goes.
        (0.98, Discs((0, 0), (0.3, 0.0), (0.6, 0.4), 1.7, 0.4), False),
        (0.98, Discs((0,), (0.3,), (0.6,), 1.7, 0.4), False),
    ],
)
def test_walls_part_rooms_whose_gap_the_axle_cannot_pass(gap, discs, parted):
    edges = [(0, 0), (4, 0), (4, 3), (4.5, 3), (4.5, 0), (9, 0), (9, 7)]
    world = make_world([*edges, (4.5, 7), (4.5, 3 + gap), (4, 3 + gap), (4, 7), (0, 7)])
    goal = Goal(state=(7.0, 3.0, 0.0, 0.0), tolerance=(0.1, 0.2, 0.1, 0.1))
    assert walls_part(world, discs, (2.0, 3.0, 0.0, 0.0), goal) is parted
    # A box that reaches over from this room is not parted from it.
    long = Goal(state=(7.0, 3.0, 0.0, 0.0), tolerance=(4.0, math.inf, 0.1, 0.1))
    assert not walls_part(world, discs, (2.0, 3.0, 0.0, 0.0), long)


def path_of(times, states=None, controls=None):
    count = len(times)
    states = np.zeros((count, 4)) if states is None else states
    return TrailerPath(
        np.array(times, float), states, np.ones((count - 1, 2)) if controls is None else controls
    )


@pytest.mark.parametrize(
    "wrong",
    [
        path_of([0.0]),
        path_of([0.0, 0.0]),
        path_of([0.0, 1.0, 0.9]),
        path_of([0.0, math.inf]),
        path_of([0.0, 1.0], states=np.zeros((3, 4))),
        path_of([0.0, 1.0], states=np.full((2, 4), math.nan)),
        path_of([0.0, 1.0], controls=np.ones((2, 2))),
        path_of([0.0, 1.0], controls=np.full((1, 2), math.inf)),
    ],
)
def test_paths_that_are_none_are_refused(wrong):
    require_path(path_of([0.0, 1.0]))
    with pytest.raises(InvalidInput, match="path"):
        require_path(wrong)


def test_samples_are_as_far_apart_as_the_step_allows():
    path = driven_path(CART, (1, 2, 0.3, 0.4), [(3.0, 0.5, 0.4), (-2.0, 0.0, 0.25)], 0.1)
    np.testing.assert_allclose(
        path.times, [0, 0.1, 0.2, 0.3, 0.4, 0.4 + 0.25 / 3, 0.4 + 0.5 / 3, 0.65]
    )
    np.testing.assert_array_equal(path.controls, [[3.0, 0.5]] * 4 + [[-2.0, 0.0]] * 3)
    assert len(driven_path(CART, (0, 0, 0, 0), [(1.0, 0.0, 0.5)]).times) == 11
    fine = refined_path(path, CART, 0.05)
    np.testing.assert_allclose(np.diff(fine.times)[:8], 0.05)
    np.testing.assert_allclose(np.diff(fine.times)[8:], 0.25 / 6)
    np.testing.assert_array_equal(fine.states[::2], path.states)
    np.testing.assert_array_equal(fine.controls[::2], path.controls)
    exact = driven_path(CART, (1, 2, 0.3, 0.4), [(3.0, 0.5, 0.4), (-2.0, 0.0, 0.25)], 0.0005)
    np.testing.assert_allclose(fine.states[1:8:2], exact.states[[100, 300, 500, 700]], atol=1e-5)
    for pieces, step in (([], 0.1), ([(1, 0, 0)], 0.1), ([(1, 0, 1)], 0)):
        with pytest.raises(InvalidInput):
            driven_path(CART, (0, 0, 0, 0), pieces, step)
    with pytest.raises(InvalidInput, match="step"):
        refined_path(path, CART, 0.0)


def test_the_widest_angle_is_counted_from_the_turn_of_the_start():
    states = np.zeros((3, 4))
    states[:, 3] = math.tau + np.array([0.2, -1.1, 0.7])
    assert path_of([0.0, 1.0, 2.0], states).widest_angle == pytest.approx(1.1)


@pytest.mark.parametrize("reverse", [False, True])
def test_controls_exceed_their_bounds_by_the_larger_gap(reverse):
    cart = Trailer(speed=3.0, turn_rate=1.5, reverse=reverse)
    assert control_excess(np.array([[3.0, -1.5], [0.0, 1.5]]), cart) == 0.0
    assert control_excess(np.array([[3.0, -1.5], [3.5, 1.75]]), cart) == pytest.approx(0.5)
    assert control_excess(np.array([[1.0, -1.9], [2.0, 1.0]]), cart) == pytest.approx(0.4)
    assert control_excess(np.array([[-1.0, 0.0]]), cart) == (0.0 if reverse else 1.0)
    assert control_excess(np.zeros((0, 2)), cart) == 0.0


@pytest.mark.parametrize("hitch", [-0.6, 0.4, 2.5])
def test_half_angles_follow_the_exponential_of_their_rates(hitch):
    cart = Trailer(length=1.7, hitch_offset=hitch)
    share = hitch / 1.7
    for v, omega, duration in ((1.3, 0.4, 0.9), (-0.8, 1.1, 1.7), (0.2, -1.2, 2.3), (0, 0, 3.0)):
        rates = np.array(
            [
                [-v / 3.4, omega * (1 + share) / 2],
                [omega * (share - 1) / 2, v / 3.4],
            ]
        )
        expected = expm(rates * duration)
        found = half_angle_map(cart, v, omega, duration)
        ratio = found.ravel() @ expected.ravel() / (expected.ravel() @ expected.ravel())
        assert ratio > 0
        np.testing.assert_allclose(found, ratio * expected, atol=1e-12)
        assert v or ratio == pytest.approx(1.0)


def test_a_held_control_takes_the_trailer_where_the_equations_do():
    cart, start, control = CART, (1.0, 2.0, 0.6, 0.5), (-1.9, 1.1)
    states = held_states(cart, start, control, 2.4, 48)
    assert states.shape == (48, 4)
    path = driven_path(cart, start, [(*control, 2.4)], 0.005)
    np.testing.assert_allclose(states, path.states[10::10], atol=1e-8)
    angles = hold_beta(np.array([0.5, -0.2]), *control, np.array([2.4, 1.2]), 48, cart)
    np.testing.assert_allclose(angles[1:, 0], states[:, 3])
    assert angles.shape == (49, 2)


def test_rates_are_slopes_of_the_place_of_the_trailer():
    theta, beta, v, omega = 0.6, 1.1, 1.9, 0.7
    rates = trailer_rates(theta, beta, v, omega, CART)
    assert rates[:3] == pytest.approx((v * math.cos(theta), v * math.sin(theta), omega))
    # The trailer's axle does not slip aside: its heading turns by the hitch's speed across it.
    across = v * math.sin(beta) - 0.4 * omega * math.cos(beta)
    assert omega - rates[3] == pytest.approx(across / 1.7)


def test_weights_of_a_tracker_are_positive():
    path = driven_path(CART, (1, 2, 0.3, 0.4), [(3.0, 0.5, 0.4)], 0.1)
    make_path_tracker(CART, path, (1e-9, 1.0, 1.0, 1.0))
    for k in range(4):
        with pytest.raises(InvalidInput, match="weights"):
            make_path_tracker(CART, path, tuple(0.0 if n == k else 1.0 for n in range(4)))


def test_errors_are_seen_from_the_target():
    target = np.array([1.0, 2.0, 0.5, 0.3])
    ahead, left = 0.4, -0.2
    c, s = math.cos(0.5), math.sin(0.5)
    away = [c * ahead - s * left, s * ahead + c * left, 0.1 + math.tau, -0.2 - math.tau]
    state = target + np.array(away)
    np.testing.assert_allclose(tracking_error(state, target), [ahead, left, 0.1, -0.2])


def test_a_plan_of_which_no_more_is_said_has_no_path():
    plan = Plan(method="any", goal=AT_ORIGIN, status="lost", converged=False)
    told = (plan.time, plan.path, plan.iterations, plan.residual, plan.wall_time, plan.notes)
    assert told == (math.inf, None, 0, 0.0, 0.0, {})
    assert Goal(state=(1, 2, 3, 4)).tolerance == (0.0, 0.0, 0.0, 0.0)
    cart = Trailer()
    assert (cart.speed, cart.turn_rate, cart.length, cart.hitch_offset) == (1.0, 1.0, 1.0, 0.0)
    assert (cart.reverse, cart.jackknife) == (False, math.pi)
