"""The search as a diagram: robots, cameras, albums, friends, pictures, the evader, the route."""

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, DiagramBuilder, OutputPort

from ...systems.drake_parts import add_named
from ...systems.numerics.errors import require_type
from ...systems.numerics.social.network.acceptance import MemoryNetwork
from ...systems.numerics.social.network.interface import SocialNetwork
from ...systems.numerics.social.routes.outlook import make_outlook
from ...systems.social.forward_cameras import PicturePoster
from ...systems.social.network_evolution import AgentInterest, ImageScanner, NetworkEvolution
from .robots import AddCameras, AddLocator, AddRobots
from .scenario import SocialScenario
from .social_game import SocialGame, set_up_social_game
from .social_scene import SocialScene

# About how long a picture of the scene lasts [s].
PICTURE_PERIOD = 1 / 20

# Cells in which the evader may be, and how far away it is recognised [m].
CELL, RECOGNITION_REACH = 0.12, 1.8

# What the search exports beside the robots' state, in the order in which data flows.
VECTORS = (
    "pose",
    "connected",
    "waiting",
    "requests_sent",
    "pictures_scanned",
    "locations",
    "evader_position",
    "evader_covariance",
    "located_at",
    "route",
)


def MakeSocialSearch(
    scenario: SocialScenario | SocialGame,
    meshcat: Meshcat | None = None,
    *,
    network: SocialNetwork | None = None,
    recording: bool = False,
) -> Diagram:
    """Make the diagram of a search through a social network.

    Output ports, in the order in which data flows: `pose` (3 N) of the pursuer, the evader and the
    common agents [m], [m], [rad]; `posted`, the agents' newest pictures; `connected` and `waiting`
    (n), who is a friend and who was asked; `requests_sent` and `pictures_scanned` (1); `readings`,
    what the pursuer recognised last; `locations` (1), how often the evader was located;
    `evader_position` (2) [m] and `evader_covariance` (4) now [m^2]; `located_at` (1), when the
    picture was taken that it was located in last, negative before the first [s]; `route` (2 K) [m].

    Args:
        scenario: What is searched, or a game already set up.
        meshcat: Where to draw it; None draws nothing.
        network: Where agents post; None for one in memory with the scenario's seed.
        recording: Record what is drawn, for `write_replay` on the subsystem "scene".

    Raises:
        InvalidInput: See `set_up_social_game`.
    """
    require_type("scenario", scenario, SocialScenario, SocialGame)
    game = set_up_social_game(scenario) if isinstance(scenario, SocialScenario) else scenario
    if network is None:
        network = MemoryNetwork(game.temperaments, game.scenario.seed)
    builder = DiagramBuilder()
    outputs = AddSocialSearch(builder, game, network)
    if meshcat is not None:
        period = game.scenario.period
        scene = SocialScene(
            game,
            meshcat,
            route_size=outputs["route"].size(),
            publish_period=period * max(round(PICTURE_PERIOD / period), 1),
            recording=recording,
        )
        add_named(builder, "scene", scene)
        for k in range(scene.num_input_ports()):
            port = scene.get_input_port(k)
            builder.Connect(outputs[port.get_name()], port)
    for name, output in outputs.items():
        builder.ExportOutput(output, name)
    diagram = builder.Build()
    diagram.set_name("social_search")
    return diagram


def AddSocialSearch(
    builder: DiagramBuilder, game: SocialGame, network: SocialNetwork
) -> dict[str, OutputPort]:
    """Wire a search into a diagram; return its outputs by name (see `MakeSocialSearch`).

    Raises:
        InvalidInput: `game` is no SocialGame, or a name in the diagram is taken.
    """
    require_type("game", game, SocialGame)
    scenario, connect = game.scenario, builder.Connect
    camera, search, step = scenario.camera, scenario.search, scenario.period
    robots = AddRobots(builder, game)
    posted = AddCameras(builder, game, robots)
    # Each waits a step for what it needs: pictures are taken, posted, fetched, and looked at.
    poster = PicturePoster(network, period=camera.period, offset=step)
    evolution = NetworkEvolution(network, game.limits, period=search.period)
    scanner = ImageScanner(network, count=search.pictures, period=search.period, offset=2 * step)
    for name, system in (
        ("picture_poster", poster),
        ("network_evolution", evolution),
        ("image_scanner", scanner),
    ):
        add_named(builder, name, system)
    connect(posted, poster.GetInputPort("pictures"))
    connect(evolution.GetOutputPort("connected"), scanner.GetInputPort("connected"))
    found = AddLocator(builder, game, scanner.GetOutputPort("pictures"), offset=3 * step)
    if search.order == "information":
        _add_interest(builder, game, evolution, found)
    connect(found["evader_position"], robots.evader_position)
    connect(found["located_at"], robots.located_at)
    return {
        "pose": robots.pose,
        "posted": posted,
        **{
            name: evolution.GetOutputPort(name)
            for name in ("connected", "waiting", "requests_sent")
        },
        "pictures_scanned": scanner.GetOutputPort("pictures_scanned"),
        **found,
        "route": robots.route,
    }


def _add_interest(
    builder: DiagramBuilder,
    game: SocialGame,
    evolution: NetworkEvolution,
    found: dict[str, OutputPort],
) -> None:
    """Let the pursuer ask those first whose pictures promise most."""
    scenario = game.scenario
    outlook = make_outlook(
        game.maze.world,
        cell=CELL,
        view_angle=game.maze.camera.field_of_view,
        reach=RECOGNITION_REACH,
    )
    interest = AgentInterest(
        outlook,
        agents=scenario.agents.size,
        patience=game.limits.patience,
        period=scenario.search.period,
        # A step after the pictures have been looked at.
        offset=4 * scenario.period,
    )
    add_named(builder, "agent_interest", interest)
    builder.Connect(evolution.GetOutputPort("tallies"), interest.GetInputPort("tallies"))
    for name in ("evader_position", "evader_covariance", "readings"):
        builder.Connect(found[name], interest.GetInputPort(name))
    builder.Connect(interest.GetOutputPort("interest"), evolution.GetInputPort("interest"))
