"""One small example of every LeafSystem of the package, for tests that hold for all of them."""

from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.geometry import Meshcat, MeshcatParams
from pydrake.systems.framework import LeafSystem

from sightfield.diagrams.harvest.harvest_scene import HarvestScene
from sightfield.diagrams.harvest.scenario import Carts, Combines, FieldSource, HarvestScenario
from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.diagrams.social import scenarios as searches
from sightfield.diagrams.social.scenario import SocialScenario
from sightfield.diagrams.social.social_game import set_up_social_game
from sightfield.diagrams.social.social_scene import SocialScene
from sightfield.diagrams.tracking.controls import MeshcatVelocity
from sightfield.diagrams.tracking.scene import TrackingScene
from sightfield.diagrams.vision import scenarios
from sightfield.diagrams.vision.picture_scene import PictureScene
from sightfield.diagrams.vision.scenario import PictureTrackingScenario, set_up_picture_game
from sightfield.hardware_io.cameras import CameraPort, NoCamera
from sightfield.hardware_io.links.radio_commander import RadioCommander
from sightfield.hardware_io.mocap.pose_receiver import NewestPoses, PoseReceiver
from sightfield.hardware_io.recording.run_log import PortRecorder
from sightfield.hardware_io.viewer.operator import Operator, OperatorPort
from sightfield.hardware_io.viewer.viewer_link import StatePublisher
from sightfield.systems.harvest.machine_drivers import MachineDrivers
from sightfield.systems.harvest.teams import AugerTransfer, CombineTeam, GrainCartTeam
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.carts.cart_motion import standing_motion
from sightfield.systems.numerics.harvest.carts.cart_plan import CartPlan, Supply
from sightfield.systems.numerics.harvest.execution.planned_work import PlannedWork
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.paths import MachinePath, fastest_profile
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.social.landmarks.thesis_maze import thesis_maze
from sightfield.systems.numerics.social.network.acceptance import MemoryNetwork, thesis_temperaments
from sightfield.systems.numerics.social.routes.infrared import InfraredRing
from sightfield.systems.numerics.social.routes.motion import FollowingLaw, WanderingLaw
from sightfield.systems.numerics.social.routes.outlook import make_outlook
from sightfield.systems.numerics.social.routes.shortest_route import build_route_graph
from sightfield.systems.numerics.standoff.loop import THESIS_ERROR, StandoffLoop
from sightfield.systems.numerics.standoff.sampled_loop import SampledPid
from sightfield.systems.numerics.station.channel import Channel
from sightfield.systems.numerics.station.motion_checks import Chassis
from sightfield.systems.numerics.station.pose_checks import PoseLimits
from sightfield.systems.numerics.station.supervision import SupervisionRules
from sightfield.systems.numerics.tracking.visibility_game.bounds import certified_grid
from sightfield.systems.numerics.tracking.visibility_game.guaranteed_times import (
    solve_visibility_game,
)
from sightfield.systems.numerics.tracking.visibility_game.two_evaders import solve_two_evaders
from sightfield.systems.numerics.vision.estimation.calibration import (
    Calibration,
    Readings,
    calibrate,
)
from sightfield.systems.numerics.vision.omni_optics import OmniCamera, project_omni
from sightfield.systems.numerics.vision.sensor import Sensor
from sightfield.systems.numerics.vision.surroundings import Surroundings, shell_of
from sightfield.systems.planning import PathFollower, TractorTrailer, ValueFunctionFeedback
from sightfield.systems.social.common_robots import CrowdGuard, InfraredSensors, Wanderers
from sightfield.systems.social.evader_locator import EvaderLocator
from sightfield.systems.social.forward_cameras import ForwardCameras, PicturePoster
from sightfield.systems.social.network_evolution import (
    AgentInterest,
    ImageScanner,
    NetworkEvolution,
)
from sightfield.systems.social.route_pursuer import RoutePursuer
from sightfield.systems.standoff import BiasedRangeEstimator, StandoffClosedLoop, StandoffPid
from sightfield.systems.station.gates import AgeLimit, CommandGate, InfraredReflex, PoseParts
from sightfield.systems.station.stand_in_devices import (
    CommandTimeout,
    ImperfectChannel,
    PicturePlayer,
    SampledReceiver,
    SamplePlayer,
    WheelEncoders,
)
from sightfield.systems.station.supervision import (
    FloorGuard,
    MotionCheck,
    PoseGate,
    RobotSupervisor,
)
from sightfield.systems.tracking.agent_team import AgentTeam, DifferentialDriveTeam
from sightfield.systems.tracking.assignment import Assignment, GuaranteeAssignment
from sightfield.systems.tracking.best_response_evaders import BestResponseEvaders
from sightfield.systems.tracking.certified_pursuit import CertifiedPursuit
from sightfield.systems.tracking.collision_avoidance import CollisionAvoidance, CollisionStop
from sightfield.systems.tracking.evaders import (
    AdversarialEvaders,
    OptimalEvaders,
    RandomWalkEvaders,
    VelocitySelector,
    WaypointEvaders,
)
from sightfield.systems.tracking.guarantee_pursuit import GuaranteePursuit, TeamGuaranteePursuit
from sightfield.systems.tracking.guaranteed_time import GuaranteedTime, StandingCertificate
from sightfield.systems.tracking.heading_controller import HeadingController, TurnFirstController
from sightfield.systems.tracking.line_of_sight import LineOfSight, SightLossMonitor
from sightfield.systems.tracking.pursuit_laws import (
    LookaheadPursuit,
    ModifiedField,
    PursuitFieldController,
)
from sightfield.systems.vision.evader_tracker import EvaderTracker
from sightfield.systems.vision.omni_camera import OmniCameraSensor
from sightfield.systems.vision.shell_estimator import ShellEstimator


