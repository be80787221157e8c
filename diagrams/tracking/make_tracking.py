"""The tracking diagram: agents, line of sight, assignment, pursuit field, walls, and back."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Demultiplexer,
    LinearSystem,
)

from ...systems.drake_parts import add_named
from ...systems.numerics.errors import require, require_one_of, require_type
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.visibility_polygon import visibility_polygon
from ...systems.numerics.tracking.assignment.holding import HOLDS
from ...systems.numerics.tracking.assignment.rules import AssignmentRule
from ...systems.numerics.tracking.corner_game import corner_table
from ...systems.numerics.tracking.corner_policies import FIELDS
from ...systems.numerics.tracking.risk import RISK_VECTORS
from ...systems.numerics.tracking.team_pursuit import sample_field
from ...systems.tracking.assignment import Assignment, GuaranteeAssignment
from ...systems.tracking.certified_pursuit import CertifiedPursuit
from ...systems.tracking.game_ports import codes_of
from ...systems.tracking.guarantee_pursuit import GuaranteePursuit, TeamGuaranteePursuit
from ...systems.tracking.guaranteed_time import GuaranteedTime, StandingCertificate
from ...systems.tracking.line_of_sight import LineOfSight, SightLossMonitor
from ...systems.tracking.pursuit_laws import LookaheadPursuit, PursuitFieldController
from .evasion import AddEvasion
from .game import TrackingGame, set_up_game
from .scenario import CERTIFIED, GUARANTEE, LOOKAHEAD, OPTIMAL_POLICIES, TrackingScenario
from .scene import LosingSet, TrackingScene, View
from .solved_game import losing_strips, solved_game, solved_game_of_two
from .team_ports import AddTeam, TeamPorts

# Whom each pursuer is to chase, as a rule's name, a rule, or a system; see `AddTracking`.
OwnAssignment = str | System | AssignmentRule

# About how long a picture lasts [s].
PICTURE_PERIOD = 1 / 32

# Drawn where robots are points; the scene enlarges what is too small to see [m].
SMALLEST_BODY = 1e-3


def MakeTracking(
    scenario: TrackingScenario | TrackingGame,
    meshcat: Meshcat | None = None,
    *,
    assignment: OwnAssignment | None = None,
    pursuit: System | None = None,
    evasion: System | None = None,
    publish_period: float | None = None,
    recording: bool = False,
    view: Callable[[], View] = View,
) -> Diagram:
    """Make the diagram of a tracking game.

    Output ports, in the order in which data flows: `pursuer_position` (2 Np) [m],
    `evader_position` (2 Ne) [m], `visibility` (Np Ne), `assignment` (Np),
    `pursuer_velocity` (2 Np) and `evader_velocity` (2 Ne), as desired [m/s],
    `pursuer_direction` (2 Np), `evader_direction` (2 Ne), and `loss` (2): the time at which an
    evader is first seen by nobody [s], or infinity, and its number, or -1. Where the solved
    visibility game is looked up also `certificate` (1): for how long all evaders can be kept in
    sight from now on, whatever they do [s], or infinity; see `CertifiedPursuit` and
    `GuaranteedTime`. Certified pursuers have `guaranteed_time` (Np) too, for how long each keeps
    its own evader [s], and `withdrawn` (Np), 1 where that is void because it is deflected; see
    `StandingCertificate`.

    Args:
        scenario: What is played, or a game already set up.
        meshcat: Where to draw it; None draws nothing.
        assignment, pursuit, evasion: Of your own, see `AddTracking`.
        publish_period: Time between pictures [s]; None for the multiple of the scenario's period
            that is nearest to 1/32 s. At such times the teams are where their samples say; between
            them a discrete team is already where it will be at the next.
        recording: Record the pictures, for `write_replay` on the subsystem "scene".
        view: Whose view to show at each picture.

    Raises:
        InvalidInput: See `set_up_game` and `AddTracking`.
    """
    require_type("scenario", scenario, TrackingScenario, TrackingGame)
    game = set_up_game(scenario) if isinstance(scenario, TrackingScenario) else scenario
    builder = DiagramBuilder()
    outputs = AddTracking(
        builder, game, meshcat, assignment=assignment, pursuit=pursuit, evasion=evasion
    )
    if meshcat is not None:
        certificate = _certificate_of(outputs)
        if publish_period is None:
            period = game.scenario.period
            publish_period = period * max(round(PICTURE_PERIOD / period), 1)
        scene = TrackingScene(
            game.world,
            game.pursuer_regions,
            meshcat,
            pursuers=game.scenario.pursuers.size,
            evaders=game.scenario.evaders.size,
            robot_radius=max(game.scenario.pursuers.radius, SMALLEST_BODY),
            evader_radius=game.scenario.evaders.radius,
            publish_period=publish_period,
            visibility_polygon=_view_from(game),
            pursuit_field=_field_of(game),
            losing_set=None if certificate is None else _losing_set_of(game, certificate),
            certificate=None if certificate is None else certificate.words,
            recording=recording,
            view=view,
        )
        add_named(builder, "scene", scene)
        for k in range(scene.num_input_ports()):
            port = scene.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    for name, output in outputs.items():
        builder.ExportOutput(output, name)
    diagram = builder.Build()
    diagram.set_name("tracking")
    return diagram


def AddTracking(
    builder: DiagramBuilder,
    game: TrackingGame,
    meshcat: Meshcat | None = None,
    *,
    assignment: OwnAssignment | None = None,
    pursuit: System | None = None,
    evasion: System | None = None,
    teams: tuple[TeamPorts, TeamPorts] | None = None,
) -> dict[str, OutputPort]:
    """Wire a tracking game into a diagram; return its outputs by name (see `MakeTracking`).

    A system of your own is wired by the names of its input ports, which may be
    `pursuer_position` (2 Np) [m], `evader_position` (2 Ne) [m] and `sight`, as `LineOfSight`
    gives it; a pursuit may have `assignment` (Np) too, and an evasion also `velocity` (2 Np)
    [m/s], the pursuers' as desired.

    Args:
        builder: Of the diagram.
        game: What is played.
        meshcat: The page on which you drive the evader whose policy is "you".
        assignment: Instead of the scenario's rule: a name in `ASSIGNMENT_RULES`, a function of a
            TeamView, or a system with the output port `assignment` (Np), the evader of each pursuer
            or -1. With none, pursuers by the solved game that are fewer than their evaders answer
            for several each, whatever the scenario's rule (`TeamGuaranteePursuit`).
        pursuit: Instead of the scenario's field: a system with the output port `velocity` (2 Np),
            the velocities that the pursuers wish for [m/s].
        evasion: Instead of the scenario's policies: a system with the output port `velocity`
            (2 Ne), the velocities that the evaders wish for [m/s].
        teams: Pursuers and evaders that are in the diagram already, as those of a station are,
            instead of simulated ones.

    Raises:
        InvalidInput: A system of yours has an input port of another name, or lacks its output
            port; see also `AddEvasion`.
        RuntimeError: A port of yours has another size.
    """
    require_type("game", game, TrackingGame)
    scenario, world, period = game.scenario, game.world, game.scenario.period
    pursuers, evaders = scenario.pursuers, scenario.evaders
    sizes = {"pursuers": pursuers.size, "evaders": evaders.size}
    pursuing, evading = teams or AddTeams(builder, game)
    senses = {"pursuer_position": pursuing.position, "evader_position": evading.position}

    def add(name, system):
        """Add a system and connect its inputs to what is sensed already."""
        add_named(builder, name, system)
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            require_one_of(f"{name}: input port", port.get_name(), senses)
            builder.Connect(senses[port.get_name()], port)
        for k in range(system.num_output_ports()):
            output = system.get_output_port(k)
            senses.setdefault(output.get_name(), output)
        return system

    blocking = scenario.blocking_radii
    line_of_sight = LineOfSight(world, **sizes, body_radii=blocking)
    sight = add("line_of_sight", line_of_sight).GetOutputPort("sight")
    # The block that says who sees whom, for whoever watches.
    whom = pursuers.size * evaders.size
    blocks = Demultiplexer([whom, sight.size() - whom] if sight.size() > whom else [whom])
    add_named(builder, "sight_blocks", blocks)
    builder.Connect(sight, blocks.get_input_port())
    if assignment is None and pursuit is None and _answers_for_several(scenario):
        # It says itself who goes after whom.
        pursuit = assignment = _team_pursuit_of(game)
    elif assignment is None:
        assignment = _assignment_of(game)
    elif not isinstance(assignment, System):
        assignment = _assignment_by(game, assignment)
    has_assignment = assignment.HasOutputPort("assignment")
    require(has_assignment, "assignment", "have an output port assignment", "none")
    if assignment is not pursuit:
        add("assignment", assignment)
    if pursuit is None:
        pursuit = _pursuit_of(game)
    has_velocity = pursuit.HasOutputPort("velocity")
    require(has_velocity, "pursuit", "have an output port velocity", "none")
    add("pursuit", pursuit)
    monitor = add(
        "sight_loss", SightLossMonitor(world, **sizes, period=period, body_radii=blocking)
    )
    wished = pursuit.GetOutputPort("velocity")
    certified = isinstance(pursuit, CertifiedPursuit)
    # A mean of commands would not be there in time.
    smoothing = 0.0 if certified else pursuers.smoothing
    pursuer_velocity = AddSmoothing(builder, wished, smoothing, period)
    if not pursuit.HasOutputPort("certificate") and _looks_up_the_game(game):
        add("guaranteed_time", GuaranteedTime(solved_game(game), **sizes, period=period))
    if evasion is None:
        evader_velocity = AddEvasion(builder, game, senses, meshcat)
    else:
        has_velocity = evasion.HasOutputPort("velocity")
        require(has_velocity, "evasion", "have an output port velocity", "none")
        evader_velocity = add("evasion", evasion).GetOutputPort("velocity")
    builder.Connect(pursuer_velocity, pursuing.velocity)
    builder.Connect(evader_velocity, evading.velocity)
    outputs = {
        "pursuer_position": pursuing.position,
        "evader_position": evading.position,
        "visibility": blocks.get_output_port(0),
        "assignment": senses["assignment"],
        "pursuer_velocity": pursuer_velocity,
        "evader_velocity": evader_velocity,
        "pursuer_direction": pursuing.direction,
        "evader_direction": evading.direction,
        "loss": monitor.GetOutputPort("loss"),
    }
    if certified:
        for port in pursuing.right_of_way:
            builder.Connect(pursuit.GetOutputPort("committed"), port)
        standing = _add_standing_certificate(builder, game, senses, pursuing)
        outputs["guaranteed_time"] = senses["guaranteed_time"]
        outputs |= {name: standing.GetOutputPort(name) for name in ("certificate", "withdrawn")}
    elif "certificate" in senses:
        outputs["certificate"] = senses["certificate"]
    return outputs


def _add_standing_certificate(
    builder: DiagramBuilder,
    game: TrackingGame,
    senses: dict[str, OutputPort],
    pursuing: TeamPorts,
) -> System:
    """Add what withdraws the promises of pursuers that are deflected."""
    pursuers = game.scenario.pursuers
    standing = StandingCertificate(
        pursuers=pursuers.size,
        evaders=game.scenario.evaders.size,
        top_speed=pursuers.top_speed,
    )
    add_named(builder, "standing_certificate", standing)
    for name in ("guaranteed_time", "assignment"):
        builder.Connect(senses[name], standing.GetInputPort(name))
    builder.Connect(
        _sum(builder, pursuing.deflections, pursuers.size), standing.GetInputPort("deflection")
    )
    return standing


def _sum(builder: DiagramBuilder, deflections: tuple[OutputPort, ...], size: int) -> OutputPort:
    """By how much all parts together deflect each robot; by nothing where there are none."""
    if not deflections:
        zeros = ConstantVectorSource(np.zeros(size))  # pyright: ignore[reportArgumentType]  # stubs want a shape
        none = add_named(builder, "no_deflection", zeros)
        return none.get_output_port()
    total = add_named(builder, "deflections", Adder(len(deflections), size))
    for k, deflection in enumerate(deflections):
        builder.Connect(deflection, total.get_input_port(k))
    return total.get_output_port()


def _looks_up_the_game(game: TrackingGame) -> bool:
    """Whether a team plays by the middle bound of the solved visibility game."""
    pursuers, policies = game.scenario.pursuers, game.scenario.evaders.policy_of_each
    return GUARANTEE in (pursuers.field, pursuers.assignment) or any(
        policy in OPTIMAL_POLICIES for policy in policies
    )


def _assignment_of(game: TrackingGame) -> System:
    """The scenario's own assignment."""
    scenario, pursuers = game.scenario, game.scenario.pursuers
    if pursuers.assignment != GUARANTEE:
        return _assignment_by(game, pursuers.assignment)
    return GuaranteeAssignment(
        solved_game(game),
        game.world,
        pursuers=pursuers.size,
        evaders=scenario.evaders.size,
        hold=pursuers.switch,
        period=scenario.period,
        promised=solved_game(game, "lower") if pursuers.field == CERTIFIED else None,
    )


