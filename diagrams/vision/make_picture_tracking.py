"""Tracking on pictures: a tracking game whose pursuers know of evaders what cameras tell them."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort
from pydrake.systems.primitives import ConstantVectorSource, Demultiplexer, Multiplexer

from ...systems.drake_parts import add_named
from ...systems.numerics.errors import require_type
from ...systems.numerics.geometry.edge_index import build_edge_index
from ...systems.numerics.geometry.visibility_polygon import visibility_polygon
from ...systems.numerics.tracking.corner_game import corner_table
from ...systems.numerics.tracking.corner_policies import FIELDS
from ...systems.numerics.tracking.risk import RISK_VECTORS
from ...systems.numerics.tracking.team_pursuit import modified_velocities, sample_field
from ...systems.tracking.assignment import Assignment
from ...systems.tracking.game_ports import codes_of
from ...systems.tracking.line_of_sight import LineOfSight, SightLossMonitor
from ...systems.tracking.pursuit_laws import ModifiedField, PursuitFieldController
from ...systems.vision.evader_tracker import EvaderTracker
from ...systems.vision.omni_camera import OmniCameraSensor
from ...systems.vision.shell_estimator import ShellEstimator
from ..tracking.evasion import AddEvasion
from ..tracking.make_tracking import PICTURE_PERIOD, AddSmoothing, AddTeams
from ..tracking.scene import TrackingScene, View
from .picture_scene import PictureScene
from .scenario import PictureGame


def AddEyes(
    builder: DiagramBuilder, game: PictureGame, evader_position: OutputPort
) -> dict[str, OutputPort]:
    """Add a camera and an estimator on each pursuer, and what joins their estimates.

    Args:
        builder: Of the diagram, which has the pursuers as "pursuer_team".
        game: Whose.
        evader_position: Where the shells to look for are, size 2 Ne [m].

    Returns:
        Outputs: `evader_estimate`, `evader_known`, `evader_set`, `valid`, `frame` and
        `image_0`, ... as
        `MakePictureTracking` says.
    """
    scenario, vision = game.scenario, game.scenario.vision
    count, evaders = scenario.pursuers.size, scenario.evaders.size
    team = builder.GetSubsystemByName("pursuer_team")
    add, connect = partial(add_named, builder), builder.Connect
    poses = add("poses", Demultiplexer(3 * count, 3))
    places = add("places", Demultiplexer(2 * count, 2))
    connect(team.GetOutputPort("pose"), poses.get_input_port())
    connect(team.GetOutputPort("position"), places.get_input_port())
    tracker = EvaderTracker(
        game.world,
        game.evader_regions,
        cameras=count,
        colours=vision.colours,
        speed=scenario.evaders.top_speed,
        period=vision.picture_period,
        # A picture takes one control period to be read.
        delay=scenario.period,
        shell_radius=vision.shell_radius,
        body_radius=vision.pursuer_shell.radius,
    )
    add("evader_tracker", tracker)
    valid, frames = (
        add(name, Multiplexer([size] * count)) for name, size in (("valid", evaders), ("frame", 3))
    )
    outputs: dict[str, OutputPort] = {
        "evader_estimate": tracker.GetOutputPort("evader_position"),
        "evader_known": tracker.GetOutputPort("evader_known"),
        "evader_set": tracker.GetOutputPort("evader_set"),
        "valid": valid.get_output_port(),
        "frame": frames.get_output_port(),
    }
    for i in range(count):
        others = [k for k in range(count) if k != i]
        camera = OmniCameraSensor(
            vision.optics,
            replace(vision.quality, seed=vision.quality.seed + count * scenario.seed + i),
            game.surroundings,
            [*vision.evader_shells, *(vision.pursuer_shell for _ in others)],
            own_shell=vision.pursuer_shell,
            period=vision.picture_period,
        )
        estimator = ShellEstimator(game.calibration, vision.colours, model=vision.model)
        add(f"camera_{i}", camera)
        add(f"estimator_{i}", estimator)
        shells = add(f"shells_{i}", Multiplexer([2 * evaders, *(2 for _ in others)]))
        connect(evader_position, shells.get_input_port(0))
        for place, k in enumerate(others, start=1):
            connect(places.get_output_port(k), shells.get_input_port(place))
        connect(poses.get_output_port(i), camera.GetInputPort("pose"))
        connect(shells.get_output_port(), camera.GetInputPort("shell_position"))
        connect(camera.GetOutputPort("image"), estimator.GetInputPort("image"))
        connect(camera.GetOutputPort("exposure_pose"), estimator.GetInputPort("pose"))
        for source, names in (
            (estimator, ("position", "covariance", "valid", "outcome")),
            (camera, ("frame", "exposure_pose")),
        ):
            for name in names:
                connect(source.GetOutputPort(name), tracker.GetInputPort(f"{name}_{i}"))
        connect(estimator.GetOutputPort("valid"), valid.get_input_port(i))
        connect(camera.GetOutputPort("frame"), frames.get_input_port(i))
        outputs[f"image_{i}"] = camera.GetOutputPort("image")
    return outputs


def modified_field_of(game: PictureGame) -> Callable[..., np.ndarray]:
    """What (2.7) would have a pursuer do anywhere, for the evader that it is assigned to.

    Returns:
        A function of (pursuer, points (m, 2) [m], evaders (Ne, 2) [m], assignment (Np,)) that gives
        velocities in units of the top speed, shape (m, 2).
    """
    scenario, vision = game.scenario, game.scenario.vision
    index, corners = build_edge_index(game.world), corner_table(game.world)
    pursuers, ratio = scenario.pursuers, scenario.speed_ratio
    field = FIELDS[pursuers.field]
    weightings = codes_of("risk_vectors", pursuers.risk_vectors, RISK_VECTORS, pursuers.size)

    def velocities(pursuer, points, evaders, assignment):
        target = assignment[pursuer]
        if target < 0:
            return np.zeros_like(points)
        ex, ey = evaders[target]
        along = sample_field(index, points, ex, ey, corners, field, int(weightings[pursuer]), ratio)
        # Every point is a pursuer after the same evader.
        return modified_velocities(
            vision.weight,
            1.0,
            vision.stand_off,
            vision.fade,
            np.ascontiguousarray(points, dtype=float).ravel(),
            np.asarray(evaders, dtype=float).ravel(),
            np.full(len(points), float(target)),
            along.ravel(),
        ).reshape(-1, 2)

    return velocities


# How often the pictures shown beside the map change [s].
SHOWN_PERIOD = 0.25


def MakePictureTracking(
    game: PictureGame,
    meshcat: Meshcat | None = None,
    *,
    recording: bool = False,
    view: Callable[[], View] = View,
) -> Diagram:
    """Make the diagram of a game that is tracked on pictures.

    Output ports, in the order in which data flows: `pursuer_position` (2 Np) [m],
    `evader_position` (2 Ne) [m], `visibility` (Np Ne), `evader_estimate` (2 Ne) [m], where the
    pursuers put the evaders, `evader_known` (Ne), 0 for one never seen, `valid` (Np Ne), 1 where a
    pursuer's picture gives an estimate, `frame` (3 Np) of the cameras, `assignment` (Np),
    `pursuer_velocity` (2 Np) and `evader_velocity` (2 Ne), as desired [m/s], `pursuer_direction`
    (2 Np), `evader_direction` (2 Ne), and `loss` (2) as in `MakeTracking`. On true positions there
    are no `valid` and `frame`.

    Args:
        game: What is played.
        meshcat: Where to draw it; None draws nothing.
        recording: Record what is drawn, for `write_replay`.
        view: Whose view to show at each picture.

    Raises:
        InvalidInput: `game` is no PictureGame.
    """
    require_type("game", game, PictureGame)
    builder = DiagramBuilder()
    outputs = AddPictureTracking(builder, game)
    if meshcat is not None:
        _add_scenes(builder, game, outputs, meshcat, recording, view)
    for name, output in outputs.items():
        if not name.startswith("image_") and name != "evader_set":
            builder.ExportOutput(output, name)
    diagram = builder.Build()
    diagram.set_name("picture_tracking")
    return diagram


def AddPictureTracking(builder: DiagramBuilder, game: PictureGame) -> dict[str, OutputPort]:
    """Wire a game into a diagram; return its outputs by name, `image_0`, ... among them.

    Raises:
        InvalidInput: `game` is no PictureGame, or a name in the diagram is taken.
    """
    require_type("game", game, PictureGame)
    scenario, world, vision = game.scenario, game.world, game.scenario.vision
    pursuers, period = scenario.pursuers, scenario.period
    sizes = {"pursuers": pursuers.size, "evaders": scenario.evaders.size}
    pursuing, evading = AddTeams(builder, game.tracking)
    truth = {"pursuer_position": pursuing.position, "evader_position": evading.position}

    def add(name, system, known):
        """Add a system, connect its inputs to what is known, and add its outputs to that."""
        add_named(builder, name, system)
        for k in range(system.num_input_ports()):
            port = system.get_input_port(k)
            builder.Connect(known[port.get_name()], port)
        for k in range(system.num_output_ports()):
            output = system.get_output_port(k)
            known[output.get_name()] = output
        return system

    blocking = scenario.blocking_radii
    add("line_of_sight", LineOfSight(world, **sizes, body_radii=blocking), truth)
    whom = pursuers.size * scenario.evaders.size
    blocks = Demultiplexer([whom, truth["sight"].size() - whom])
    add_named(builder, "sight_blocks", blocks)
    builder.Connect(truth["sight"], blocks.get_input_port())

    eyes: dict[str, OutputPort] = {}
    if vision.senses == "pictures":
        eyes = AddEyes(builder, game, evading.position)
    belief = {
        "pursuer_position": pursuing.position,
        "evader_position": eyes.get("evader_estimate", evading.position),
    }
    believed = LineOfSight(world, pursuers=pursuers.size, evaders=scenario.evaders.size)
    add("believed_sight", believed, belief)
    belief["assignment"] = _add_assignment(builder, game, belief)
    field = PursuitFieldController(
        world,
        **sizes,
        top_speed=pursuers.top_speed,
        speed_ratio=scenario.speed_ratio,
        field=pursuers.field,
        risk_vectors=pursuers.risk_vectors,
        period=period,
    )
    belief["field_velocity"] = add("pursuit_field", field, belief).GetOutputPort("velocity")
    modified = ModifiedField(
        **sizes,
        weight=vision.weight,
        top_speed=pursuers.top_speed,
        stand_off=vision.stand_off,
        fade=vision.fade,
    )
    velocity = add("modified_field", modified, belief).GetOutputPort("velocity")
    velocity = AddSmoothing(builder, velocity, pursuers.smoothing, period)
    builder.Connect(velocity, pursuing.velocity)
    known = {**truth, "assignment": belief["assignment"]}
    evasion = AddEvasion(builder, game.tracking, known, None)
    builder.Connect(evasion, evading.velocity)
    monitor = SightLossMonitor(world, **sizes, period=period, body_radii=blocking)
    return {
        "pursuer_position": pursuing.position,
        "evader_position": evading.position,
        "visibility": blocks.get_output_port(0),
        **eyes,
        "assignment": belief["assignment"],
        "pursuer_velocity": velocity,
        "evader_velocity": evasion,
        "pursuer_direction": pursuing.direction,
        "evader_direction": evading.direction,
        "loss": add("sight_loss", monitor, truth).GetOutputPort("loss"),
    }


def _add_assignment(
    builder: DiagramBuilder, game: PictureGame, belief: dict[str, OutputPort]
) -> OutputPort:
    """Add what says who trails whom: the scenario's own choice, or its rule."""
    scenario, pursuers = game.scenario, game.scenario.pursuers
    if scenario.vision.targets:
        trailed = np.array(scenario.vision.targets, dtype=float)
        # Drake's stubs put the dtype of an array where its shape belongs.
        targets = ConstantVectorSource(trailed)  # pyright: ignore[reportArgumentType]
        return add_named(builder, "assignment", targets).get_output_port()
    rule = Assignment(
        game.world,
        pursuers=pursuers.size,
        evaders=scenario.evaders.size,
        rule=pursuers.assignment,
        hold=pursuers.switch,
        period=scenario.period,
        risk_functions=pursuers.risk_functions,
        extra=pursuers.extra,
        seed=scenario.seed,
    )
    add_named(builder, "assignment", rule)
    for name in ("pursuer_position", "evader_position", "sight"):
        builder.Connect(belief[name], rule.GetInputPort(name))
    return rule.GetOutputPort("assignment")


