"""Messages have the bytes that another implementation of ROS 2's types gives them.

Who hears whom: every quality of service of the other side, and the hashes that go beside it.
"""

import ast
import time
from dataclasses import fields, is_dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl._support import Endianness
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from rosbags.typesys import Stores, get_typestore

from sightfield.hardware_io.kinds import dds_node
from sightfield.hardware_io.kinds.dds_node import (
    LOOPBACK,
    TYPE_HASHES,
    Node,
    Twist,
    TwistStamped,
    Vector3,
    open_domain,
)

STORE = get_typestore(Stores.ROS2_HUMBLE)
# Not the dataclasses of the library itself.
TYPES = [
    each for each in vars(dds_node).values() if is_dataclass(each) and hasattr(each, "__idl__")
]


def ros_name(kind):
    """As rosbags has it: geometry_msgs/msg/Twist."""
    package, middle, _, name = kind.__idl__.idl_transformed_typename.replace("::", ".").split(".")
    return f"{package}/{middle}/{name.removesuffix('_')}"


def values(message, path=""):
    """What a message holds, by the path to it."""
    if is_dataclass(message):
        for each in fields(message):
            yield from values(getattr(message, each.name), f"{path}.{each.name}")
    elif isinstance(message, list):
        yield path, [float(each) for each in message]
    else:
        yield path, message


def drawn(value, rng):
    """A message like another, with every number and text drawn."""
    if is_dataclass(value):
        return type(value)(
            **{each.name: drawn(getattr(value, each.name), rng) for each in fields(value)}
        )
    if isinstance(value, str):
        # Lengths decide where the next field begins.
        return "".join(rng.choice(list("abc/_"), rng.integers(0, 9)))
    if value == []:
        return [drawn(dds_node.TransformStamped(), rng) for _ in range(rng.integers(0, 4))]
    if isinstance(value, list):
        return rng.normal(size=len(value)).tolist()
    return float(rng.normal()) if isinstance(value, float) else int(rng.integers(0, 1 << 31))


def as_rosbags(value):
    if is_dataclass(value):
        kind = STORE.types[ros_name(type(value))]
        return kind(**{each.name: as_rosbags(getattr(value, each.name)) for each in fields(value)})
    if isinstance(value, list):
        structs = not value or is_dataclass(value[0])
        return [as_rosbags(each) for each in value] if structs else np.array(value)
    return value


def test_all_types_are_looked_at():
    assert len(TYPES) == 15
    assert dds_node.Twist.__idl__.idl_transformed_typename in (
        "geometry_msgs.msg.dds_.Twist_",
        "geometry_msgs::msg::dds_::Twist_",
    )


@pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)
def test_bytes_are_those_of_rosbags(kind):
    rng = np.random.default_rng(4)
    for _ in range(50):
        message = drawn(kind(), rng)
        theirs = bytes(STORE.serialize_cdr(as_rosbags(message), ros_name(kind)))
        assert message.serialize() == theirs
        assert kind.deserialize(theirs) == message


QUICK = [each for each in TYPES if each.serialize is not IdlStruct.serialize]


@pytest.mark.parametrize("kind", QUICK, ids=lambda kind: kind.__name__)
def test_what_is_packed_at_once_is_read_in_any_order_of_bytes(kind):
    rng = np.random.default_rng(5)
    for order in Endianness.Big, Endianness.Little:
        message = drawn(kind(), rng)
        slowly = IdlStruct.serialize(message, endianness=order)
        assert message.serialize(endianness=order) == slowly
        assert kind.deserialize(slowly) == message
        # Readers may get what is behind the message along with it.
        assert kind.deserialize(slowly + b"\x00\x00\x00") == message
    newer = message.serialize(use_version_2=True)
    assert newer != message.serialize()
    assert kind.deserialize(newer) == message


@pytest.mark.parametrize("kind", dds_node.TYPE_HASHES, ids=lambda kind: kind.__name__)
def test_hashes_are_those_of_rosbags(kind):
    assert dds_node.TYPE_HASHES[kind] == STORE.hash_rihs01(ros_name(kind))


def test_headings_are_those_of_orientations_whatever_roll_and_pitch_are():
    """Against a rotation matrix: where the x axis points on the floor."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        w, x, y, z = q = rng.normal(size=4)
        w, x, y, z = q / np.linalg.norm(q)
        nose = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z))
        scaled = dds_node.Quaternion(1.05 * x, 1.05 * y, 1.05 * z, 1.05 * w)
        found = dds_node.planar(dds_node.Point(2.0, -3.0, 0.5), scaled)
        assert found == pytest.approx((2.0, -3.0, np.arctan2(nose[1], nose[0])))


def test_an_orientation_that_is_none_gives_no_pose():
    for w in (0.0, np.nan, np.inf, 1e200, -1.7e308):
        turn = dds_node.Quaternion(w=w)
        assert np.isnan(dds_node.planar(dds_node.Point(1.0, 2.0), turn)).all()


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


@pytest.mark.parametrize(
    "message",
    [
        TwistStamped(dds_node.Header(frame_id="scram")),
        dds_node.Odometry(child_frame_id="scram"),
        dds_node.TFMessage([dds_node.TransformStamped(child_frame_id="scram")]),
    ],
    ids=lambda message: type(message).__name__,
)
def test_a_message_whose_texts_are_none_is_left_out(node, message):
    kind = type(message)

    class Scrambled(kind):
        def serialize(self, *args, **named):
            return message.serialize(*args, **named).replace(b"scram", b"s\xff\xfe\xfdm")

    reader, writer = node.reader("scrambled", kind), node.writer("scrambled", kind)
    for each in message, Scrambled(), message:
        writer.write(each)
        time.sleep(0.05)
    assert node.take(reader) == [message, message]
    assert node.take(reader) == []


def test_what_the_plant_of_ir_sim_takes_from_here_is_there():
    """It runs in an environment of its own (`make irsim`), where nothing checks its imports."""
    plant = Path(__file__).parents[2] / "interop" / "irsim_plant.py"
    taken = [each for each in ast.parse(plant.read_text()).body if isinstance(each, ast.ImportFrom)]
    (types,) = [each for each in taken if (each.module or "").startswith("sightfield.")]
    assert types.module == dds_node.__name__
    assert {each.name for each in types.names} <= {each.__name__ for each in TYPES}


@pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)
def test_no_type_tells_others_of_a_base(kind):
    """Cyclone DDS 0.10 takes a type whose base has no fields for invalid."""
    assert kind.__base__ is IdlStruct


def test_types_that_stations_say_most_are_packed_at_once():
    assert {each.__name__ for each in QUICK} == {"Twist", "TwistStamped", "Odometry", "PoseStamped"}


@pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)
def test_an_empty_message_holds_zeros_and_rotations_that_turn_nothing(kind):
    # False where all numbers are zero, a list is empty, or there is no text.
    said = {path: value for path, value in values(kind()) if np.any(value)}
    assert set(said.values()) <= {1.0}
    assert set(said) == {path for path, _ in values(kind()) if path.endswith(".w")}
