"""Crazyflies, by CRTP over their radio or UDP; one that speaks CRTP and has wheels stands in."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..emulation.stand_in_laboratory import DatagramWire
from ..links.robot_link import RobotLink
from .robot_kind import Laboratory, RobotFleet, RobotKind, Surroundings

# Without a setpoint the firmware cuts the motors after this, and levels itself after 0.5 s: its
# COMMANDER_WDT_TIMEOUT_SHUTDOWN [s].
_SILENCE = 2.0


def _link(fleet: RobotFleet) -> RobotLink:
    from ..crtp.crtp_link import CrtpLink

    return CrtpLink(
        fleet.robots,
        fleet.addresses,
        chassis=fleet.chassis,
        height=fleet.option("height", 0.4),
    )


@contextmanager
def _stand_in(fleet: RobotFleet, around: Surroundings) -> Iterator[tuple[Laboratory, RobotFleet]]:
    from ..crtp.crazyflie import Crazyflie

    def make_board(k: int) -> Crazyflie:
        return Crazyflie(around.silence)

    wire = DatagramWire(len(fleet.robots))
    with around.laboratory(fleet.robots, make_board, wire) as laboratory:
        addresses = tuple(f"udp://{each}" for each in wire.addresses)
        yield laboratory, replace(fleet, addresses=addresses)


CRTP = RobotKind(
    name="crtp",
    silence=_SILENCE,
    link=_link,
    stand_in=_stand_in,
    recognises=frozenset(),
    extra="crtp",
    needs=("cflib",),
)