def harvest_work() -> PlannedWork:
    """Two combines drive side by side, and three carts stand at the edge."""
    cart, combine, one = Cart(), Combine(), np.ones(1, dtype=int)
    trucks = np.array([[x, -6.0, 0.0] for x in (20.0, 50.0, 80.0)])
    lines = [np.array([[5.0, y, 0.0], [95.0, y, 0.0]]) for y in (20.0, 40.0)]
    paths = [MachinePath(line, one, one > 0, one - 1) for line in lines]
    return PlannedWork(
        field=Field.rectangle(100.0, 60.0),
        combines=[combine] * 2,
        cart=cart,
        supply=Supply(density=0.8, trucks=trucks),
        plans=[fastest_profile(path, combine.speed, combine.acceleration) for path in paths],
        motions=[standing_motion(cart, truck, 0.0) for truck in trucks],
    )


def harvest_job() -> SimpleNamespace:
    """The same as a job, as far as a scene asks."""
    work = harvest_work()
    return SimpleNamespace(
        scenario=HarvestScenario(
            field=FieldSource(width=100.0, height=60.0),
            combines=Combines(count=2),
            carts=Carts(count=3),
        ),
        field=work.field,
        crop=0.8,
        plan=SimpleNamespace(service=CartPlan(work.plans, work.motions, [], [], [], 0.0)),
        trucks=work.supply.trucks,
        reach=7.25,
    )


@pytest.fixture(scope="session")
def ideal_calibration() -> Calibration:
    """Of the default camera and shell, on readings without noise."""
    camera, shell = OmniCamera(), shell_of("red")
    distance, bearing = np.linspace(0.3, 1.6, 8), np.linspace(-3, 3, 8)
    at = np.column_stack([np.cos(bearing), np.sin(bearing)]) * distance[:, None]
    pixels, _ = project_omni(camera, np.column_stack([at, np.full(8, shell.base)]))
    return calibrate(
        Readings(distance=distance, bearing=bearing, pixels=pixels),
        camera=camera,
        base=shell.base,
        shell_radius=shell.radius,
        shell_top=shell.top,
    )


