"""The laboratory's devices: opening them, and wiring them to the ports of a station.

With `diagrams/social/networks.py` the one place where diagrams know `hardware_io`; all others take
what they need of it from here.
"""

from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from ...hardware_io.cameras import (
    CameraPort,
    FrameSource,
    NoCamera,
    OpenCvCapture,
    PictureFolder,
    without_password,
)
from ...hardware_io.device_process.process_link import ProcessLink
from ...hardware_io.emulation.air import AirSettings, Flight
from ...hardware_io.kinds.known_kinds import KINDS, find_kind
from ...hardware_io.kinds.robot_kind import (
    LATE,
    REORDERED,
    REPEATED,
    Laboratory,
    RobotFleet,
    RobotKind,
    Surroundings,
)
from ...hardware_io.links.radio_commander import RadioCommander
from ...hardware_io.links.robot_link import OLDEST_POSES, RobotLink, brisk_threads
from ...hardware_io.mocap.lcm_poses import LcmPoses
from ...hardware_io.mocap.motion_capture import MotionCapture
from ...hardware_io.mocap.pose_receiver import PoseReading, PoseReceiver, PoseSource
from ...hardware_io.mocap.stand_in_poses import (
    EmulatedPoses,
    FaultyPoses,
    PoseFault,
    RecordedPoses,
    displaced,
    frozen,
    stuck,
    swapped,
)
from ...hardware_io.recording.log_records import RunWriter
from ...hardware_io.recording.mcap_log import McapRunWriter
from ...hardware_io.recording.run_log import PortRecorder, RunLog, port_name, read_run_log
from ...hardware_io.viewer.messages import Scene
from ...hardware_io.viewer.operator import Operator, OperatorPort, StopPage, keys
from ...hardware_io.viewer.view_address import find_view, open_view
from ...hardware_io.viewer.viewer_link import Shows, StatePublisher, ViewerLink
from ...systems.numerics.errors import require_extra
from ...systems.station.gates import AgeLimit
from ..tracking.game import TrackingGame
from .ports import IMAGE, split_teams
from .scenario import Mocap, OmniCameraDevice, StationScenario

__all__ = [
    "KINDS",
    "LATE",
    "OLDEST_POSES",
    "REORDERED",
    "REPEATED",
    "AddDevices",
    "AirSettings",
    "Devices",
    "FaultyPoses",
    "Flight",
    "Laboratory",
    "McapRunWriter",
    "Operator",
    "OperatorPort",
    "PortRecorder",
    "PoseFault",
    "PoseReading",
    "RobotFleet",
    "RobotKind",
    "RobotLink",
    "RunLog",
    "RunWriter",
    "Scene",
    "Shows",
    "StatePublisher",
    "StopPage",
    "Surroundings",
    "ViewerLink",
    "build_emulator",
    "displaced",
    "find_kind",
    "find_view",
    "frozen",
    "keys",
    "open_camera",
    "open_devices",
    "open_poses",
    "open_radio",
    "open_view",
    "port_name",
    "read_run_log",
    "serial_ports",
    "stuck",
    "swapped",
    "without_password",
]

# Commands go out, and samples are written, this long after the tick at which poses are sampled:
# an event at the tick itself would still see the poses of the tick before [s].
AFTER_TICK = 1e-4


@dataclass(frozen=True, eq=False)
class Devices:
    """Devices that are open.

    Attributes:
        poses: The motion capture.
        radio: The link to the robots.
        camera: The omni-directional camera.
        laboratory: The emulated one behind them, or None.
    """

    poses: PoseSource
    radio: RobotLink
    camera: FrameSource
    laboratory: Laboratory | None = None


def open_poses(mocap: Mocap, bodies: list[str]) -> PoseSource:
    """Open the motion capture.

    Args:
        mocap: What it is.
        bodies: Names of the robots there.

    Raises:
        InvalidInput: It does not answer.
    """
    if mocap.source == "lcm":
        return LcmPoses(mocap.url, mocap.channel, bodies)
    if mocap.source == "ros2":
        return _ros_poses(mocap, bodies)
    if mocap.source == "log":
        return RecordedPoses(read_run_log(Path(mocap.log)))
    return MotionCapture(mocap.source, mocap.hostname, bodies)


def _ros_poses(mocap: Mocap, bodies: list[str]) -> PoseSource:
    require_extra(f"`mocap.source` {mocap.source}", "dds", ["cyclonedds"])
    from ...hardware_io.mocap.ros_poses import RosPoses

    return RosPoses(
        bodies, message=mocap.message, topic=mocap.topic, frame=mocap.frame, domain=mocap.domain
    )


def open_camera(device: OmniCameraDevice) -> FrameSource:
    """Open the camera.

    Raises:
        InvalidInput: It cannot be opened.
    """
    if device.source == "none":
        return NoCamera()
    if device.source == "folder":
        return PictureFolder(Path(device.place), rate=device.rate)
    return OpenCvCapture(device.place)


def open_radio(scenario: StationScenario) -> RobotLink:
    """Make the link to the robots, a context manager that connects, in a process of its own.

    Args:
        scenario: The laboratory.

    Raises:
        InvalidInput: There is no such kind, its extra is not installed, or it needs to be told
            more.
    """
    return ProcessLink(scenario.radio.kind, _fleet(scenario))


