"""Who hears whom: every quality of service of the other side, and the hashes that go beside it."""

import time
from itertools import product

import pytest
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from sightfield.hardware_io.dds.messages import TYPE_HASHES, Twist, TwistStamped, Vector3
from sightfield.hardware_io.dds.node import LOOPBACK, Node, open_domain

DOMAIN = 222
RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))
BEST_EFFORT = Policy.Reliability.BestEffort
VOLATILE, TRANSIENT = Policy.Durability.Volatile, Policy.Durability.TransientLocal
SIDES = dict(
    zip(
        ("reliable", "reliable, transient", "best effort", "best effort, transient"),
        product((RELIABLE, BEST_EFFORT), (VOLATILE, TRANSIENT)),
        strict=True,
    )
)
TOLD = Twist(Vector3(0.25, -0.5, 3.0), Vector3(z=-1.5))


@pytest.fixture(scope="module")
def node():
    domain = open_domain(DOMAIN, LOOPBACK)
    node = Node(DOMAIN)
    yield node
    node.close()
    del domain


@pytest.fixture(scope="module")
def participant(node):
    """The other side."""
    return DomainParticipant(DOMAIN)


def other(participant, topic, side):
    policies = Qos(*SIDES[side], Policy.DataRepresentation(use_cdrv0_representation=True))
    return participant, Topic(participant, f"rt/{topic}", Twist), policies


def heard(write, take, patience):
    """What comes of messages that are written again and again."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        write()
        time.sleep(0.01)
        found = take()
        if found:
            return found[0]
    return None


@pytest.mark.parametrize("side", SIDES)
def test_our_readers_hear_every_writer(node, participant, side):
    topic = f"heard_{list(SIDES).index(side)}"
    reader = node.reader(topic, Twist)
    participant, found, qos = other(participant, topic, side)
    writer = DataWriter(participant, found, qos)
    assert heard(lambda: writer.write(TOLD), lambda: node.take(reader), 10) == TOLD


@pytest.mark.parametrize("side", SIDES)
def test_our_writers_are_heard_unless_somebody_asks_for_old_commands(node, participant, side):
    topic = f"told_{list(SIDES).index(side)}"
    writer = node.writer(topic, Twist)
    participant, found, qos = other(participant, topic, side)
    reader = DataReader(participant, found, qos)
    asks = "transient" in side
    told = heard(lambda: writer.write(TOLD), lambda: reader.take(1), 0.3 if asks else 10)
    assert told == (None if asks else TOLD)


def test_who_comes_late_gets_no_command_of_before(node, participant):
    writer = node.writer("before", Twist)
    writer.write(TOLD)
    participant, found, qos = other(participant, "before", "reliable")
    reader = DataReader(participant, found, qos)
    now = Twist(Vector3(x=0.125))
    assert heard(lambda: writer.write(now), lambda: reader.take(1), 10) == now


def test_hashes_of_types_are_told_as_ros_tells_them(node, participant):
    kept = [node.writer("hashed", kind) for kind in (TwistStamped,)]
    seen = BuiltinDataReader(participant, BuiltinTopicDcpsPublication)

    def told():
        return [
            bytes(each.qos[Policy.Userdata].data)
            for each in seen.take(100)
            if each.topic_name == "rt/hashed"
        ]

    assert heard(lambda: None, told, 10) == f"typehash={TYPE_HASHES[TwistStamped]};".encode()
    del kept
