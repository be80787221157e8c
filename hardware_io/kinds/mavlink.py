"""Rovers with ArduPilot, by MAVLink over UDP; one that speaks MAVLink stands in."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..emulation.stand_in_laboratory import DatagramWire
from ..links.robot_link import RobotLink
from .robot_kind import Laboratory, RobotFleet, RobotKind, Surroundings

# Of ArduPilot Rover in mode GUIDED, which has it in its code and not among its parameters [s].
_SILENCE = 3.0


def _link(fleet: RobotFleet) -> RobotLink:
    from ..mavlink.mavlink_link import MavlinkLink
    from ..mavlink.packets import read_key

    return MavlinkLink(
        fleet.robots,
        fleet.addresses,
        counts_per_metre=fleet.chassis.counts_per_metre,
        key=read_key(fleet.option("key_file", "")),
    )


@contextmanager
def _stand_in(fleet: RobotFleet, around: Surroundings) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from ..mavlink.packets import read_key
    from ..mavlink.rover import Rover

    key, wire = read_key(fleet.option("key_file", "")), DatagramWire(len(fleet.robots))

    def make_rover(k: int) -> Rover:
        counts_per_metre = fleet.chassis.counts_per_metre
        return Rover(fleet.robots[k], around.silence, counts_per_metre=counts_per_metre, key=key)

    with around.laboratory(fleet.robots, make_rover, wire) as laboratory:
        yield laboratory, replace(fleet, addresses=wire.addresses)


MAVLINK = RobotKind(
    name="mavlink",
    silence=_SILENCE,
    link=_link,
    stand_in=_stand_in,
    recognises=frozenset(),
    extra="mavlink",
    needs=("pymavlink",),
)
