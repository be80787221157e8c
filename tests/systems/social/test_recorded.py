"""What the systems of the social story say over time, with changing inputs, is as recorded."""

import math

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.edge_index import build_edge_index
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.social.landmarks.forward_camera import ForwardCamera
from sightfield.systems.numerics.social.landmarks.maze import Landmark, Maze
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.localisation.location import (
    CameraPose,
    Location,
    Outcome,
    Reading,
    no_location,
)
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    OwnAcceptance,
    Temperaments,
)
from sightfield.systems.numerics.social.network.evolution import EvolutionLimits
from sightfield.systems.numerics.social.network.interface import Picture
from sightfield.systems.numerics.social.recognition.recognition import NOTHING
from sightfield.systems.numerics.social.routes.infrared import InfraredRing, infrared_ranges
from sightfield.systems.numerics.social.routes.motion import FollowingLaw, WanderingLaw
from sightfield.systems.numerics.social.routes.outlook import make_outlook
from sightfield.systems.numerics.social.routes.shortest_route import (
    build_route_graph,
    rounded_regions,
)
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.social import evader_locator, forward_cameras
from sightfield.systems.social.common_robots import CrowdGuard, InfraredSensors, Wanderers
from sightfield.systems.social.evader_locator import EvaderLocator
from sightfield.systems.social.forward_cameras import ForwardCameras, PicturePoster
from sightfield.systems.social.maze_renderer import MazeRenderer
from sightfield.systems.social.network_evolution import (
    AgentInterest,
    ImageScanner,
    NetworkEvolution,
)
from sightfield.systems.social.route_pursuer import RoutePursuer

RING, RADIUS, PERIOD = InfraredRing(), 0.1, 0.05
ROOM = make_world([[0, 0], [4, 0], [4, 3], [0, 3]], [[[1, 0.5], [3, 0.5], [3, 2.2], [1, 2.2]]])


class Play:
    """A system alone, whose inputs are told from tick to tick."""

    def __init__(self, system):
        self.system = system
        self.simulator = Simulator(system)
        self.context = self.simulator.get_mutable_context()

    def tell(self, **inputs):
        for name, value in inputs.items():
            port = self.system.GetInputPort(name)
            told = AbstractValue.Make(value) if isinstance(value, tuple) else np.ravel(value)
            port.FixValue(self.context, told)

    def at(self, time, *ports):
        self.simulator.AdvanceTo(time)
        return [np.array(self.system.GetOutputPort(each).Eval(self.context)) for each in ports]


def test_a_crowd_wanders_as_recorded(as_recorded):
    sensors = Play(InfraredSensors(ROOM, count=4, radius=RADIUS, ring=RING))
    wanderers = Play(Wanderers(4, law=WanderingLaw(), ring=RING, period=PERIOD, seed=3))
    guard = Play(CrowdGuard(count=4, ring=RING, margin=0.01, period=PERIOD, top_turn_rate=0.8))
    rng, rows = np.random.default_rng(2), []
    for tick in range(25):
        poses = rng.uniform([0.15, 0.15, -3], [0.8, 0.9, 3], (4, 3))
        sensors.tell(pose=poses)
        (felt,) = sensors.at(PERIOD * tick, "infrared")
        wanderers.tell(infrared=felt)
        (wanted,) = wanderers.at(PERIOD * tick + 0.001, "command")
        guard.tell(command=wanted * 1.3, infrared=felt)
        rows.append([wanted, *guard.at(PERIOD * tick, "safe_command")])
    as_recorded(np.array(rows))


def test_a_ring_need_only_just_cover_the_front_and_half_a_turn():
    coverage = RING.coverage - 0.5 * math.pi
    options = {"count": 1, "ring": RING, "margin": 0.0, "period": PERIOD}
    CrowdGuard(top_turn_rate=2 * coverage / PERIOD - 1e-9, **options)
    with pytest.raises(InvalidInput, match="`ring` must cover"):
        CrowdGuard(top_turn_rate=2 * coverage / PERIOD + 1e-9, **options)


