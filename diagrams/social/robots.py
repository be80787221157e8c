"""The robots of a search: what moves them, what keeps them apart, and what their cameras see."""

from dataclasses import dataclass
from functools import partial

from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, Demultiplexer, Multiplexer

from ...systems.drake_parts import add_named
from ...systems.numerics.social.routes.motion import FollowingLaw, WanderingLaw
from ...systems.numerics.social.routes.shortest_route import build_route_graph
from ...systems.numerics.vision.sensor import Sensor
from ...systems.social.common_robots import CrowdGuard, InfraredSensors, Wanderers
from ...systems.social.evader_locator import EvaderLocator
from ...systems.social.forward_cameras import ForwardCameras
from ...systems.social.route_pursuer import RoutePursuer
from ...systems.tracking.agent_team import DifferentialDriveTeam
from ...systems.tracking.collision_avoidance import CollisionStop
from .social_game import TOP_TURN_RATE, SocialGame

# Gap that robots leave between each other [m].
ROBOT_GAP = 0.01


@dataclass(frozen=True, eq=False)
class RobotPorts:
    """How the robots are wired.

    Attributes:
        evader_position, located_at: Inputs of the pursuer, see `RoutePursuer`.
        pose: Output, poses of all robots, the pursuer's first, then the evader's, size 3 N.
        pursuer_pose, evader_pose: Outputs, size 3 each.
        agent_pose: Output, size 3 times the number of common agents.
        infrared: Output, what all sensors say.
        route: Output, where the pursuer goes.
    """

    evader_position: InputPort
    located_at: InputPort
    pose: OutputPort
    pursuer_pose: OutputPort
    evader_pose: OutputPort
    agent_pose: OutputPort
    infrared: OutputPort
    route: OutputPort


def AddRobots(builder: DiagramBuilder, game: SocialGame) -> RobotPorts:
    """Add all robots with their infrared sensors, drivers and guards to a diagram."""
    scenario, maze, ring = game.scenario, game.maze, game.ring
    count, agents, period = game.robots, scenario.agents.size, scenario.period
    top_speed = max(scenario.pursuer.speed, scenario.evader.speed, scenario.agents.speed)
    limits = {"top_speed": top_speed, "top_turn_rate": TOP_TURN_RATE}
    add, connect = partial(add_named, builder), builder.Connect

    robots = add("robots", DifferentialDriveTeam(game.starts, time_step=period, **limits))
    pose = robots.GetOutputPort("pose")
    sensors = InfraredSensors(maze.world, count=count, radius=maze.robot_radius, ring=ring)
    infrared = add("infrared_sensors", sensors).GetOutputPort("infrared")
    poses = add("poses", Demultiplexer([3, 3, 3 * agents]))
    ranges = add("ranges", Demultiplexer([ring.count, ring.count, ring.count * agents]))
    connect(pose, sensors.GetInputPort("pose"))
    connect(pose, poses.get_input_port())
    connect(infrared, ranges.get_input_port())

    graph = build_route_graph(game.route_regions)
    law = FollowingLaw(speed=scenario.pursuer.speed, stand_off=scenario.pursuer.stand_off)
    pursuer = RoutePursuer(
        graph,
        maze.world,
        game.regions,
        law=law,
        ring=ring,
        radius=maze.robot_radius,
        period=period,
    )
    add("pursuer", pursuer)
    connect(poses.get_output_port(0), pursuer.GetInputPort("pose"))
    connect(ranges.get_output_port(0), pursuer.GetInputPort("infrared"))

    commands = add("commands", Multiplexer([2, 2, 2 * agents]))
    connect(pursuer.GetOutputPort("command"), commands.get_input_port(0))
    seeds = {"evader": 2 * scenario.seed, "common_agents": 2 * scenario.seed + 1}
    for place, name, size, speed in (
        (1, "evader", 1, scenario.evader.speed),
        (2, "common_agents", agents, scenario.agents.speed),
    ):
        if name == "evader" and scenario.evader.policy == "rest":
            still = add("evader", ConstantVectorSource([0.0, 0.0]))  # type: ignore[arg-type]  # the stubs want an array's shape
            connect(still.get_output_port(), commands.get_input_port(place))
            continue
        walk = WanderingLaw(speed=speed)
        walkers = Wanderers(size, law=walk, ring=ring, period=period, seed=seeds[name])
        add(name, walkers)
        connect(ranges.get_output_port(place), walkers.GetInputPort("infrared"))
        connect(walkers.GetOutputPort("command"), commands.get_input_port(place))

    guard = CrowdGuard(
        count=count, ring=ring, margin=ROBOT_GAP, period=period, top_turn_rate=TOP_TURN_RATE
    )
    stop = CollisionStop(
        game.regions,
        count=count,
        period=period,
        top_speed=limits["top_speed"],
        top_turn_rate=limits["top_turn_rate"],
    )
    add("crowd_guard", guard)
    add("wall_stop", stop)
    connect(commands.get_output_port(), guard.GetInputPort("command"))
    connect(infrared, guard.GetInputPort("infrared"))
    connect(pose, stop.GetInputPort("pose"))
    connect(guard.GetOutputPort("safe_command"), stop.GetInputPort("command"))
    connect(stop.GetOutputPort("safe_command"), robots.GetInputPort("command"))
    return RobotPorts(
        evader_position=pursuer.GetInputPort("evader_position"),
        located_at=pursuer.GetInputPort("located_at"),
        pose=pose,
        pursuer_pose=poses.get_output_port(0),
        evader_pose=poses.get_output_port(1),
        agent_pose=poses.get_output_port(2),
        infrared=infrared,
        route=pursuer.GetOutputPort("route"),
    )


# What the locator tells beside where the evader is.
FOUND = ("readings", "locations", "evader_position", "evader_covariance", "located_at")


def AddCameras(builder: DiagramBuilder, game: SocialGame, robots: RobotPorts) -> OutputPort:
    """Add the cameras; return the output with each agent's newest picture."""
    scenario = game.scenario
    camera = scenario.camera
    cameras = ForwardCameras(
        game.maze,
        scenario.agents.size,
        sensor=Sensor(noise=camera.noise, blur=camera.blur, seed=scenario.seed),
        period=camera.period,
    )
    add_named(builder, "cameras", cameras)
    builder.Connect(robots.agent_pose, cameras.GetInputPort("agent_pose"))
    builder.Connect(robots.evader_pose, cameras.GetInputPort("evader_pose"))
    builder.Connect(robots.pursuer_pose, cameras.GetInputPort("pursuer_pose"))
    return cameras.GetOutputPort("pictures")


def AddLocator(
    builder: DiagramBuilder, game: SocialGame, pictures: OutputPort, *, offset: float
) -> dict[str, OutputPort]:
    """Add what finds the evader in pictures that were read; return its outputs, see FOUND.

    Args:
        builder: Of the diagram.
        game: Whose maze and evader.
        pictures: New ones after each look at the albums.
        offset: Of the first look at them [s].
    """
    scenario = game.scenario
    locator = EvaderLocator(
        game.maze,
        speed=scenario.evader.speed,
        period=scenario.search.period,
        offset=offset,
        features=scenario.search.method,
        method=scenario.search.localisation,
    )
    add_named(builder, "evader_locator", locator)
    builder.Connect(pictures, locator.GetInputPort("pictures"))
    return {name: locator.GetOutputPort(name) for name in FOUND}