def _assignment_by(game: TrackingGame, rule: str | AssignmentRule) -> Assignment:
    """An assignment by a rule, with the scenario's hold if that is one for rules."""
    scenario, pursuers = game.scenario, game.scenario.pursuers
    hold = pursuers.hold if pursuers.hold in HOLDS else "until_lost"
    return Assignment(
        game.world,
        pursuers=pursuers.size,
        evaders=scenario.evaders.size,
        rule=rule,
        hold=hold,
        period=scenario.period,
        risk_functions=pursuers.risk_functions,
        extra=pursuers.extra,
        seed=scenario.seed,
        radio_range=pursuers.radio_range,
    )


def _answers_for_several(scenario: TrackingScenario) -> bool:
    """Whether pursuers that play by the solved game in all are fewer than their evaders."""
    pursuers = scenario.pursuers
    by_the_game = pursuers.field == pursuers.assignment == GUARANTEE
    return by_the_game and pursuers.size < scenario.evaders.size


def _team_pursuit_of(game: TrackingGame) -> TeamGuaranteePursuit:
    """Pursuers that answer for several evaders each."""
    scenario = game.scenario
    return TeamGuaranteePursuit(
        solved_game(game),
        solved_game_of_two(game),
        game.world,
        pursuers=scenario.pursuers.size,
        evaders=scenario.evaders.size,
        risk_vectors=scenario.pursuers.risk_vectors,
        period=scenario.period,
    )