def test_a_pursuer_decides_as_recorded(as_recorded):
    system = RoutePursuer(
        build_route_graph(rounded_regions(ROOM, 0.145)),
        ROOM,
        rounded_regions(ROOM, 0.13),
        law=FollowingLaw(stand_off=0.1),
        ring=RING,
        radius=RADIUS,
        period=PERIOD,
    )
    edges, play, rows = build_edge_index(ROOM).edges, Play(system), []
    for tick in range(150):
        # It stands before another for a while, then goes on; the evader is seen elsewhere twice.
        way = 0.012 * min(tick, 40) + 0.012 * max(tick - 110, 0)
        pose = np.array([0.4 + way, 0.28 + 0.02 * math.sin(tick), 0.05 * math.cos(tick)])
        other = np.array([1.13, 0.2, 0.0])
        felt = infrared_ranges(edges, np.array([pose, other]), RADIUS, RING)[0]
        seen = (-1.0, 0.0, 3.5)[(tick > 2) + (tick > 95)]
        play.tell(
            pose=pose,
            infrared=felt,
            evader_position=[3.6, 0.4] if tick < 96 else [3.4, 2.7],
            located_at=[seen],
        )
        command, route = play.at(PERIOD * tick + 0.001, "command", "route")
        rows.append([*command, *route[:6]])
    as_recorded(np.array(rows)[[0, 3, 40, 41, 82, 83, 95, 96, 149]].tolist(), "some")
    as_recorded(np.array(rows), "all")


def temperaments(*accepting):
    count = len(accepting)
    return Temperaments(
        acceptance=OwnAcceptance(accepting), unfriending=(0.1,) * count, rejection=(0.3,) * count
    )


def test_a_network_evolves_and_is_scanned_as_recorded(as_recorded):
    network = MemoryNetwork(temperaments(0.5, 0.3, 0.4, 0.2), 6)
    limits = EvolutionLimits(requests=2, patience=2, friends=3)
    evolution = Play(NetworkEvolution(network, limits, period=0.5))
    scanner = Play(ImageScanner(network, count=2, period=0.5, offset=0.2))
    names = ("connected", "waiting", "counters", "tallies", "requests_sent", "iteration")
    rows, pictures = [], []
    for tick in range(30):
        if tick == 10:
            evolution.tell(interest=[0.1, 0.4, 0.2, 0.3])
        told = evolution.at(0.5 * tick + 0.01, *names)
        for agent in range(4):
            name = f"{agent}-{tick}"
            network.post(agent, Picture(id=name, agent=agent, time=0.5 * tick, data=b""))
        scanner.tell(connected=told[0])
        (found,) = scanner.at(0.5 * tick + 0.21, "pictures_scanned")
        new = scanner.system.GetOutputPort("pictures").Eval(scanner.context)
        pictures.append([each.id for each in new])
        rows.append(np.concatenate([*told, found]))
    as_recorded(np.array(rows), "numbers")
    as_recorded(pictures, "pictures")


def reading(agent, time, outcome, place=(0.0, 0.0), spread=1.0, pose=None):
    picture = Picture(id=f"{agent} {time}", agent=agent, time=time, data=b"")
    camera = None if pose is None else CameraPose(np.array(pose), np.eye(3), 0.0, (1,))
    if not outcome.has_location:
        return Reading(picture, NOTHING, no_location(outcome, camera))
    covariance = spread * np.array([[0.02, 0.005], [0.005, 0.01]])
    location = Location(
        outcome=outcome, position=np.array(place), covariance=covariance, camera=camera
    )
    return Reading(picture, NOTHING, location)


def test_interest_in_agents_is_as_recorded(as_recorded):
    outlook = make_outlook(ROOM, cell=0.25, view_angle=1.2, reach=2.5)
    play = Play(
        AgentInterest(outlook, agents=3, patience=2, forgetting=4.0, period=0.5, offset=0.1)
    )
    rows = []
    for tick in range(8):
        new = ()
        if tick % 3 == 1:
            new = (
                reading(tick % 2, 0.5 * tick, Outcome.NO_EVADER, pose=[0.5, 1.0, 0.3 * tick]),
                reading(2, 0.1, Outcome.NO_EVADER, pose=[3.5, 1.0, 2.0]),
                reading(2, 0.4 * (tick == 7), Outcome.NO_LANDMARK),
            )
        play.tell(
            tallies=[[1 + tick, 2], [0, tick], [3, 0]],
            evader_position=[0.5, 1.5 + 0.1 * tick],
            evader_covariance=[0.1, 0.02, 0.02, 0.06] if tick else [math.inf, 0, 0, math.inf],
            readings=new,
        )
        rows.append(play.at(0.5 * tick + 0.11, "interest")[0])
    as_recorded(rows)


