"""Kinds of robots by name: those of this package, and the user's own."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib import import_module

import numpy as np

from ...systems.numerics.errors import InvalidInput, require
from ..emulation.stand_in_laboratory import DatagramWire
from ..links.robot_link import RobotLink
from .robot_kind import REORDERED, REPEATED, Laboratory, RobotFleet, RobotKind, Surroundings
from .udp_board import UdpBoard
from .udp_link import SILENCE, UdpLink

# Without a setpoint the firmware cuts the motors after this, and levels itself after 0.5 s: its
# COMMANDER_WDT_TIMEOUT_SHUTDOWN [s].
_CRTP_SILENCE = 2.0


def _crtp_link(fleet: RobotFleet) -> RobotLink:
    from .crtp_link import CrtpLink

    return CrtpLink(
        fleet.robots,
        fleet.addresses,
        chassis=fleet.chassis,
        height=fleet.option("height", 0.4),
    )


@contextmanager
def _crtp_stand_in(
    fleet: RobotFleet, around: Surroundings
) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from .crazyflie import Crazyflie

    def make_board(k: int) -> Crazyflie:
        return Crazyflie(around.silence)

    wire = DatagramWire(len(fleet.robots))
    with around.laboratory(fleet.robots, make_board, wire) as laboratory:
        addresses = tuple(f"udp://{each}" for each in wire.addresses)
        yield laboratory, replace(fleet, addresses=addresses)


CRTP = RobotKind(
    name="crtp",
    silence=_CRTP_SILENCE,
    link=_crtp_link,
    stand_in=_crtp_stand_in,
    recognises=frozenset(),
    extra="crtp",
    needs=("cflib",),
)


# Default timeout of ros2_control's differential drive (cmd_vel_timeout) [s].
_DDS_SILENCE = 0.5


def _dds_link(fleet: RobotFleet) -> RobotLink:
    from .dds_link import DdsLink

    return DdsLink(
        fleet.robots,
        fleet.addresses,
        chassis=fleet.chassis,
        domain=fleet.option("domain", 0),
        stamped=fleet.option("stamped", False),
        command=fleet.option("command", "cmd_vel"),
        odometry=fleet.option("odometry", "odom"),
        loopback=fleet.option("loopback", False),
    )


@contextmanager
def _dds_stand_in(
    fleet: RobotFleet, around: Surroundings
) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from .dds_driver import DdsWire, Driver

    stamped = fleet.option("stamped", False)
    # A domain that depends on the process id, to keep parallel runs apart.
    domain = 110 + os.getpid() % 100
    names = [f"stand_in{robot}" for robot in fleet.robots]
    wire = DdsWire(names, domain, stamped=stamped)

    def make_driver(k: int) -> Driver:
        wire.renew(k)
        return Driver(around.silence, stamped=stamped)

    with around.laboratory(fleet.robots, make_driver, wire) as laboratory:
        yield (
            laboratory,
            replace(
                fleet,
                addresses=tuple(names),
                options={"domain": domain, "stamped": stamped, "loopback": True},
            ),
        )


DDS = RobotKind(
    name="dds",
    silence=_DDS_SILENCE,
    link=_dds_link,
    stand_in=_dds_stand_in,
    recognises=frozenset(),
    extra="dds",
    needs=("cyclonedds",),
)


# Timeout of ArduPilot Rover in mode GUIDED, fixed in its code, not a parameter [s].
_MAVLINK_SILENCE = 3.0


def _mavlink_link(fleet: RobotFleet) -> RobotLink:
    from .mavlink_link import MavlinkLink, read_key

    return MavlinkLink(
        fleet.robots,
        fleet.addresses,
        counts_per_metre=fleet.chassis.counts_per_metre,
        key=read_key(fleet.option("key_file", "")),
    )


@contextmanager
def _mavlink_stand_in(
    fleet: RobotFleet, around: Surroundings
) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from .mavlink_link import read_key
    from .rover import Rover

    key, wire = read_key(fleet.option("key_file", "")), DatagramWire(len(fleet.robots))

    def make_rover(k: int) -> Rover:
        counts_per_metre = fleet.chassis.counts_per_metre
        return Rover(fleet.robots[k], around.silence, counts_per_metre=counts_per_metre, key=key)

    with around.laboratory(fleet.robots, make_rover, wire) as laboratory:
        yield laboratory, replace(fleet, addresses=wire.addresses)


MAVLINK = RobotKind(
    name="mavlink",
    silence=_MAVLINK_SILENCE,
    link=_mavlink_link,
    stand_in=_mavlink_stand_in,
    recognises=frozenset(),
    extra="mavlink",
    needs=("pymavlink",),
)


def _udp_link(fleet: RobotFleet) -> RobotLink:
    return UdpLink(fleet.robots, fleet.addresses)


@contextmanager
def _udp_stand_in(
    fleet: RobotFleet, around: Surroundings
) -> Iterator[tuple[Laboratory, RobotFleet]]:
    rng = np.random.default_rng(around.seed)

    def make_board(k: int) -> UdpBoard:
        # Clocks start at any value, and wrap around.
        boot, start = (int(each) for each in rng.integers(0, 1 << 32, 2))
        return UdpBoard(fleet.robots[k], around.silence, boot=boot, start=start)

    wire = DatagramWire(len(fleet.robots))
    with around.laboratory(fleet.robots, make_board, wire) as laboratory:
        yield laboratory, replace(fleet, addresses=wire.addresses)


UDP = RobotKind(name="udp", silence=SILENCE, link=_udp_link, stand_in=_udp_stand_in)


def _xbee_link(fleet: RobotFleet) -> RobotLink:
    from .xbee_link import RadioLink

    return RadioLink(fleet.port, fleet.robots, baud_rate=fleet.baud_rate)


@contextmanager
def _xbee_stand_in(
    fleet: RobotFleet, around: Surroundings
) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from ..emulation.laboratory import EmulatedLaboratory

    air = around.air
    with EmulatedLaboratory(
        fleet.robots,
        around.starts,
        frame_loss=air.frame_loss,
        delay=air.delay,
        jitter=air.jitter,
        seed=around.seed,
        world=around.world,
    ) as laboratory:
        yield laboratory, replace(fleet, port=laboratory.radio_port)


# Silence: the firmware's LINK_TIMEOUT_MS plus one tick of its loop. Late frames are not recognised:
# a frame tells how old the poses were when it was sent, but not how long it was on its way.
XBEE = RobotKind(
    name="xbee",
    silence=0.18,
    link=_xbee_link,
    stand_in=_xbee_stand_in,
    recognises=frozenset({REPEATED, REORDERED}),
    extra="hardware",
    needs=("digi", "serial"),
)


KINDS = {kind.name: kind for kind in (XBEE, UDP, MAVLINK, DDS, CRTP)}


def find_kind(name: str) -> RobotKind:
    """Find a kind of robots by its name.

    Args:
        name: Name in `KINDS`, or `module:NAME` for the user's own RobotKind, in a module of the
            current folder or an installed one. The module is run.

    Raises:
        InvalidInput: There is no such kind.
    """
    module, _, attribute = name.partition(":")
    if not attribute:
        wish = f"be one of {', '.join(KINDS)}, or module:NAME of one's own"
        require(name in KINDS, "radio.kind", wish, name)
        return KINDS[name]
    # An installed command does not search the current folder by itself.
    sys.path.insert(0, os.getcwd())
    try:
        kind = getattr(import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise InvalidInput(
            f"`radio.kind` must be a module and a name in it; got {name}: {error}"
        ) from None
    finally:
        sys.path.pop(0)
    require(isinstance(kind, RobotKind), "radio.kind", "name a RobotKind", type(kind).__name__)
    return kind
