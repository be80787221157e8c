"""Small boards on Wi-Fi, with datagrams of our own; a board in Python stands in."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from ..emulation.stand_in_laboratory import DatagramWire
from ..links.robot_link import RobotLink
from ..udp.udp_board import UdpBoard
from ..udp.udp_link import SILENCE, UdpLink
from .robot_kind import Laboratory, RobotFleet, RobotKind, Surroundings


def _link(fleet: RobotFleet) -> RobotLink:
    return UdpLink(fleet.robots, fleet.addresses)


@contextmanager
def _stand_in(fleet: RobotFleet, around: Surroundings) -> Iterator[tuple[Laboratory, RobotFleet]]:
    rng = np.random.default_rng(around.seed)

    def make_board(k: int) -> UdpBoard:
        # Clocks start anywhere, and go round.
        boot, start = (int(each) for each in rng.integers(0, 1 << 32, 2))
        return UdpBoard(fleet.robots[k], around.silence, boot=boot, start=start)

    wire = DatagramWire(len(fleet.robots))
    with around.laboratory(fleet.robots, make_board, wire) as laboratory:
        yield laboratory, replace(fleet, addresses=wire.addresses)


UDP = RobotKind(name="udp", silence=SILENCE, link=_link, stand_in=_stand_in)