def test_an_evader_is_followed_from_picture_to_picture_as_recorded(as_recorded, monkeypatch):
    monkeypatch.setattr(evader_locator, "maze_references", lambda maze, features: None)
    monkeypatch.setattr(evader_locator, "read_picture", lambda each, *_: each)
    play = Play(EvaderLocator(thesis_maze(), speed=0.07, period=0.5, offset=0.2))
    good, none = Outcome.LOCATED, Outcome.TOO_UNSURE
    told = [
        (reading(0, 0.3, none),),
        (reading(0, 0.4, good, (1.1, 1.1)), reading(1, 0.4, good, (1.2, 1.0), 0.4)),
        (),
        (reading(1, 0.2, good, (0.3, 0.3)), reading(0, 1.1, none)),
        (reading(2, 1.6, Outcome.AT_A_WALL, (0.2, 2.0), 0.7),),
        (reading(0, 1.6, good, (-0.3, 2.0)), reading(1, 1.8, good, (0.4, 1.8))),
    ]
    names = ("evader_position", "evader_covariance", "located_at", "locations")
    rows = []
    for tick, pictures in enumerate(told):
        play.tell(pictures=pictures)
        rows.append([*play.at(0.5 * tick + 0.31, *names)])
        read = play.system.GetOutputPort("readings").Eval(play.context)
        assert [each.picture.id for each in read] == [each.picture.id for each in pictures]
    as_recorded(rows)


class Flat:
    """A renderer whose pictures say who looks, and where it stands."""

    def __init__(self, maze, common_agents):
        self.size = (maze.camera.height, maze.camera.width, 3)

    def render(self, viewer, agents, evader, pursuer):
        return np.full(self.size, 20 + 40 * viewer + round(30 * agents[viewer, 0]), np.uint8)


def test_pictures_are_taken_and_posted_as_recorded(as_recorded, monkeypatch):
    monkeypatch.setattr(forward_cameras, "MazeRenderer", Flat)
    maze = Maze(world=ROOM, landmarks=(), camera=ForwardCamera(width=32, height=24))
    sensor = Sensor(blur=0.0, noise=2.0, drop_share=0.3, seed=4)
    cameras = Play(ForwardCameras(maze, 3, sensor=sensor, period=0.5))
    posted = []

    class Kept(MemoryNetwork):
        """Keeps what is posted."""

        def post(self, agent, picture):
            posted.append((agent, picture.id))

    poster = Play(PicturePoster(Kept(temperaments(0.5, 0.5, 0.5), 0), period=0.5, offset=0.2))
    rows = []
    for tick in range(5):
        agents = np.array([[0.5 + 0.1 * tick, 1, 0], [0.4, 2, 0], [3.5 - 0.2 * tick, 1, 0]])
        cameras.tell(agent_pose=agents, evader_pose=[2, 0.2, 0], pursuer_pose=[0.3, 0.3, 0])
        cameras.simulator.AdvanceTo(0.5 * tick + 0.01)
        taken = cameras.system.GetOutputPort("pictures").Eval(cameras.context)
        rows.append([[each.id, each.agent, each.time, len(each.data) > 100] for each in taken])
        poster.tell(pictures=tuple(taken))
        poster.simulator.AdvanceTo(0.5 * tick + 0.21)
    as_recorded(rows, "taken")
    assert posted == [(row[1], row[0]) for tick in rows for row in tick]


