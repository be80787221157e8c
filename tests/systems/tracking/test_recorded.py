"""What the systems of a game of tracking put out in a run is as it was recorded."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.geometry.edge_index import build_edge_index, point_is_free
from sightfield.systems.numerics.geometry.segment_sight import build_corner_index
from sightfield.systems.numerics.geometry.world import make_world, shrink_world
from sightfield.systems.numerics.tracking.best_response.rollouts import Rollout
from sightfield.systems.numerics.tracking.sight_state import observe
from sightfield.systems.numerics.tracking.visibility_game.bounds import certified_grid
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders
from sightfield.systems.tracking import (
    AdversarialEvaders,
    AgentTeam,
    Assignment,
    BestResponseEvaders,
    CertifiedPursuit,
    CollisionAvoidance,
    CollisionStop,
    DifferentialDriveTeam,
    GuaranteeAssignment,
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
    TeamGuaranteePursuit,
    TurnFirstController,
    VelocitySelector,
    WaypointEvaders,
)
from sightfield.systems.tracking.best_response_evaders import Foresight

# No wall lies along an axis, and no two corners are alike.
WORLD = make_world(
    [(0.2, -0.3), (3.6, 0.4), (3.1, 1.9), (2.0, 1.6), (1.6, 2.9), (0.4, 2.4), (-0.3, 1.2)],
    [[(0.7, 0.6), (1.4, 0.7), (1.1, 1.5)]],
)
REGIONS = shrink_world(WORLD, 0.06)
INDEX, REGION = build_edge_index(WORLD), build_edge_index(*REGIONS)
CORNERS = build_corner_index(WORLD, INDEX)
PERIOD, SPEED, EVADER_SPEED = 0.13, 0.7, 0.29
RATIO = EVADER_SPEED / SPEED
PURSUERS, EVADERS = 3, 2
SIZES = {"pursuers": PURSUERS, "evaders": EVADERS}
FIELD = {**SIZES, "top_speed": SPEED, "speed_ratio": RATIO}
BODIES = {"radii": [0.05, 0.06, 0.04], "other_radii": [0.05, 0.03]}
LIMITS = {"top_speed": 0.5, "top_turn_rate": 2.3}
CHANGES = 17


@pytest.fixture(scope="module")
def tables():
    """The solved games by the names of their bounds, and that of two evaders."""
    speeds = {"pursuer_speed": SPEED, "evader_speed": EVADER_SPEED}
    turning = {"turning_time": 2 * PERIOD, "bound": "lower"}
    fine = certified_grid(0.4, SPEED, PERIOD)
    return {
        "middle": solve_visibility_game(WORLD, **speeds, grid=0.2),
        "lower": solve_visibility_game(WORLD, **speeds, grid=fine, bound="lower"),
        "turning": solve_visibility_game(WORLD, **speeds, grid=fine, **turning),
        "upper": solve_visibility_game(WORLD, **speeds, grid=0.5, bound="upper"),
        "double": solve_two_evaders(WORLD, **speeds, grid=0.4, horizon=20.0),
    }


def best_response(table=None, double=None, **options):
    foresight = Foresight(
        Rollout(1.3, 0.2, 4), 0.31, beyond=Rollout(2.9, 0.4, 3, leg=0.9), patience=0.5
    )
    speeds = {"pursuer_speed": SPEED, "evader_speed": EVADER_SPEED}
    known = {"foresight": foresight, "radius": 0.04, "table": table, "double": double}
    return BestResponseEvaders(WORLD, REGIONS, REGIONS, **SIZES, **speeds, **known | options)


SYSTEMS = {
    "points": lambda _: AgentTeam(np.ones((3, 2)), top_speed=0.6, time_step=PERIOD),
    "points, continuous": lambda _: AgentTeam(np.ones((3, 2)), top_speed=0.6),
    "drives": lambda _: DifferentialDriveTeam(np.ones((3, 3)), **LIMITS, time_step=PERIOD),
    "drives, continuous": lambda _: DifferentialDriveTeam(np.ones((3, 3)), **LIMITS),
    "heading": lambda _: HeadingController(3),
    "turn first": lambda _: TurnFirstController(3, top_speed=SPEED, period=PERIOD),
    "sight": lambda _: LineOfSight(WORLD, **SIZES, body_radii=[0.1, 0.2, 0.1, 0.15, 0.1]),
    "loss": lambda _: SightLossMonitor(
        WORLD, **SIZES, period=PERIOD, body_radii=[0.1, 0.2, 0.1, 0.15, 0.1]
    ),
    "rule": lambda _: Assignment(WORLD, **SIZES),
    "rule, held": lambda _: Assignment(
        WORLD,
        **SIZES,
        rule="own_riskiest",
        hold="cost",
        period=PERIOD,
        risk_functions=["mean", "total", "nearest"],
        radio_range=1.5,
    ),
    "lots": lambda _: Assignment(
        WORLD, **SIZES, rule="random_visible", hold="until_lost", period=PERIOD, seed=3
    ),
    "spare": lambda _: Assignment(WORLD, **SIZES, rule="hungarian_max", extra="riskiest"),
    "guaranteed": lambda t: GuaranteeAssignment(t["middle"], WORLD, **SIZES),
    "guaranteed, held": lambda t: GuaranteeAssignment(
        t["middle"], WORLD, **SIZES, hold="certificate", period=PERIOD, promised=t["lower"]
    ),
    "guaranteed, until lost": lambda t: GuaranteeAssignment(
        t["middle"], WORLD, **SIZES, hold="until_lost", period=PERIOD
    ),
    "guarantee": lambda t: GuaranteePursuit(t["middle"], WORLD, **SIZES, period=PERIOD),
    "guarantee, continuous": lambda t: GuaranteePursuit(
        t["middle"], WORLD, **SIZES, risk_vectors=["urgency", "majority", "uniform"]
    ),
    "shared": lambda t: TeamGuaranteePursuit(
        t["middle"], t["double"], WORLD, **SIZES, period=PERIOD
    ),
    "certified": lambda t: CertifiedPursuit(t["lower"], WORLD, **SIZES, period=PERIOD),
    "certified bodies": lambda t: CertifiedPursuit(
        t["turning"],
        WORLD,
        **SIZES,
        period=PERIOD,
        radii=[0.05, 0.06, 0.04],
        evader_radii=[0.05, 0.03],
    ),
    "times": lambda t: GuaranteedTime(t["middle"], **SIZES, period=PERIOD),
    "latest times": lambda t: GuaranteedTime(t["upper"], **SIZES, period=0.5),
    "standing": lambda _: StandingCertificate(**SIZES, top_speed=SPEED),
    "avoidance": lambda _: CollisionAvoidance(
        REGIONS, count=3, period=PERIOD, top_speed=SPEED, **BODIES
    ),
    "avoidance, first": lambda _: CollisionAvoidance(
        REGIONS, count=3, period=PERIOD, top_speed=SPEED, **BODIES, rank=1, pace=0.4
    ),
    "avoidance, yielding": lambda _: CollisionAvoidance(
        REGIONS, count=3, period=PERIOD, top_speed=SPEED, **BODIES, rank=-1, pace=0.4
    ),
    "stop": lambda _: CollisionStop(REGIONS, count=3, period=PERIOD, **LIMITS, **BODIES),
    "stop, first": lambda _: CollisionStop(
        count=3, period=PERIOD, **LIMITS, **BODIES, rank=1, pace=0.4, horizon=0.3
    ),
    "field": lambda _: PursuitFieldController(WORLD, **FIELD),
    "field, held": lambda _: PursuitFieldController(
        WORLD, **FIELD, field="table_up", risk_vectors=["least_margin"], period=PERIOD
    ),
    "lookahead": lambda _: LookaheadPursuit(WORLD, REGIONS, **FIELD),
    "modified": lambda _: ModifiedField(**SIZES, weight=0.37, top_speed=SPEED),
    "adversarial": lambda _: AdversarialEvaders(WORLD, **FIELD, radius=0.05),
    "optimal": lambda t: OptimalEvaders(t["middle"], WORLD, REGIONS, **SIZES, radius=0.05),
    "optimal, distance": lambda t: OptimalEvaders(
        t["middle"], WORLD, REGIONS, **SIZES, with_distance=True
    ),
    "random walk": lambda _: RandomWalkEvaders(2, top_speed=EVADER_SPEED, turn_period=0.3, seed=5),
    "random walk, plain": lambda _: RandomWalkEvaders(2, top_speed=EVADER_SPEED),
    "waypoints": lambda _: WaypointEvaders(
        [[(0.1, 0.2), (0.3, 0.1), (0.2, 0.6)], [], [(3.0, 2.0)]], top_speed=2.0, period=PERIOD
    ),
    "selector": lambda _: VelocitySelector([1, 0, 2], sources=3),
    "responding": lambda _: best_response(assignment="hungarian_max", extra="riskiest"),
    "responding to the table": lambda _: best_response(
        pursuit="table", hold="none", assignment="borda_max", risk_vectors=["uniform"]
    ),
    "responding to a guarantee": lambda t: best_response(t["middle"], pursuit="guarantee"),
    "responding to a promise": lambda t: best_response(t["lower"], pursuit="certified"),
    "responding to shares": lambda t: best_response(t["middle"], t["double"], pursuit="guarantee"),
}


class Inputs:
    """Random values of all ports that the systems have, in a game that drifts on."""

    def __init__(self, seed):
        self.rng = np.random.default_rng(seed)
        self.pursuers, self.evaders = (self.draw(count) for count in (PURSUERS, EVADERS))

    def draw(self, count):
        """Random places where robots have room."""
        points = self.rng.uniform(WORLD.bounds[:2], WORLD.bounds[2:], (200, 2))
        return points[[bool(point_is_free(REGION, *point)) for point in points]][:count]

    def go_on(self, velocities=None):
        """A step of wandering, now and then a leap; with velocities pursuers keep those."""
        for team in (self.evaders,) if velocities is not None else (self.pursuers, self.evaders):
            after = team + self.rng.uniform(-0.07, 0.07, team.shape)
            free = np.array([bool(point_is_free(REGION, *point)) for point in after])
            team[free] = after[free]
        if velocities is not None:
            self.pursuers += PERIOD * velocities.reshape(-1, 2)
        elif self.rng.random() < 0.2:
            self.pursuers[0] = self.draw(1)

    def value(self, name, size):
        """A value for a port."""
        rng, p, e = self.rng, self.pursuers.ravel(), self.evaders.ravel()
        count = size // (3 if name == "pose" else 2)
        match name:
            case "pursuer_position":
                return p
            case "evader_position":
                return np.resize(e, size)
            case "position":
                return self.pursuers.ravel()
            case "other_position":
                return (self.pursuers[:EVADERS] + 0.12).ravel()
            case "pose":
                return np.column_stack([self.pursuers, rng.uniform(-3, 3, count)]).ravel()
            case "sight":
                return observe(INDEX, CORNERS, p, e)
            case "assignment":
                return rng.integers(-1 if rng.random() < 0.3 else 0, EVADERS, size)
            case "responsible":
                return rng.integers(-1, PURSUERS, size)
            case "right_of_way":
                return rng.integers(0, 2, size)
            case "guaranteed_time":
                return np.where(rng.random(size) < 0.4, np.inf, rng.uniform(-1, 5, size))
            case "deflection":
                return rng.choice([0.0, 0.9e-5 * SPEED, 1.1e-5 * SPEED], size)
        return rng.uniform(-0.6, 0.6, size)


@pytest.mark.parametrize("name", SYSTEMS)
def test_a_run_is_as_recorded(name, tables, as_recorded):
    system, inputs, found = SYSTEMS[name](tables), Inputs(len(name)), {}
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    ports = [system.get_input_port(k) for k in range(system.num_input_ports())]
    outputs = [system.get_output_port(k) for k in range(system.num_output_ports())]
    as_recorded([[port.get_name(), port.size()] for port in (*ports, *outputs)], "ports")
    assignment = None
    for step in range(CHANGES):
        for port in ports:
            value = inputs.value(port.get_name(), port.size())
            if port.get_name() == "assignment":
                # It stays for a while, as teams hold theirs.
                assignment = value if step % 5 == 0 else assignment
                value = assignment
            port.FixValue(context, np.array(value, dtype=float))
        if step == 0:
            simulator.Initialize()
        for port in outputs:
            found.setdefault(f"{port.get_name()} before", []).append(port.Eval(context))
        simulator.AdvanceTo((step + 0.7) * PERIOD)
        for port in outputs:
            found.setdefault(port.get_name(), []).append(port.Eval(context))
        # Who commits itself goes there for a while.
        kept = system.HasOutputPort("committed") and step % 9 < 7
        inputs.go_on(found["velocity before"][-1] if kept else None)
    as_recorded({name: np.array(values) for name, values in found.items()})
