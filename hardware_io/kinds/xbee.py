"""Robots on an ATmega2560 with XBee radios, as in 2014; the real firmware in simavr stands in."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..links.robot_link import RobotLink
from .robot_kind import REORDERED, REPEATED, Laboratory, RobotFleet, RobotKind, Surroundings


def _link(fleet: RobotFleet) -> RobotLink:
    from ..radio.link import RadioLink

    return RadioLink(fleet.port, fleet.robots, baud_rate=fleet.baud_rate)


@contextmanager
def _stand_in(fleet: RobotFleet, around: Surroundings) -> Iterator[tuple[Laboratory, RobotFleet]]:
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


# The firmware's LINK_TIMEOUT_MS, and a tick of its loop. It is told how old the poses of a command
# were when it was sent, and cannot see how long that was on its way.
XBEE = RobotKind(
    name="xbee",
    silence=0.18,
    link=_link,
    stand_in=_stand_in,
    recognises=frozenset({REPEATED, REORDERED}),
    extra="hardware",
    needs=("digi", "serial"),
)
