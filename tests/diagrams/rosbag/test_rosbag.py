"""Bags hold what the logs do, as two other libraries read them."""

import sys

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from sightfield.diagrams.rosbag.bag import RosBag
from sightfield.systems.numerics.geometry.world import make_world


def messages_of(path):
    """Of each topic: times [s] and messages, as rosbags reads them."""
    found = {}
    with AnyReader([path]) as reader:
        for connection, time, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((time * 1e-9, message))
    return found


def heading_of(rotation):
    assert (rotation.x, rotation.y) == (0.0, 0.0)
    return 2.0 * np.arctan2(rotation.z, rotation.w)


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """One message of each kind."""
    path = tmp_path_factory.mktemp("bags") / "run.mcap"
    world = make_world([[0, 0], [4, 0], [4, 3], [0, 3]], [[[1, 1], [2, 1], [2, 2]]])
    with RosBag(path) as writer:
        writer.about('{"said": "as it was"}')
        writer.world(world)
        writer.transforms(0.5, {"robot": (1.25, -0.5, 2.5), "other": (0.0, 1.0, -3.0)})
        writer.twist("/robot/command", 1.75, "robot", 0.25, -0.125, 3.0)
        writer.numbers("/log/table", 2.0, np.arange(6.0).reshape(2, 3) / 7.0)
        writer.picture("/camera", 2.5, "camera", b"\x89PNG...")
    return path


def test_each_kind_of_message_says_what_was_written(bag):
    found = messages_of(bag)
    ((time, markers),) = found["/world"]
    assert time == 0.0
    outline, hole = ([(p.x, p.y) for p in marker.points] for marker in markers.markers)
    assert sorted(outline[:-1]) == [(0, 0), (0, 3), (4, 0), (4, 3)]
    assert sorted(hole[:-1]) == [(1, 1), (2, 1), (2, 2)]
    assert outline[0] == outline[-1]
    ((time, frames),) = found["/tf"]
    robot, other = frames.transforms
    assert (robot.child_frame_id, other.child_frame_id) == ("robot", "other")
    assert robot.header.frame_id == "world"
    assert (robot.header.stamp.sec, robot.header.stamp.nanosec) == (0, 500_000_000)
    place = robot.transform.translation
    assert (time, place.x, place.y, place.z) == (0.5, 1.25, -0.5, 0.0)
    assert heading_of(robot.transform.rotation) == pytest.approx(2.5)
    assert heading_of(other.transform.rotation) == pytest.approx(-3.0)
    ((time, command),) = found["/robot/command"]
    twist = command.twist
    assert (time, twist.linear.x, twist.linear.y, twist.angular.z) == (1.75, 0.25, -0.125, 3.0)
    assert command.header.frame_id == "robot"
    ((_, table),) = found["/log/table"]
    assert [(side.size, side.stride) for side in table.layout.dim] == [(2, 6), (3, 3)]
    np.testing.assert_array_equal(table.data, np.arange(6.0) / 7.0)
    ((_, picture),) = found["/camera"]
    assert (picture.format, bytes(picture.data)) == ("png", b"\x89PNG...")


def test_the_file_is_mcap_with_the_types_in_it(bag):
    with bag.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == 6
        assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            assert message.log_time == message.publish_time
    with Reader(bag) as reader:
        assert reader.message_count == 6


def test_a_chunk_holds_a_second_of_the_run(bag):
    with bag.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    spans = [
        (chunk.message_start_time / 1e9, chunk.message_end_time / 1e9)
        for chunk in summary.chunk_indexes
    ]
    assert spans == [(0.0, 0.5), (1.75, 2.5)]


def test_what_is_known_beside_is_in_the_bag(bag):
    ((_, about),) = messages_of(bag)["/about"]
    assert about.data == '{"said": "as it was"}'


def test_without_the_package_one_line_says_what_to_install(monkeypatch, tmp_path, sightfield_here):
    for name in ("mcap", "rosbags"):
        monkeypatch.setitem(sys.modules, name, None)
    done = sightfield_here("track", "corner_1v1", "--mcap", "--out", tmp_path / "out")
    assert done.returncode == 2
    assert done.stderr.strip().splitlines() == [
        "error: an MCAP file must come with the extra [mcap]: "
        "pip install '.[mcap]' in the checkout; not installed: mcap, rosbags"
    ]
    assert not (tmp_path / "out").exists()


def test_a_bag_needs_a_folder(sightfield_here):
    done = sightfield_here("track", "--mcap")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.strip() == "error: `--mcap` must come with --out; got none"


def test_a_game_is_in_its_bag_to_the_last_bit(tmp_path, sightfield_here):
    words = ("track", "thesis_3v3", "--seconds", 2, "--mcap", "--no-replay", "--out", tmp_path)
    done = sightfield_here(*words)
    assert done.returncode == 0, done.stderr
    found, log = messages_of(tmp_path / "log.mcap"), dict(np.load(tmp_path / "log.npz"))
    times = log.pop("time")
    for name, values in log.items():
        written = found[f"/log/{name}"]
        np.testing.assert_allclose([time for time, _ in written], times, atol=1e-9)
        rows = np.array([message.data for _, message in written]).reshape(values.shape)
        np.testing.assert_array_equal(rows, values)
    for (_, frames), places in zip(found["/tf"], log["evader_position"], strict=True):
        at = {frame.child_frame_id: frame.transform.translation for frame in frames.transforms}
        assert len(at) == 6
        for number, place in enumerate(places):
            np.testing.assert_array_equal(
                (at[f"evader_{number}"].x, at[f"evader_{number}"].y), place
            )
    speeds = [
        (message.twist.linear.x, message.twist.linear.y)
        for _, message in found["/pursuer_1/velocity"]
    ]
    np.testing.assert_array_equal(speeds, log["pursuer_velocity"][:, 1])
