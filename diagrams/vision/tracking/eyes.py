"""The pursuers' cameras and estimators, and what they know together."""

from dataclasses import replace

from pydrake.systems.framework import DiagramBuilder, OutputPort
from pydrake.systems.primitives import Demultiplexer, Multiplexer

from ....systems.vision.evader_tracker import EvaderTracker
from ....systems.vision.omni_camera import OmniCameraSensor
from ....systems.vision.shell_estimator import ShellEstimator
from .picture_game import PictureGame


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
    add, connect = builder.AddNamedSystem, builder.Connect
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
