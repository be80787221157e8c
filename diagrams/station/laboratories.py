"""What takes the place of devices: a simulated laboratory, and a recorded run."""

from collections.abc import Callable, Mapping

import cv2
import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort

from ...systems.numerics.errors import require
from ...systems.numerics.social.routes.infrared import InfraredRing
from ...systems.numerics.station.channel import Channel
from ...systems.numerics.vision.omni_optics import OmniCamera
from ...systems.numerics.vision.sensor import Sensor
from ...systems.numerics.vision.surroundings import SHELL_COLOURS, Surroundings, shell_of
from ...systems.social.common_robots import InfraredSensors
from ...systems.station.stand_in_devices import (
    CommandTimeout,
    ImperfectChannel,
    PicturePlayer,
    SampledReceiver,
    SamplePlayer,
    WheelEncoders,
)
from ...systems.tracking.agent_team import DifferentialDriveTeam
from ...systems.vision.omni_camera import OmniCameraSensor
from ..tracking.game import TrackingGame
from .hardware import RunLog
from .ports import IMAGE, INFRARED, constant, device_ports, select, split_teams
from .scenario import StationScenario

# Where robots are points, their sensors still need a rim [m].
_SMALLEST_BODY = 1e-3
# Of the pursuers; the evaders take the other colours in turn.
_PURSUERS = "blue"
# What simulated robots report themselves to be doing, as of the firmware.
_DRIVING = 2.0


def AddSimulatedLaboratory(
    builder: DiagramBuilder,
    scenario: StationScenario,
    game: TrackingGame,
    sent_command: OutputPort,
) -> dict[str, OutputPort]:
    """Add robots that obey commands, and what measures them; return the ports of the devices.

    Every channel is as bad as the scenario says. Robots clip commands at the limits of the faster
    team: the controllers keep those of each.
    """
    add, connect = builder.AddNamedSystem, builder.Connect
    bad, count = scenario.imperfections, scenario.size
    teams = (scenario.tracking.pursuers, scenario.tracking.evaders)
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    robots = DifferentialDriveTeam(
        starts,
        top_speed=max(team.top_speed for team in teams),
        top_turn_rate=max(team.top_turn_rate for team in teams),
        time_step=scenario.time_step,
    )
    add("robots", robots)
    radio = add("radio", ImperfectChannel(bad.radio, np.zeros((count, 2))))
    timeout = add("command_timeout", CommandTimeout(count, limit=scenario.radio.heartbeat))
    connect(sent_command, radio.GetInputPort("sent"))
    connect(radio.GetOutputPort("received"), timeout.GetInputPort("command"))
    connect(radio.GetOutputPort("stamp"), timeout.GetInputPort("stamp"))
    connect(timeout.GetOutputPort("obeyed_command"), robots.GetInputPort("command"))

    def measure(name: str, port: OutputPort, channel: Channel, initial: np.ndarray, limit: float):
        """Send a port of all robots through a channel and receive it at the ticks."""
        through = add(f"{name}_channel", ImperfectChannel(channel, initial))
        receiver = SampledReceiver(initial, period=scenario.period, stale_after=limit)
        add(f"{name}_receiver", receiver)
        connect(port, through.GetInputPort("sent"))
        connect(through.GetOutputPort("received"), receiver.GetInputPort("received"))
        connect(through.GetOutputPort("stamp"), receiver.GetInputPort("arrival_stamp"))
        return receiver

    pose = robots.GetOutputPort("pose")
    mocap = measure("mocap", pose, bad.mocap, starts, scenario.mocap.stale_after)
    ports: dict[str, OutputPort] = {}
    for name, output, width in (("poses", "value", 3), ("valid", "valid", 1), ("age", "age", 1)):
        ports |= split_teams(builder, scenario, name, mocap.GetOutputPort(output), width)
    ports |= split_teams(builder, scenario, "stamp", mocap.GetOutputPort("stamp"))
    body = max(scenario.tracking.pursuers.radius, _SMALLEST_BODY)
    ring = InfraredRing()
    sensors = InfraredSensors(game.world, count=count, radius=body, ring=ring)
    add("infrared_sensors", sensors)
    connect(pose, sensors.GetInputPort("pose"))
    nothing_near = np.full((count, INFRARED), ring.reach)
    ranges = sensors.GetOutputPort("infrared")
    infrared = measure(
        "infrared", ranges, bad.infrared, nothing_near, scenario.infrared.stale_after
    )
    ports["infrared.ranges"] = infrared.GetOutputPort("value")
    ports |= {f"infrared.{name}": infrared.GetOutputPort(name) for name in ("valid", "age")}
    chassis = scenario.supervision.chassis
    encoders = add("encoders", WheelEncoders(chassis, starts, period=scenario.time_step))
    connect(pose, encoders.get_input_port())
    # Counts and ranges come in the same reports, and are lost together.
    turned, none = encoders.get_output_port(), np.zeros((count, 2))
    counts = measure("counts", turned, bad.infrared, none, scenario.infrared.stale_after)
    ports["radio.counts"] = counts.GetOutputPort("value")
    ports["radio.state"] = constant(builder, "state", np.full(count, _DRIVING))
    ports["radio.flags"] = constant(builder, "flags", np.zeros(count))
    ports["radio.quality"] = constant(builder, "quality", np.full(count, 1 - bad.radio.dropout))
    ports["radio.battery"] = constant(builder, "battery", np.full(count, np.nan))
    return ports | _add_camera(builder, scenario, game, pose)