def _pursuit_of(game: TrackingGame) -> System:
    """The scenario's own pursuit."""
    scenario, pursuers = game.scenario, game.scenario.pursuers
    if pursuers.field == LOOKAHEAD:
        return LookaheadPursuit(
            game.world,
            game.pursuer_regions,
            pursuers=pursuers.size,
            evaders=scenario.evaders.size,
            top_speed=pursuers.top_speed,
            speed_ratio=scenario.speed_ratio,
        )
    if pursuers.field == GUARANTEE:
        return GuaranteePursuit(
            solved_game(game),
            game.world,
            pursuers=pursuers.size,
            evaders=scenario.evaders.size,
            risk_vectors=pursuers.risk_vectors,
            period=scenario.period,
        )
    if pursuers.field == CERTIFIED:
        return CertifiedPursuit(
            solved_game(game, "lower"),
            game.world,
            pursuers=pursuers.size,
            evaders=scenario.evaders.size,
            risk_vectors=pursuers.risk_vectors,
            period=scenario.period,
            radii=scenario.pursuer_radii or 0.0,
            evader_radii=scenario.evader_radii or 0.0,
        )
    return PursuitFieldController(
        game.world,
        pursuers=pursuers.size,
        evaders=scenario.evaders.size,
        top_speed=pursuers.top_speed,
        speed_ratio=scenario.speed_ratio,
        field=pursuers.field,
        risk_vectors=pursuers.risk_vectors,
        period=scenario.period,
    )