@pytest.fixture(scope="session")
def system_examples(ideal_calibration) -> dict[str, Callable[[], LeafSystem]]:
    """How to make a small one of each LeafSystem, by class name (templates without `_`).

    Choose sizes that differ from each other (2 pursuers, 3 evaders), so that a test which mixes
    them up fails.
    """
    boundary = [[0, 0], [5, 0], [5, 4], [0, 4]]
    world = make_world(boundary, [[[1, 1], [2, 1], [2, 2], [1, 2]], [[3, 1], [4, 1], [3.5, 2]]])
    teams = {"pursuers": 2, "evaders": 3}
    speeds = {"top_speed": 0.3, "speed_ratio": 0.3}
    limits = {"top_speed": 0.3, "top_turn_rate": 2.0}
    ring = InfraredRing()

    def page() -> Meshcat:
        return Meshcat(MeshcatParams(port=0))

    def pictures() -> PictureScene:
        scenario = load_scenario(PictureTrackingScenario, find_scenario("omni_2v2", scenarios))
        game = set_up_picture_game(scenario)
        periods = {"publish_period": 0.05, "shown_period": 0.25}
        return PictureScene(game, page(), **periods, recording=False)

    def search_scene() -> SocialScene:
        game = set_up_social_game(
            load_scenario(SocialScenario, find_scenario("thesis_maze", searches))
        )
        periods = {"publish_period": 0.05, "recording": False}
        return SocialScene(game, page(), route_size=8, **periods)

    crew = {"combines": 2, "carts": 3}
    places = np.zeros((3, 4))

    return {
        "AugerTransfer": lambda: AugerTransfer(**crew, cart=Cart(), reach=8.0),
        "CameraPort": lambda: CameraPort(NoCamera(), period=0.1, stale_after=0.5),
        "BestResponseEvaders": lambda: BestResponseEvaders(
            world, [world], [world], **teams, pursuer_speed=0.3, evader_speed=0.1
        ),
        "GuaranteeAssignment": lambda: GuaranteeAssignment(
            solve_visibility_game(world, pursuer_speed=0.3, evader_speed=0.1, grid=0.4),
            world,
            **teams,
            hold="certificate",
            period=0.1,
        ),
        "GuaranteePursuit": lambda: GuaranteePursuit(
            solve_visibility_game(world, pursuer_speed=0.3, evader_speed=0.1, grid=0.4),
            world,
            **teams,
        ),
        "CertifiedPursuit": lambda: CertifiedPursuit(
            solve_visibility_game(
                world,
                pursuer_speed=0.3,
                evader_speed=0.1,
                grid=certified_grid(0.8, 0.3, 0.1),
                bound="lower",
            ),
            world,
            **teams,
            period=0.1,
        ),
        "StandingCertificate": lambda: StandingCertificate(**teams, top_speed=0.3),
        "TeamGuaranteePursuit": lambda: TeamGuaranteePursuit(
            solve_visibility_game(world, pursuer_speed=0.3, evader_speed=0.1, grid=0.4),
            solve_two_evaders(world, pursuer_speed=0.3, evader_speed=0.1, grid=0.6),
            world,
            **teams,
            period=0.1,
        ),
        "GuaranteedTime": lambda: GuaranteedTime(
            solve_visibility_game(world, pursuer_speed=0.3, evader_speed=0.1, grid=0.4),
            **teams,
            period=0.1,
        ),
        "OptimalEvaders": lambda: OptimalEvaders(
            solve_visibility_game(world, pursuer_speed=0.3, evader_speed=0.1, grid=0.4),
            world,
            [world],
            **teams,
        ),
        "LookaheadPursuit": lambda: LookaheadPursuit(world, [world], **teams, **speeds),
        "CollisionAvoidance": lambda: CollisionAvoidance(
            [world], count=2, period=0.1, top_speed=0.3, rank=1, radii=0.1, other_radii=[0.1] * 3
        ),
        "CollisionStop": lambda: CollisionStop(
            [world], count=2, period=0.1, rank=1, radii=[0.1, 0.2], other_radii=[0.1] * 3, **limits
        ),
        "CommandGate": lambda: CommandGate(3),
        "CommandTimeout": lambda: CommandTimeout(3, limit=0.2),
        "InfraredReflex": lambda: InfraredReflex(2, distance=0.05, period=0.05),
        "FloorGuard": lambda: FloorGuard(world, [0.1, 0.2], slack=0.05),
        "MotionCheck": lambda: MotionCheck(Chassis(), 3, period=0.05),
        "PoseGate": lambda: PoseGate(
            PoseLimits(top_speed=0.3, top_turn_rate=3.0, bounds=(0, 0, 4, 4)),
            np.zeros((3, 3)),
            period=0.05,
        ),
        "RobotSupervisor": lambda: RobotSupervisor(SupervisionRules(), 3, period=0.05),
        "WheelEncoders": lambda: WheelEncoders(Chassis(), np.zeros((3, 3)), period=0.01),
        "CombineTeam": lambda: CombineTeam(harvest_work(), period=0.25),
        "GrainCartTeam": lambda: GrainCartTeam(Cart(), places, truck_rate=300.0, period=0.25),
        "HarvestScene": lambda: HarvestScene(
            harvest_job(), page(), publish_period=0.5, recording=False
        ),
        "AdversarialEvaders": lambda: AdversarialEvaders(world, **teams, **speeds),
        "AgentInterest": lambda: AgentInterest(
            make_outlook(world, cell=0.5, view_angle=1.0, reach=2.0), agents=3, patience=2
        ),
        "AgeLimit": lambda: AgeLimit(3, limit=0.1),
        "AgentTeam": lambda: AgentTeam([[0, 0], [1, 1]], top_speed=0.3),
        "Assignment": lambda: Assignment(world, **teams),
        "BiasedRangeEstimator": lambda: BiasedRangeEstimator(THESIS_ERROR),
        "CrowdGuard": lambda: CrowdGuard(
            count=3, ring=ring, margin=0.01, period=0.1, top_turn_rate=2.0
        ),
        "DifferentialDriveTeam": lambda: DifferentialDriveTeam(np.zeros((2, 3)), **limits),
        "EvaderLocator": lambda: EvaderLocator(thesis_maze(), speed=0.1, features="orb"),
        "EvaderTracker": lambda: EvaderTracker(
            world,
            [world],
            cameras=2,
            colours=["red", "green", "red"],
            speed=0.1,
            period=0.1,
            cells=100,
        ),
        "ForwardCameras": lambda: ForwardCameras(thesis_maze(), 2),
        "HeadingController": lambda: HeadingController(2),
        "TurnFirstController": lambda: TurnFirstController(2, top_speed=0.3, period=0.1),
        "ImageScanner": lambda: ImageScanner(MemoryNetwork(thesis_temperaments(), 0)),
        "ImperfectChannel": lambda: ImperfectChannel(Channel(), np.zeros((3, 2))),
        "InfraredSensors": lambda: InfraredSensors(world, count=3, radius=0.1, ring=ring),
        "LineOfSight": lambda: LineOfSight(world, **teams),
        "MachineDrivers": lambda: MachineDrivers(harvest_work(), period=0.25),
        "MeshcatVelocity": lambda: MeshcatVelocity(page(), 0.3),
        "ModifiedField": lambda: ModifiedField(**teams, weight=0.5, top_speed=0.3),
        "NetworkEvolution": lambda: NetworkEvolution(MemoryNetwork(thesis_temperaments(), 0)),
        "OmniCameraSensor": lambda: OmniCameraSensor(
            OmniCamera(width=64, height=48, focal_length=86.0),
            Sensor(),
            Surroundings(world=world),
            [shell_of("red"), shell_of("green")],
        ),
        "OperatorPort": lambda: OperatorPort(Operator(), period=0.1),
        "PathFollower": lambda: PathFollower(
            Trailer(), driven_path(Trailer(), (0, 0, 0, 0), [(1, 0, 1)])
        ),
        "PicturePlayer": lambda: PicturePlayer([], lambda number: np.zeros((1, 1, 4)), period=0.1),
        "PicturePoster": lambda: PicturePoster(
            MemoryNetwork(thesis_temperaments(), 0), period=1.0, offset=0.1
        ),
        "PortRecorder": lambda: PortRecorder(
            SimpleNamespace(ports={"pursuer.poses": 6}, pictures=("omni_camera.image",)),
            period=0.1,
        ),
        "PoseParts": lambda: PoseParts(3),
        "PoseReceiver": lambda: PoseReceiver(
            NewestPoses(["a", "b", "c"]), np.zeros((3, 3)), period=0.1, stale_after=0.2
        ),
        "PictureScene": pictures,
        "PursuitFieldController": lambda: PursuitFieldController(world, **teams, **speeds),
        "RadioCommander": lambda: RadioCommander(SimpleNamespace(robots=(1, 2))),
        "RandomWalkEvaders": lambda: RandomWalkEvaders(3, top_speed=0.3),
        "RoutePursuer": lambda: RoutePursuer(
            build_route_graph([world]),
            world,
            [world],
            law=FollowingLaw(),
            ring=ring,
            radius=0.1,
            period=0.1,
        ),
        "SamplePlayer": lambda: SamplePlayer(np.zeros((4, 3)), np.zeros(3), period=0.1),
        "SampledReceiver": lambda: SampledReceiver(np.zeros((3, 2)), period=0.1, stale_after=0.2),
        "ShellEstimator": lambda: ShellEstimator(ideal_calibration, ["red", "green"]),
        "SightLossMonitor": lambda: SightLossMonitor(world, **teams, period=0.1),
        "SocialScene": search_scene,
        "StandoffClosedLoop": lambda: StandoffClosedLoop(StandoffLoop(), 0.1),
        "StatePublisher": lambda: StatePublisher(
            SimpleNamespace(show=lambda state: None), pursuers=2, evaders=3
        ),
        "StandoffPid": lambda: StandoffPid(StandoffLoop(), SampledPid()),
        "TractorTrailer": lambda: TractorTrailer(Trailer()),
        "TrackingScene": lambda: TrackingScene(
            world,
            [world],
            page(),
            **teams,
            robot_radius=0.1,
            publish_period=0.1,
            visibility_polygon=lambda point: world.boundary,
            pursuit_field=lambda pursuer, points, evaders, assignment: np.zeros_like(points),
            recording=False,
        ),
        "ValueFunctionFeedback": lambda: ValueFunctionFeedback(
            solve_value_function(
                Trailer(), Goal(state=(0, 0, 0, 0)), StateGrid.of_step(0.8), polish=0
            )
        ),
        "VelocitySelector": lambda: VelocitySelector([0, 1, 1], sources=2),
        "Wanderers": lambda: Wanderers(3, law=WanderingLaw(), ring=ring, period=0.1),
        "WaypointEvaders": lambda: WaypointEvaders([[[1, 1]], []], top_speed=0.3, period=0.1),
    }