def _add_camera(
    builder: DiagramBuilder, scenario: StationScenario, game: TrackingGame, pose: OutputPort
) -> dict[str, OutputPort]:
    """Add the omni-directional camera, or what stands for none."""
    device = scenario.omni_camera
    if device.source == "none":
        player = PicturePlayer([], lambda number: np.zeros((1, 1, 4)), period=scenario.period)
        builder.AddNamedSystem("no_camera", player)
        never = {"valid": 0.0, "age": np.inf, "stamp": -np.inf}
        return {
            IMAGE: player.GetOutputPort("image"),
            **{
                f"omni_camera.{name}": constant(builder, f"camera_{name}", np.array([value]))
                for name, value in never.items()
            },
        }
    others = [k for k in range(scenario.size) if k != device.carrier]
    hues = [colour for colour in SHELL_COLOURS if colour != _PURSUERS]
    pursuers = scenario.tracking.pursuers.size
    colours = [_PURSUERS if k < pursuers else hues[(k - pursuers) % len(hues)] for k in others]
    camera = OmniCameraSensor(
        OmniCamera(),
        Sensor(),
        Surroundings(world=game.world),
        [shell_of(colour) for colour in colours],
        own_shell=shell_of(_PURSUERS),
        period=1.0 / device.rate,
    )
    builder.AddNamedSystem("omni_camera", camera)
    own = [3 * device.carrier + axis for axis in range(3)]
    seen = [3 * k + axis for k in others for axis in range(2)]
    builder.Connect(select(builder, "carrier", pose, own), camera.GetInputPort("pose"))
    shells = select(builder, "shells", pose, seen)
    builder.Connect(shells, camera.GetInputPort("shell_position"))
    frame = camera.GetOutputPort("frame")
    receiver = SampledReceiver(
        np.zeros((1, 3)), period=scenario.period, stale_after=device.stale_after
    )
    builder.AddNamedSystem("camera_receiver", receiver)
    builder.Connect(frame, receiver.GetInputPort("received"))
    taken = select(builder, "exposure_time", frame, [1])
    builder.Connect(taken, receiver.GetInputPort("arrival_stamp"))
    return {
        IMAGE: camera.GetOutputPort("image"),
        **{
            f"omni_camera.{name}": receiver.GetOutputPort(name)
            for name in ("valid", "age", "stamp")
        },
    }


def AddRecordedLaboratory(
    builder: DiagramBuilder, scenario: StationScenario, game: TrackingGame, log: RunLog
) -> dict[str, OutputPort]:
    """Add players of what every device said, tick by tick; return their ports.

    A tick that is lost is as the one before; a picture that is lost is not shown.

    Raises:
        InvalidInput: The log holds no samples, or lacks a port.
    """
    require(len(log.times) > 0, "log", "hold samples", "none")
    sizes = device_ports(scenario)
    period = scenario.period
    ticks = ticks_of(log.times, period)
    # What is lost is as it was before.
    rows = np.searchsorted(ticks, np.arange(ticks[-1] + 1), side="right") - 1
    ports: dict[str, OutputPort] = {}
    for name, size in sizes.items():
        samples = log.samples.get(name)
        good = samples is not None and samples.shape[1] == size
        require(good, "log", f"have a port {name} of size {size}", sorted(log.samples))
        assert samples is not None
        before = _before(name, size, game)
        played = np.where(rows[:, np.newaxis] >= 0, samples[rows], before)
        player = SamplePlayer(played, before, period=period)
        builder.AddNamedSystem(f"player.{name}", player)
        ports[name] = player.GetOutputPort("sample")
    pictures = log.pictures.get(IMAGE, [])
    ticks = [int(tick) for tick in ticks_of(np.array([time for time, _ in pictures]), period)]
    decode = _decoder([png for _, png in pictures])
    player = PicturePlayer(ticks, decode, period=period)
    builder.AddNamedSystem(f"player.{IMAGE}", player)
    ports[IMAGE] = player.GetOutputPort("image")
    return ports


def _before(name: str, size: int, game: TrackingGame) -> np.ndarray:
    """What a device says before its first tick, as its receiver begins."""
    if name.endswith(".poses"):
        starts = game.pursuer_starts if name.startswith("pursuer") else game.evader_starts
        return starts.ravel()
    return np.zeros(size)


def _decoder(pictures: list[bytes]) -> Callable[[int], np.ndarray]:
    def decode(number: int) -> np.ndarray:
        coded = np.frombuffer(pictures[number], dtype=np.uint8)
        picture = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED) if len(coded) else None
        good = picture is not None and picture.ndim == 3 and picture.shape[2] == 4
        require(good, "log", "have pictures with four channels", f"{len(coded)} bytes of others")
        assert picture is not None
        return cv2.cvtColor(picture, cv2.COLOR_BGRA2RGBA)

    return decode


class Gaps:
    """Where ticks of a recording are lost, and what the diagram kept there.

    Args:
        log: The recording.
        period: Between its ticks [s].
    """

    def __init__(self, log: RunLog, period: float) -> None:
        self._ticks = set(ticks_of(log.times, period).tolist())
        self._memory = {round(time / period): known for time, known in log.memory}
        self._gone = False

    def memory_after(self, tick: int) -> Mapping[str, np.ndarray] | None:
        """What to put back after a tick, each asked for in turn; None: the diagram is right."""
        if tick not in self._ticks:
            self._gone = True
            return None
        # The tick after a lost one has seen what was lost, so it is not enough to know that one's.
        known = self._memory.get(tick) if self._gone else None
        self._gone = self._gone and known is None
        return known


def ticks_of(times: np.ndarray, period: float) -> np.ndarray:
    """Numbers of the ticks at which samples were taken, shape (T,).

    Args:
        times: Of the samples, a little after their ticks, shape (T,) [s].
        period: Between ticks [s].
    """
    return np.floor(times / period + 1e-9).astype(int)
