"""Messages have the bytes that another implementation of ROS 2's types gives them."""

from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from sightfield.hardware_io.dds import messages

STORE = get_typestore(Stores.ROS2_HUMBLE)
TYPES = [each for each in vars(messages).values() if is_dataclass(each)]


def ros_name(kind):
    """As rosbags has it: geometry_msgs/msg/Twist."""
    package, middle, _, name = kind.__idl__.idl_transformed_typename.replace("::", ".").split(".")
    return f"{package}/{middle}/{name.removesuffix('_')}"


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
        return [drawn(messages.TransformStamped(), rng) for _ in range(rng.integers(0, 4))]
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
    assert messages.Twist.__idl__.idl_transformed_typename in (
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


@pytest.mark.parametrize("kind", messages.TYPE_HASHES, ids=lambda kind: kind.__name__)
def test_hashes_are_those_of_rosbags(kind):
    assert messages.TYPE_HASHES[kind] == STORE.hash_rihs01(ros_name(kind))


def test_headings_are_those_of_orientations_whatever_roll_and_pitch_are():
    """Against a rotation matrix: where the x axis points on the floor."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        w, x, y, z = q = rng.normal(size=4)
        w, x, y, z = q / np.linalg.norm(q)
        nose = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z))
        scaled = messages.Quaternion(1.05 * x, 1.05 * y, 1.05 * z, 1.05 * w)
        found = messages.planar(messages.Point(2.0, -3.0, 0.5), scaled)
        assert found == pytest.approx((2.0, -3.0, np.arctan2(nose[1], nose[0])))


def test_an_orientation_that_is_none_gives_no_pose():
    for turn in (messages.Quaternion(w=0.0), messages.Quaternion(w=np.nan)):
        assert np.isnan(messages.planar(messages.Point(1.0, 2.0), turn)).all()