def _fleet(scenario: StationScenario) -> RobotFleet:
    radio = scenario.radio
    return RobotFleet(
        robots=tuple(scenario.robots),
        port=radio.port,
        baud_rate=radio.baud_rate,
        addresses=tuple(radio.addresses),
        options=radio.options,
        chassis=scenario.supervision.chassis,
    )


def serial_ports() -> list[str]:
    """Serial ports of this machine, with something plugged in; none without pyserial."""
    try:
        from serial.tools import list_ports
    except ModuleNotFoundError:
        return []
    return sorted(port.device for port in list_ports.comports())


def build_emulator() -> str:
    """Build the robots' firmware and what runs it in simavr; say where they are.

    Raises:
        SightfieldError: A tool is missing, or refuses.
    """
    from ...hardware_io.emulation.robot_cores import firmware_path, runner_path

    return f"the firmware is built, {firmware_path()}, and what runs it, {runner_path()}"


@contextmanager
def open_devices(
    scenario: StationScenario, game: TrackingGame, *, emulate: bool = False
) -> Iterator[Devices]:
    """Open every device that the scenario names, or those of an emulated laboratory.

    The radio comes first: it is what is closed last, and on closing stops every robot.

    Args:
        scenario: The laboratory.
        game: What is played.
        emulate: Open an emulated laboratory instead.

    Raises:
        SightfieldError: A device is missing or does not answer.
    """
    with ExitStack() as stack:
        # The diagram is busy; a report or a stop is not to wait for it.
        stack.enter_context(brisk_threads())
        laboratory = None
        if emulate:
            laboratory, link = stack.enter_context(_emulated(scenario, game))
        else:
            link = stack.enter_context(open_radio(scenario))
        source = (
            EmulatedPoses(laboratory)
            if laboratory is not None
            else open_poses(scenario.mocap, scenario.bodies)
        )
        poses = stack.enter_context(closing(source))
        camera = stack.enter_context(closing(open_camera(scenario.omni_camera)))
        yield Devices(poses=poses, radio=link, camera=camera, laboratory=laboratory)


@contextmanager
def _emulated(
    scenario: StationScenario, game: TrackingGame
) -> Iterator[tuple[Laboratory, RobotLink]]:
    """Robots that stand in for those of the scenario's kind, and the link to them."""
    kind, settings = find_kind(scenario.radio.kind), scenario.emulation
    around = Surroundings(
        starts=np.concatenate([game.pursuer_starts, game.evader_starts]),
        air=AirSettings(frame_loss=settings.frame_loss, delay=settings.delay),
        seed=settings.seed,
        world=game.world,
        silence=kind.stops_after,
    )
    with (
        kind.open_stand_in(_fleet(scenario), around) as (laboratory, fleet),
        ProcessLink(scenario.radio.kind, fleet) as link,
    ):
        yield laboratory, link


def AddDevices(
    builder: DiagramBuilder,
    scenario: StationScenario,
    game: TrackingGame,
    sent_command: OutputPort,
    devices: Devices,
) -> dict[str, OutputPort]:
    """Add what reads and drives open devices; return the ports of the devices."""
    add, connect, period, count = (
        builder.AddNamedSystem,
        builder.Connect,
        scenario.period,
        scenario.size,
    )
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    mocap = PoseReceiver(
        devices.poses, starts, period=period, stale_after=scenario.mocap.stale_after
    )
    add("mocap", mocap)
    ports: dict[str, OutputPort] = {}
    for name, width in (("poses", 3), ("valid", 1), ("age", 1), ("stamp", 1)):
        ports |= split_teams(builder, scenario, name, mocap.GetOutputPort(name), width)
    radio = add(
        "radio",
        RadioCommander(
            devices.radio, period=period, repeats=scenario.radio.repeats, offset=AFTER_TICK
        ),
    )
    connect(sent_command, radio.GetInputPort("velocity_commands"))
    # Looked at for every frame: a robot that is lost between two ticks stops before the next.
    watch = PoseReceiver(
        devices.poses,
        starts,
        period=period / scenario.radio.repeats,
        stale_after=scenario.mocap.stale_after,
    )
    add("watch", watch)
    connect(watch.GetOutputPort("valid"), radio.GetInputPort("valid"))
    connect(watch.GetOutputPort("age"), radio.GetInputPort("pose_age"))
    ports["infrared.ranges"] = radio.GetOutputPort("infrared_ranges")
    ports["infrared.age"] = radio.GetOutputPort("age")
    limit = add("infrared_limit", AgeLimit(count, limit=scenario.infrared.stale_after))
    connect(radio.GetOutputPort("age"), limit.get_input_port())
    ports["infrared.valid"] = limit.get_output_port()
    ports["radio.quality"] = radio.GetOutputPort("link_quality")
    ports["radio.battery"] = radio.GetOutputPort("battery")
    ports["radio.state"] = radio.GetOutputPort("robot_state")
    ports["radio.flags"] = radio.GetOutputPort("robot_flags")
    ports["radio.counts"] = radio.GetOutputPort("counts")
    camera = CameraPort(devices.camera, period=period, stale_after=scenario.omni_camera.stale_after)
    add("omni_camera", camera)
    ports[IMAGE] = camera.GetOutputPort("image")
    ports |= {
        f"omni_camera.{name}": camera.GetOutputPort(name) for name in ("valid", "age", "stamp")
    }
    return ports
