"""The common agents' cameras, and what the pursuer makes of their pictures."""

from pydrake.systems.framework import DiagramBuilder, OutputPort

from ...systems.numerics.vision.sensor import Sensor
from ...systems.social.evader_locator import EvaderLocator
from ...systems.social.forward_cameras import ForwardCameras
from .robots import RobotPorts
from .social_game import SocialGame

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
    builder.AddNamedSystem("cameras", cameras)
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
    builder.AddNamedSystem("evader_locator", locator)
    builder.Connect(pictures, locator.GetInputPort("pictures"))
    return {name: locator.GetOutputPort(name) for name in FOUND}
