"""What a laboratory is made of: a game, robots, and a device after the other."""

from dataclasses import dataclass, field
from typing import Annotated

from ...systems.numerics.checked import Checked, Count, Duration, NonNegative, Positive, one_of
from ...systems.numerics.errors import require, require_positive
from ...systems.numerics.station.channel import Channel
from ...systems.numerics.station.motion_checks import Chassis
from ...systems.numerics.station.ros_topics import pose_topic
from ...systems.numerics.station.supervision import STAND, SupervisionRules
from ..tracking.scenario import TrackingScenario

MOCAP_SOURCES = ("vicon", "optitrack", "optitrack_closed_source", "qualisys", "nokov", "vrpn")
MOCAP_SOURCES += ("mock", "lcm", "ros2", "log")
CAMERA_SOURCES = ("none", "capture", "folder")
MODES = ("simulate", "emulate", "hardware")


@dataclass(frozen=True, kw_only=True)
class Mocap(Checked):
    """The motion capture.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # A system of the `motioncapture` package, "lcm", "ros2", or "log" for a recorded run.
    source: Annotated[str, one_of(MOCAP_SOURCES)] = "vicon"
    # Machine that runs the tracking software.
    hostname: str = "192.168.1.10"
    # Names of the robots there, pursuers first; empty: pursuer0, ..., evader0, ...
    bodies: list[str] = field(default_factory=list)
    # Of "lcm": the network.
    url: str = "udpm://239.255.76.67:7667?ttl=0"
    # Of "lcm": the channel of sightfield.poses_t.
    channel: str = "SIGHTFIELD_POSES"
    # Of "ros2": PoseStamped, Odometry or tf.
    message: str = "PoseStamped"
    # Of "ros2": the topic, {body} for a robot's name; empty: {body}/pose, {body}/odom or tf.
    topic: str = ""
    # Of "ros2": the frame of the poses.
    frame: str = "world"
    # Of "ros2": number of the domain (ROS_DOMAIN_ID).
    domain: int = 0
    # Of "log": the file.
    log: str = ""
    # Age beyond which a pose is invalid, and its robot stops [s].
    stale_after: Positive = 0.06

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.source != "log" or bool(self.log), "log", "name a recorded run", "nothing")
        # It refuses what is wrong, whatever the source is.
        pose_topic(self.message, self.topic, self.domain)


@dataclass(frozen=True, kw_only=True)
class Radio(Checked):
    """The way to the robots: for most kinds a network, for XBee a radio.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Of the robots: one of those that `sightfield station kind-check --help` lists, or module:NAME.
    kind: str = "xbee"
    # Of "xbee": serial port of the station's module, in API mode.
    port: str = "/dev/ttyUSB0"
    # Its speed [baud].
    baud_rate: Annotated[int, require_positive] = 57600
    # Of kinds on a network: where each robot is, pursuers first.
    addresses: list[str] = field(default_factory=list)
    # What else a kind asks for, by name.
    options: dict[str, bool | int | float | str] = field(default_factory=dict)
    # Numbers of the robots, as set in their firmware, pursuers first; empty: 1, 2, ...
    robots: list[int] = field(default_factory=list)
    # How often each command goes out in a period: a lost frame then costs a part of it only.
    repeats: Annotated[int, require_positive] = 2
    # Simulated robots stop when they have not heard for this long [s].
    heartbeat: Positive = 0.17

    def __post_init__(self) -> None:
        super().__post_init__()
        require(bool(self.kind), "kind", "name a kind of robots", "nothing")
        require(self.repeats <= 100, "repeats", "be 100 at most", self.repeats)
        require(len(set(self.robots)) == len(self.robots), "robots", "differ", self.robots)


@dataclass(frozen=True, kw_only=True)
class OmniCameraDevice(Checked):
    """The omni-directional camera on a pursuer.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # "capture" for what OpenCV opens, "folder" for pictures, "none" for a laboratory without.
    source: Annotated[str, one_of(CAMERA_SOURCES)] = "none"
    # Number or path of the device, address of the stream, or the folder.
    place: str = "0"
    # Pictures a second of a folder, and of the simulated camera [1/s].
    rate: Positive = 10.0
    # Pursuer that carries it, from 0.
    carrier: Count = 0
    # Age beyond which a picture is invalid [s].
    stale_after: Positive = 0.5

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.rate <= 1000, "rate", "be 1000 at most", self.rate)


@dataclass(frozen=True, kw_only=True)
class Infrared(Checked):
    """The four infrared sensors of each robot.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Age beyond which ranges are invalid [s].
    stale_after: Positive = 1.0
    # A robot drives no further while something ahead is nearer to its rim [m]; 0: it does.
    reflex: NonNegative = 0.02


@dataclass(frozen=True, kw_only=True)
class Imperfections:
    """How bad the channels of the simulated laboratory are; see `Channel`."""

    # Poses; the quantum is of positions and headings alike.
    mocap: Channel = field(default_factory=Channel)
    # Commands on their way to each robot.
    radio: Channel = field(default_factory=lambda: Channel(period=0.05, seed=1))
    # Ranges on their way back.
    infrared: Channel = field(default_factory=lambda: Channel(period=0.1, seed=2))