def AddSmoothing(
    builder: DiagramBuilder, velocity: OutputPort, time_constant: float, period: float
) -> OutputPort:
    """Add the exponential mean y[n] = (1 - k) y[n-1] + k u[n], k = 1 - exp(-period / T).

    Args:
        builder: Of the diagram.
        velocity: The input u.
        time_constant: T [s]; 0 adds nothing.
        period: [s].

    Returns:
        The mean y, from zero at the start; the input itself where T is 0.
    """
    if time_constant == 0:
        return velocity
    k = 1.0 - math.exp(-period / time_constant)
    keep, take = (1.0 - k) * np.eye(velocity.size()), k * np.eye(velocity.size())
    # The stubs lag behind NumPy's.
    mean = LinearSystem(A=keep, B=take, C=keep, D=take, time_period=period)  # type: ignore[arg-type]
    add_named(builder, "smoothing", mean)
    builder.Connect(velocity, mean.get_input_port())
    return mean.get_output_port()


def AddTeams(builder: DiagramBuilder, game: TrackingGame) -> tuple[TeamPorts, TeamPorts]:
    """Add both teams of a game, which keep off one another if they have bodies.

    Args:
        builder: Of the diagram.
        game: Whose teams.

    Returns:
        Pursuers and evaders.

    Raises:
        InvalidInput: `game` is no TrackingGame, or a name in the diagram is taken.
    """
    require_type("game", game, TrackingGame)
    scenario, period = game.scenario, game.scenario.period
    # Evaders yield to pursuers that keep promises.
    rank = 1 if scenario.pursuers.field == CERTIFIED else 0
    pursuing = AddTeam(
        builder,
        "pursuer",
        scenario.pursuers,
        game.pursuer_starts,
        game.pursuer_regions,
        period,
        scenario.evader_radii,
        rank=rank,
    )
    evading = AddTeam(
        builder,
        "evader",
        scenario.evaders,
        game.evader_starts,
        game.evader_regions,
        period,
        scenario.pursuer_radii,
        rank=-rank,
        pace=scenario.pursuers.top_speed,
    )
    ConnectTeams(builder, pursuing, evading)
    return pursuing, evading


