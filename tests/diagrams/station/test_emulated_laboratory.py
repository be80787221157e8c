"""The whole loop in emulation: 20 Hz, a tenth of the frames lost, the others 50 ms late.

Host diagram, digi-xbee, pty, emulated radio, UART of simavr, the real firmware, wheels, motion
capture, host; in the time of the wall.
"""

import numpy as np
import pytest

from sightfield.diagrams.station.hardware import read_run_log
from sightfield.diagrams.station.replay import load_recording, replay_station
from sightfield.diagrams.station.run import STOP
from sightfield.systems.numerics.geometry.edge_index import build_edge_index, clearances


@pytest.fixture(scope="module")
def log(emulated_run):
    """What its ports said."""
    return read_run_log(emulated_run.log)


def test_the_team_keeps_every_evader_in_sight_until_the_operator_stops_it(emulated_run, log):
    assert emulated_run.run.how == STOP
    assert emulated_run.run.lost_evader is None
    # The clock counts ticks at which robots run; for half a second none did.
    running = (log.samples["supervisor.standing"][1:] == 1).any(axis=1)
    assert emulated_run.run.tracking_time == pytest.approx(0.05 * running.sum())
    assert 6.0 < emulated_run.run.tracking_time < 8.9
    seen = log.samples["tracking.visibility"].reshape(len(log.times), 3, 3)
    assert (seen[1:].max(axis=1) == 1).all()


def test_robots_really_drive(log):
    poses = log.samples["pursuer.poses"].reshape(-1, 3, 3)
    ways = np.hypot(*np.diff(poses[:, :, :2], axis=0).transpose(2, 0, 1)).sum(axis=0)
    assert ways.sum() > 1.5


def test_robots_keep_off_the_obstacles(load_laboratory, log):
    scenario, game = load_laboratory()
    for team in ("pursuer", "evader"):
        places = log.samples[f"{team}.poses"].reshape(-1, 3)[:, :2]
        # Of the 0.16 m that a controller without delay keeps, the delay costs a little.
        gaps = clearances(build_edge_index(game.world), places)
        assert gaps.min() > scenario.tracking.pursuers.radius - 0.05


@pytest.mark.parametrize("what", ["radio", "mocap", "stop"])
def test_every_robot_stands_still_within_300_ms(emulated_run, what):
    assert (emulated_run.moving[what] > 0.05).any()
    assert (emulated_run.rest[what] <= 0.3).all(), emulated_run.rest[what]


def test_robots_go_on_when_what_was_cut_is_mended(emulated_run, log):
    speeds = log.samples["team.sent_commands"][:, ::2]
    frozen = (log.times > 6.5 + 0.2) & (log.times < 6.5 + 0.55)
    assert (speeds[frozen] == 0).all()
    assert (emulated_run.moving["stop"] > 0.05).any()


def test_what_robots_report_comes_back(log):
    late = log.times > 2.0
    assert (log.samples["infrared.valid"][log.times < 4.0][-10:] == 1).all()
    quality = log.samples["radio.quality"][late & (log.times < 4.0)]
    # A tenth is lost on the way there.
    assert quality.mean() == pytest.approx(0.9, abs=0.08)
    ranges = log.samples["infrared.ranges"][late]
    assert ((ranges >= 0) & (ranges <= 0.41)).all()


def test_the_recorded_run_gives_the_same_commands_bit_for_bit(emulated_run, tmp_path):
    recording = load_recording(emulated_run.log)
    assert recording.mode == "emulate"
    result = replay_station(recording, tmp_path / "again.log")
    assert result.ticks > 180
    assert (result.identical, result.differing) == (True, ())