@dataclass(frozen=True, kw_only=True)
class Emulation(Checked):
    """How bad the air of the emulated laboratory is.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Probability that a frame is lost, in [0, 1].
    frame_loss: float = 0.1
    # Of a frame [s].
    delay: NonNegative = 0.05
    # Of losses.
    seed: Count = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(0 <= self.frame_loss <= 1, "frame_loss", "lie in [0, 1]", self.frame_loss)


@dataclass(frozen=True, kw_only=True)
class Supervision(Checked):
    """What the supervisor lets pass, and what it does about the rest.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # Reasons that hold a robot until the operator says start, even when they are over; others clear
    # by themselves. foreign_stop, motor and odometry always stay.
    cleared_by_operator: list[str] = field(default_factory=lambda: ["reset", "low_battery"])
    # A robot is lost when its last report is older [s].
    silent_after: float = 1.0
    # When the operator's view is gone: stand or go_on.
    view: str = STAND
    # Way that no robot drives between two poses, beyond what its speed allows [m].
    jump: Positive = 0.06
    # Turn that none makes, beyond what its turn rate allows [rad].
    flip: Positive = 0.5
    # By how much a robot may be nearer to a wall, or to another, than its radius [m].
    slack: NonNegative = 0.08
    # Between a robot's wheels [m].
    track_width: Positive = 0.16
    # Of its encoders [1/m].
    counts_per_metre: Positive = 3998.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.slack <= 100, "slack", "be 100 at most", self.slack)
        # They refuse what is wrong with the rest.
        _ = self.rules

    @property
    def rules(self) -> SupervisionRules:
        """What to do about what is noticed."""
        return SupervisionRules(
            cleared_by_operator=tuple(self.cleared_by_operator),
            silent_after=self.silent_after,
            view=self.view,
        )

    @property
    def chassis(self) -> Chassis:
        """Wheels of the robots."""
        return Chassis(track_width=self.track_width, counts_per_metre=self.counts_per_metre)


@dataclass(frozen=True, kw_only=True)
class StationScenario(Checked):
    """A laboratory and the game that is played in it.

    Raises:
        InvalidInput: A value is out of its range.
    """

    # The game, as `sightfield track` plays it: its period is the station's.
    tracking: TrackingScenario
    # Horizon [s].
    seconds: Duration = 15.0
    # Time step of the simulated robots, a millisecond at least [s].
    time_step: Duration = 0.01
    mocap: Mocap = field(default_factory=Mocap)
    radio: Radio = field(default_factory=Radio)
    omni_camera: OmniCameraDevice = field(default_factory=OmniCameraDevice)
    infrared: Infrared = field(default_factory=Infrared)
    imperfections: Imperfections = field(default_factory=Imperfections)
    emulation: Emulation = field(default_factory=Emulation)
    supervision: Supervision = field(default_factory=Supervision)

    def __post_init__(self) -> None:
        super().__post_init__()
        require(self.time_step >= 1e-3, "time_step", "be 0.001 at least", self.time_step)
        wish = f"be at most the game's period, which is {self.period}"
        require(self.time_step <= self.period, "time_step", wish, self.time_step)
        require(
            "you" not in self.tracking.evaders.policy_of_each,
            "tracking.evaders.policies",
            "not be you: a recorded run could not be played again",
            self.tracking.evaders.policies,
        )
        count = self.size
        for name, given in (
            ("mocap.bodies", self.mocap.bodies),
            ("radio.robots", self.radio.robots),
            ("radio.addresses", self.radio.addresses),
        ):
            require(len(given) in (0, count), name, f"name {count} robots or none", given)
        require(
            self.omni_camera.carrier < self.tracking.pursuers.size,
            "omni_camera.carrier",
            f"be below {self.tracking.pursuers.size}",
            self.omni_camera.carrier,
        )

    @property
    def period(self) -> float:
        """Of everything that the station samples [s]."""
        return self.tracking.period

    @property
    def size(self) -> int:
        """Number of robots."""
        return self.tracking.pursuers.size + self.tracking.evaders.size

    @property
    def radii(self) -> list[float]:
        """Radii of the robots, which keep off one another by them [m]; 0 without bodies."""
        tracking = self.tracking
        return (tracking.pursuer_radii or [0.0] * tracking.pursuers.size) + (
            tracking.evader_radii or [0.0] * tracking.evaders.size
        )

    @property
    def bodies(self) -> list[str]:
        """Name of each robot in the motion capture."""
        return self.mocap.bodies or self.names

    @property
    def names(self) -> list[str]:
        """What each robot is called."""
        pursuers, evaders = self.tracking.pursuers.size, self.tracking.evaders.size
        return [f"pursuer{i}" for i in range(pursuers)] + [f"evader{j}" for j in range(evaders)]

    @property
    def robots(self) -> list[int]:
        """Number of each robot on the radio."""
        return self.radio.robots or list(range(1, self.size + 1))