def ConnectTeams(builder: DiagramBuilder, first: TeamPorts, second: TeamPorts) -> None:
    """Let two teams know where the other's robots are.

    Args:
        builder: Of the diagram.
        first, second: With others to keep off, or without.
    """
    for team, other in ((first, second), (second, first)):
        for port in team.others:
            builder.Connect(other.position, port)


def _view_from(game: TrackingGame) -> Callable[[np.ndarray], np.ndarray]:
    index = build_edge_index(game.world)
    return lambda point: visibility_polygon(index, point)


class _Certificate(NamedTuple):
    """What a diagram's certificate is.

    Attributes:
        bound: Of the visibility game.
        words: What to call it.
    """

    bound: str
    words: str


def _certificate_of(outputs: dict[str, OutputPort]) -> _Certificate | None:
    """Of the outputs of `AddTracking`; None where there is none."""
    if "certificate" not in outputs:
        return None
    if isinstance(outputs["certificate"].get_system(), StandingCertificate):
        return _Certificate("lower", "certified for")
    return _Certificate("middle", "could be kept for")


def _losing_set_of(game: TrackingGame, certificate: _Certificate) -> LosingSet:
    """Where a pursuer would lose an evader, for the scene."""
    table, view = solved_game(game, certificate.bound), _view_from(game)
    return lambda pursuer: losing_strips(table, view, pursuer)


def _field_of(game: TrackingGame) -> Callable[..., np.ndarray]:
    """The pursuit field of the evader that a pursuer is assigned to, for the scene."""
    index, corners = build_edge_index(game.world), corner_table(game.world)
    pursuers, ratio = game.scenario.pursuers, game.scenario.speed_ratio
    # Lookahead has no field of its own: what it looks at are the margins.
    field = FIELDS.get(pursuers.field, FIELDS["margin"])
    weightings = codes_of("risk_vectors", pursuers.risk_vectors, RISK_VECTORS, pursuers.size)

    def directions(pursuer, points, evaders, assignment):
        target = assignment[pursuer]
        if target < 0:
            return np.zeros_like(points)
        ex, ey = evaders[target]
        return sample_field(index, points, ex, ey, corners, field, int(weightings[pursuer]), ratio)

    return directions
