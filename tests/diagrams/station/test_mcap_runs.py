"""Runs of the laboratory kept as MCAP: replay is identical, and logs turn into one another."""

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from sightfield.diagrams.station.replay import convert_recording, load_recording, replay_station
from sightfield.diagrams.station.run import run_station


@pytest.fixture(scope="module")
def run_path(load_laboratory, tmp_path_factory):
    """Of a little more than two seconds in the simulated laboratory, with its camera."""
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    scenario, game = load_laboratory("seconds=2.2")
    run_station(scenario, game, log=path, realtime_rate=0)
    return path


def test_a_run_is_played_again_to_identical_commands(run_path, tmp_path):
    recording = load_recording(run_path)
    assert (recording.log.complete, recording.log.lost, len(recording.log.times)) == (True, 0, 45)
    result = replay_station(recording, tmp_path / "again.log")
    assert (result.identical, result.differing, result.ticks) == (True, (), 45)


def test_what_follows_a_lost_chunk_is_played_to_identical_commands(run_path, tmp_path):
    data = bytearray(run_path.read_bytes())
    data[len(data) // 2] ^= 8
    (tmp_path / "run.mcap").write_bytes(data)
    recording = load_recording(tmp_path / "run.mcap")
    assert recording.log.lost == 20
    result = replay_station(recording, tmp_path / "again.log")
    assert (result.identical, result.differing, result.ticks) == (True, (), 25)


def test_logs_turn_into_one_another_to_the_last_bit(run_path, tmp_path):
    first = load_recording(run_path)
    convert_recording(first, tmp_path / "a.log")
    convert_recording(load_recording(tmp_path / "a.log"), tmp_path / "b.mcap")
    convert_recording(load_recording(tmp_path / "b.mcap"), tmp_path / "b.log")
    assert (tmp_path / "a.log").read_bytes() == (tmp_path / "b.log").read_bytes()
    second = load_recording(tmp_path / "b.mcap")
    assert second.log.times.tobytes() == first.log.times.tobytes()
    assert second.log.pictures == first.log.pictures
    for name, samples in first.log.samples.items():
        assert second.log.samples[name].tobytes() == samples.tobytes()


def test_robots_are_where_the_samples_have_them(run_path):
    samples = load_recording(run_path).log.samples
    places, speeds = [], []
    with AnyReader([run_path]) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            if connection.topic == "/tf":
                (frame,) = [f for f in message.transforms if f.child_frame_id == "evader_2"]
                at, turn = frame.transform.translation, frame.transform.rotation
                places.append((at.x, at.y, 2 * np.arctan2(turn.z, turn.w)))
            elif connection.topic == "/pursuer_1/command":
                speeds.append((message.twist.linear.x, message.twist.angular.z))
    poses = samples["evader.poses"].reshape(-1, 3, 3)[:, 2]
    np.testing.assert_array_equal(np.array(places)[:, :2], poses[:, :2])
    np.testing.assert_allclose(np.cos(np.array(places)[:, 2] - poses[:, 2]), 1.0)
    np.testing.assert_array_equal(speeds, samples["team.sent_commands"][:, 2:4])


def test_on_the_command_line(tmp_path, sightfield_here):
    words = ("station", "thesis_3v3", "--seconds", 1.5, "--realtime", 0, "--no-view", "--mcap")
    done = sightfield_here(*words, "--out", tmp_path)
    assert done.returncode == 0, done.stderr
    assert "run.mcap" in done.stdout
    done = sightfield_here("station", "replay", tmp_path / "run.mcap")
    assert (done.returncode, "bit for bit" in done.stdout) == (0, True)
    data = bytearray((tmp_path / "run.mcap").read_bytes())
    data[len(data) // 2] ^= 4
    (tmp_path / "run.mcap").write_bytes(data)
    done = sightfield_here("station", "convert", tmp_path / "run.mcap", tmp_path / "left.log")
    assert done.returncode == 1
    assert "The log is damaged:" in done.stdout
    assert load_recording(tmp_path / "left.log").log.complete
    done = sightfield_here("station", "convert", tmp_path / "run.mcap", tmp_path / "left.txt")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: `out` must end in .mcap or .log; got")