def _add_scenes(
    builder: DiagramBuilder,
    game: PictureGame,
    outputs: dict[str, OutputPort],
    meshcat: Meshcat,
    recording: bool,
    view: Callable[[], View],
) -> None:
    """Draw the map as `sightfield track` does, and the pictures beside it."""
    scenario = game.scenario
    period = scenario.period * max(round(PICTURE_PERIOD / scenario.period), 1)
    index = build_edge_index(game.world)
    scene = TrackingScene(
        game.world,
        game.pursuer_regions,
        meshcat,
        pursuers=scenario.pursuers.size,
        evaders=scenario.evaders.size,
        robot_radius=scenario.pursuers.radius,
        publish_period=period,
        visibility_polygon=lambda point: visibility_polygon(index, np.asarray(point)),
        pursuit_field=modified_field_of(game),
        recording=recording,
        view=view,
    )
    scenes: list[TrackingScene | PictureScene] = [scene]
    add_named(builder, "scene", scene)
    if scenario.vision.senses == "pictures":
        # After the map's, whose recording it joins.
        pictures = PictureScene(
            game, meshcat, publish_period=period, shown_period=SHOWN_PERIOD, recording=recording
        )
        add_named(builder, "picture_scene", pictures)
        scenes.append(pictures)
    for each in scenes:
        for k in range(each.num_input_ports()):
            port = each.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