def test_the_maze_is_drawn_as_recorded(as_recorded):
    landmarks = (
        Landmark(number=1, x=4.0, y=1.0, facing=math.pi),
        Landmark(number=3, x=1.0, y=1.4, facing=math.pi, side=0.4, middle_height=0.22),
    )
    camera = ForwardCamera(width=160, height=120)
    maze = Maze(world=ROOM, landmarks=landmarks, camera=camera)
    renderer = MazeRenderer(maze, common_agents=2)
    agents = np.array([[0.35, 1.3, 0.1], [0.7, 1.7, -1.2]])
    evader, pursuer = np.array([0.75, 1.15, 0.5]), np.array([0.6, 1.45, 0.0])
    for viewer in range(2):
        picture = renderer.render(viewer, agents, evader, pursuer).astype(float)
        blocks = picture.reshape(6, 20, 8, 20, 3).mean(axis=(1, 3))
        # Graphics libraries round otherwise, by a tone or two.
        as_recorded(blocks.reshape(6, 24).round(1).tolist(), f"by {viewer}", absolute=2.0)
    far = renderer.render(1, agents + np.array([2.9, 0.6, 0.9])).astype(float)
    blocks = far.reshape(6, 20, 8, 20, 3).mean(axis=(1, 3))
    as_recorded(blocks.reshape(6, 24).round(1).tolist(), "of the other room", absolute=2.0)


OUTLOOK = make_outlook(ROOM, cell=0.5, view_angle=1.2, reach=2.5)
OPTIONS = {"law": WanderingLaw(), "ring": RING, "period": PERIOD}
GUARD = {"count": 1, "ring": RING, "margin": 0.0, "period": PERIOD, "top_turn_rate": 1.0}
ALBUMS = MemoryNetwork(temperaments(0.5), 0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: InfraredSensors(ROOM, count=0, radius=0.1, ring=RING),
        lambda: InfraredSensors(ROOM, count=1, radius=0.0, ring=RING),
        lambda: Wanderers(0, **OPTIONS),
        lambda: Wanderers(1, **(OPTIONS | {"period": 0.0})),
        lambda: Wanderers(1, **OPTIONS, seed=-1),
        *(
            lambda change=change: CrowdGuard(**(GUARD | change))
            for change in (
                {"count": 0},
                {"margin": -0.1},
                {"period": 0.0},
                {"top_turn_rate": 0.0},
            )
        ),
        lambda: NetworkEvolution(ALBUMS, period=0.0),
        lambda: ImageScanner(ALBUMS, count=0),
        lambda: ImageScanner(ALBUMS, period=0.0),
        lambda: AgentInterest(OUTLOOK, agents=0, patience=1),
        lambda: AgentInterest(OUTLOOK, agents=1, patience=-1),
        lambda: AgentInterest(OUTLOOK, agents=1, patience=0, forgetting=0.0),
        lambda: AgentInterest(OUTLOOK, agents=1, patience=0, period=0.0),
        lambda: AgentInterest(OUTLOOK, agents=1, patience=0, offset=-0.1),
        lambda: PicturePoster(ALBUMS, period=0.0, offset=0.0),
        lambda: PicturePoster(ALBUMS, period=0.5, offset=-0.1),
        lambda: ForwardCameras(None, 1, period=0.0),
        lambda: EvaderLocator(None, speed=-0.1),
        lambda: EvaderLocator(None, speed=0.0, period=0.0),
        lambda: EvaderLocator(None, speed=0.0, offset=-0.1),
        lambda: EvaderLocator(None, speed=0.0, method="guess"),
        lambda: MazeRenderer(None, common_agents=0),
        *(
            lambda change=change: RoutePursuer(
                None, ROOM, [ROOM], law=FollowingLaw(), ring=RING, **change
            )
            for change in ({"radius": 0.0, "period": 0.1}, {"radius": 0.1, "period": 0.0})
        ),
    ],
)
def test_what_no_system_can_be_made_of_is_refused(make):
    with pytest.raises(InvalidInput, match="` must"):
        make()


def test_a_system_of_one_agent_is_made():
    assert Wanderers(1, **OPTIONS, seed=0).num_output_ports() == 1
    assert AgentInterest(OUTLOOK, agents=1, patience=0, offset=0.0).num_output_ports() == 1
    assert ImageScanner(ALBUMS, count=1).num_output_ports() == 2
    assert CrowdGuard(**GUARD).num_output_ports() == 1
