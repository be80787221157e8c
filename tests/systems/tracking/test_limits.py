"""Which numbers and names the systems of a game of tracking refuse, and which they just allow."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.tracking.best_response.rollouts import Rollout
from sightfield.systems.numerics.tracking.visibility_game.bounds import certified_grid
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.tracking import (
    AdversarialEvaders,
    AgentTeam,
    Assignment,
    BestResponseEvaders,
    CertifiedPursuit,
    CollisionAvoidance,
    CollisionStop,
    DifferentialDriveTeam,
    GuaranteedTime,
    GuaranteePursuit,
    HeadingController,
    LineOfSight,
    LookaheadPursuit,
    ModifiedField,
    OptimalEvaders,
    PursuitFieldController,
    RandomWalkEvaders,
    SightLossMonitor,
    StandingCertificate,
    TurnFirstController,
    VelocitySelector,
    WaypointEvaders,
)
from sightfield.systems.tracking.best_response_evaders import ALONE, IN_TEAMS, Foresight

WORLD = make_world([(0, 0), (3, 0), (3, 2), (1.6, 2), (1.6, 1.1), (0, 1.1)])
PERIOD = 0.1
SPEEDS = {"pursuer_speed": 0.5, "evader_speed": 0.2}
GRID = certified_grid(0.6, 0.5, PERIOD)
TABLES = {
    bound: solve_visibility_game(WORLD, **SPEEDS, grid=GRID, bound=bound)
    for bound in ("middle", "lower")
}
SIZES = {"pursuers": 3, "evaders": 2}
FIELD = {**SIZES, "top_speed": 0.5, "speed_ratio": 0.4}
LIMITS = {"top_speed": 0.5, "top_turn_rate": 2.0}
POSES = np.ones((2, 3))


def responding(foresight=None, **options):
    return BestResponseEvaders(
        WORLD, [WORLD], [WORLD], **SIZES | SPEEDS | {"foresight": foresight} | options
    )


def certified(table="lower", period=PERIOD, **options):
    return CertifiedPursuit(TABLES[table], WORLD, **SIZES, period=period, **options)


SYSTEMS = {
    "points": lambda **o: AgentTeam(**{"initial_positions": POSES[:, :2], "top_speed": 1.0} | o),
    "drives": lambda **o: DifferentialDriveTeam(**{"initial_poses": POSES} | LIMITS | o),
    "heading": lambda **o: HeadingController(**{"count": 1} | o),
    "turn first": lambda **o: TurnFirstController(
        **{"count": 1, "top_speed": 0.5, "period": PERIOD} | o
    ),
    "sight": lambda **o: LineOfSight(WORLD, **SIZES | o),
    "loss": lambda **o: SightLossMonitor(WORLD, **SIZES | {"period": PERIOD} | o),
    "rule": lambda **o: Assignment(WORLD, **SIZES | o),
    "guarantee": lambda **o: GuaranteePursuit(TABLES["middle"], WORLD, **SIZES | o),
    "times": lambda **o: GuaranteedTime(TABLES["middle"], **SIZES | {"period": PERIOD} | o),
    "standing": lambda **o: StandingCertificate(**SIZES | {"top_speed": 0.5} | o),
    "avoidance": lambda **o: CollisionAvoidance(
        [WORLD], **{"count": 1, "period": PERIOD, "top_speed": 0.5} | o
    ),
    "stop": lambda **o: CollisionStop([WORLD], **{"count": 1, "period": PERIOD} | LIMITS | o),
    "field": lambda **o: PursuitFieldController(WORLD, **FIELD | o),
    "lookahead": lambda **o: LookaheadPursuit(WORLD, [WORLD], **FIELD | o),
    "modified": lambda **o: ModifiedField(**SIZES | {"weight": 0.5, "top_speed": 0.5} | o),
    "adversarial": lambda **o: AdversarialEvaders(WORLD, **FIELD | o),
    "optimal": lambda **o: OptimalEvaders(TABLES["middle"], WORLD, [WORLD], **SIZES | o),
    "walk": lambda **o: RandomWalkEvaders(**{"count": 1, "top_speed": 0.2} | o),
    "waypoints": lambda **o: WaypointEvaders(
        **{"waypoints": [[(1, 1)]], "top_speed": 0.2, "period": PERIOD} | o
    ),
    "selector": lambda **o: VelocitySelector(**{"choices": [0, 1], "sources": 2} | o),
    "responding": responding,
    "certified": certified,
}


def foresight(decision_period=0.5, **options):
    return Foresight(
        Rollout(**{"horizon": 1.0, "step": 0.1, "headings": 3} | options), decision_period
    )


@pytest.mark.parametrize("name", SYSTEMS)
def test_the_usual_numbers_are_allowed(name):
    assert SYSTEMS[name]().num_output_ports() > 0


@pytest.mark.parametrize(
    ("names", "options"),
    [
        ("points drives", {"time_step": 0.0}),
        ("adversarial optimal responding", {"radius": 0.0}),
        ("rule", {"radio_range": 0.0}),
        ("guarantee field", {"period": 0.0}),
        ("modified", {"weight": 0.0, "stand_off": 0.0}),
        ("modified", {"weight": 1.0}),
        ("walk", {"seed": 0}),
        ("stop", {"horizon": PERIOD}),
        ("field adversarial lookahead", {"speed_ratio": 0.999}),
        ("responding", {"foresight": foresight(headings=0)}),
        ("responding", {"pursuers": 1, "evaders": 1}),
        ("field responding", {"risk_vectors": ["uniform", "majority", "urgency"]}),
        ("waypoints", {"waypoints": [[], [(1, 1)]]}),
    ],
)
def test_numbers_at_their_limits_are_allowed(names, options):
    for name in names.split():
        assert SYSTEMS[name](**options).num_output_ports() > 0


@pytest.mark.parametrize(
    ("names", "options", "message"),
    [
        *[
            (names, {number: value}, f"`{number}` must be positive; got {value}")
            for value in (0.0, -0.3)
            for names, number in (
                (
                    "points drives turn_first standing avoidance stop field lookahead modified "
                    "adversarial walk waypoints",
                    "top_speed",
                ),
                ("drives stop", "top_turn_rate"),
                ("turn_first loss times avoidance stop waypoints certified", "period"),
                ("heading turn_first", "gain"),
                ("responding", "evader_speed"),
                ("walk", "turn_period"),
                ("modified", "fade"),
                ("avoidance stop", "pace"),
            )
        ],
        *[
            (names, {number: -1e-9}, f"`{number}` must be zero or positive")
            for names, number in (
                ("points drives", "time_step"),
                ("adversarial optimal responding", "radius"),
                ("rule", "radio_range"),
                ("guarantee field", "period"),
                ("modified", "stand_off"),
            )
        ],
        *[
            ("field lookahead adversarial", {"speed_ratio": ratio}, r"lie in \(0, 1\)")
            for ratio in (0.0, 1.0, -0.1)
        ],
        *[("modified", {"weight": w}, r"`weight` must lie in \[0, 1\]") for w in (-1e-9, 1 + 1e-9)],
        *[
            ("points", {"initial_positions": at}, r"`initial_positions` must have shape \(N, 2\)")
            for at in (np.ones((2, 3)), np.ones(2), np.ones((0, 2)), np.ones((1, 1, 2)))
        ],
        *[
            ("drives", {"initial_poses": at}, r"`initial_poses` must have shape \(N, 3\)")
            for at in (np.ones((3, 2)), np.ones(3), np.ones((0, 3)), np.ones((1, 1, 3)))
        ],
        ("points", {"initial_positions": [[0.0, np.nan]]}, "`initial_positions` must be finite"),
        ("drives", {"initial_poses": [[0.0, 0.0, np.inf]]}, "`initial_poses` must be finite"),
        ("heading turn_first walk avoidance stop", {"count": 0}, "whole number of at least 1"),
        ("sight", {"pursuers": 0}, "`pursuers` must be a whole number of at least 1"),
        ("sight", {"evaders": 0}, "`evaders` must be a whole number of at least 1"),
        ("sight loss", {"body_radii": [0.1]}, "body_radii"),
        ("rule", {"extra": "run"}, "`extra` must be one of stay, riskiest; got run"),
        ("rule", {"rule": "none"}, "`rule` must be one of"),
        ("rule", {"risk_functions": ["total"] * 2}, "`risk_functions` must have 1 or 3 entries"),
        ("field", {"risk_vectors": ["uniform"] * 4}, "`risk_vectors` must have 1 or 3 entries"),
        ("field", {"risk_vectors": ["none"]}, "`risk_vectors` must be one of"),
        ("field", {"field": "none"}, "`field` must be one of"),
        ("walk", {"seed": -1}, "`seed` must be zero or positive; got -1"),
        ("waypoints", {"waypoints": []}, "`waypoints` must name at least one evader; got none"),
        ("waypoints", {"waypoints": [[], [(np.nan, 1)]]}, r"`waypoints\[1\]` must be finite"),
        ("selector", {"choices": []}, "`choices` must name at least one member"),
        ("selector", {"choices": [0, 2]}, r"`choices` must lie in \[0, 2\); got 2"),
        ("selector", {"choices": [-1]}, r"`choices` must lie in \[0, 2\); got -1"),
        ("stop", {"horizon": 0.09}, "`horizon` must be at least the period of 0.1 s"),
        ("certified", {"table": "middle"}, "`table` must be by the lower bound; got middle"),
        ("certified", {"period": 0.093}, "`period` must go into the table's step"),
        ("certified", {"period": 50.0}, "`period` must go into the table's step"),
        ("responding", {"evader_speed": 0.5}, "`evader_speed` must be below 0.5; got 0.5"),
        ("responding", {"pursuit": "none"}, "`pursuit` must be one of"),
        ("responding", {"hold": "none at all"}, "`hold` must be one of"),
        ("responding", {"extra": "run"}, "`extra` must be one of"),
        (
            "responding",
            {"pursuit": "certified", "table": TABLES["middle"]},
            "`table` must be by the lower bound",
        ),
        ("responding", {"foresight": foresight(0.0)}, "`decision_period` must be positive"),
        ("responding", {"foresight": foresight(horizon=0.0)}, "`rollout.horizon` must be positive"),
        ("responding", {"foresight": foresight(step=0.0)}, "`rollout.step` must be positive"),
        ("responding", {"foresight": foresight(headings=-1)}, "`rollout.headings` must be 0 or"),
        (
            "responding",
            {"foresight": foresight()._replace(beyond=Rollout(1.0, 0.0, 3))},
            "`rollout.step` must be positive",
        ),
    ],
)
def test_numbers_beyond_their_limits_are_refused(names, options, message):
    for name in names.replace("turn_first", "turn-first").split():
        with pytest.raises(InvalidInput, match=message):
            SYSTEMS[name.replace("-", " ")](**options)


@pytest.mark.parametrize("name", ["guarantee", "field", "lookahead", "times"])
def test_an_assignment_names_evaders_or_nobody(name):
    system = SYSTEMS[name]()
    context = system.CreateDefaultContext()
    for k in range(system.num_input_ports()):
        port = system.get_input_port(k)
        port.FixValue(context, np.full(port.size(), 0.5))
    port, output = system.GetInputPort("assignment"), system.get_output_port(0)
    for named in ([0.0, 1.0, -1.0], [1.0, 1.0, 0.0]):
        port.FixValue(context, named)
        assert output.Eval(context).size > 0
    for named in ([0.0, 2.0, -1.0], [0.0, 0.5, -1.0], [-2.0, 0.0, 0.0], [np.nan, 0.0, 0.0]):
        port.FixValue(context, named)
        with pytest.raises(InvalidInput, match="`assignment` must name evaders from 0 to 1, or -1"):
            output.Eval(context)


def test_how_far_evaders_look_ahead_is_as_recorded(as_recorded):
    as_recorded([ALONE, IN_TEAMS])


def committed(system, context, pursuer, evader):
    """The commitments of pursuers, all but the first far away."""
    (other,) = evader[1:]
    values = {
        "pursuer_position": [*pursuer, 2.5, 0.3, 2.5, 0.6],
        "evader_position": [*evader[0], *other],
        "assignment": [0.0, -1.0, -1.0],
    }
    for name, value in values.items():
        system.GetInputPort(name).FixValue(context, value)
    sight = system.GetInputPort("sight")
    sight.FixValue(context, np.ones(sight.size()))
    return system.GetOutputPort("commitment").Eval(context).reshape(-1, 7)


@pytest.mark.parametrize("aside", [True, False])
def test_a_promise_is_void_off_the_way_or_late(aside):
    system = certified()
    context, evader = system.CreateDefaultContext(), ([0.4, 0.3], [2.8, 1.7])
    start = np.array([1.213, 0.517])
    first = committed(system, context, start, evader)
    end, periods = first[0, :2], first[0, 2]
    assert periods == round(TABLES["lower"].step / PERIOD) > 1
    assert np.hypot(*(end - start)) > 0.01
    way = (end - start) / np.hypot(*(end - start))
    kept = first.copy()
    kept[0, 2] -= 1.0
    context.SetDiscreteState(kept.ravel())
    on_course = start + (end - start) / periods
    error = np.array([-way[1], way[0]]) if aside else -way
    rounding = 1e-5 * 0.5 * TABLES["lower"].step
    for off, left in ((0.0, periods - 1), (0.9, periods - 1), (1.1, periods)):
        now = committed(system, context, on_course + off * rounding * error, evader)
        assert now[0, 2] == left
    # Early is not late.
    if not aside:
        assert committed(system, context, on_course + 9 * rounding * way, evader)[0, 2] < periods
    # In the last period the promise still holds, and the way ends with it.
    kept[0, 2] = 1.0
    context.SetDiscreteState(kept.ravel())
    near = end - (end - start) / periods
    assert committed(system, context, near, evader)[0, 2] == 1.0
    time = system.GetOutputPort("guaranteed_time").Eval(context)[0]
    assert time == pytest.approx(PERIOD + kept[0, 4])
    assert system.GetOutputPort("committed").Eval(context).tolist() == [1.0, 0.0, 0.0]
    velocity = system.GetOutputPort("velocity").Eval(context)
    assert near + PERIOD * velocity[:2] == pytest.approx(end)
