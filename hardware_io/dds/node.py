"""A participant of a DDS domain, with the qualities of service that robots on ROS 2 expect."""

from typing import Any

from cyclonedds.core import (
    DDSException,
    InstanceState,
    Qos,
    ReadCondition,
    SampleState,
    ViewState,
    WaitSet,
)
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from ..links.robot_link import LinkError
from .messages import TYPE_HASHES

# How long a reader may hold up a writer [ms].
_BLOCKED = 5
# Where everything stays on this machine; Cyclone takes its networks otherwise.
LOOPBACK = (
    '<CycloneDDS><Domain id="any"><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto"
    '</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers></Discovery></Domain>'
    "</CycloneDDS>"
)
_PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True)
# A reliable writer is heard by readers of either reliability, and a reader of best effort that asks
# for nothing old hears every writer. Commands are volatile, so that nobody who comes late drives by
# one of before; a reader that asks for those (transient local) hears none at all.
_WRITER = Qos(
    Policy.Reliability.Reliable(duration(milliseconds=_BLOCKED)),
    Policy.Durability.Volatile,
    Policy.History.KeepLast(1),
    _PLAIN_CDR,
)
_READER = Qos(
    Policy.Reliability.BestEffort,
    Policy.Durability.Volatile,
    Policy.History.KeepLast(50),
    _PLAIN_CDR,
)
_ANY = SampleState.Any | ViewState.Any | InstanceState.Any


def open_domain(number: int, configuration: str) -> Any:
    """A domain with a configuration of its own, for this process; kept as long as it is used.

    Args:
        number: Of the domain, 0 to 232.
        configuration: Of Cyclone, in XML.
    """
    return Domain(number, configuration)


def open_on_loopback(number: int) -> Any:
    """A domain that stays on this machine, kept as long as it is used.

    One that this process has open already stays as it is.

    Args:
        number: Of the domain, 0 to 232.
    """
    try:
        return open_domain(number, LOOPBACK)
    except DDSException:
        return None


class Node:
    """Topics of a domain, by the names that ROS gives them there.

    Args:
        domain: Its number (ROS_DOMAIN_ID), 0 to 232.

    Raises:
        LinkError: There is no network for it.
    """

    def __init__(self, domain: int) -> None:
        try:
            self._participant: Any = DomainParticipant(domain)
            self._waiting: Any = WaitSet(self._participant)
        except DDSException as error:
            raise LinkError(f"no DDS domain {domain}: {error.msg}") from None
        self._readers: list[tuple[Any, Any]] = []

    def writer(self, topic: str, kind: type) -> Any:
        """What writes messages of a type.

        Args:
            topic: As in ROS: robot1/cmd_vel.
            kind: Of `messages`.
        """
        found = Topic(self._participant, f"rt/{topic}", kind)
        return DataWriter(self._participant, found, _told(_WRITER, kind))

    def reader(self, topic: str, kind: type) -> Any:
        """What reads messages of a type, and wakes `wait`.

        Args:
            topic: As in ROS: robot1/odom.
            kind: Of `messages`.
        """
        found = Topic(self._participant, f"rt/{topic}", kind)
        reader = DataReader(self._participant, found, _told(_READER, kind))
        condition = ReadCondition(reader, _ANY)
        self._waiting.attach(condition)
        self._readers.append((reader, condition))
        return reader

    def wait(self, patience: float) -> None:
        """Wait until a reader has something.

        Args:
            patience: How long at most [s].
        """
        self._waiting.wait(duration(milliseconds=round(1000 * patience)))

    def take(self, reader: Any) -> list[Any]:
        """Messages that have come, at once; what only tells of a writer's end is left out.

        Args:
            reader: Which has them.
        """
        return [each for each in reader.take(50) if isinstance(each, IdlStruct)]

    @staticmethod
    def source(message: Any) -> int:
        """Number of the writer that a message was taken of; one that begins anew has another.

        Args:
            message: From `take`.
        """
        return message.sample_info.publication_handle

    def close(self) -> None:
        """Leave the domain."""
        self._readers.clear()
        self._waiting = self._participant = None


def _told(qos: Qos, kind: type) -> Qos:
    """The quality of service, with the type's hash as ROS tells it."""
    return qos + Qos(Policy.Userdata(f"typehash={TYPE_HASHES[kind]};".encode()))
