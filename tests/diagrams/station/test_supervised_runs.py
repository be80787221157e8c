"""Runs in which something is wrong: what is told of them, and that they are played again."""

import json

import numpy as np
import pytest

from sightfield.diagrams.station.hardware import Operator, read_run_log
from sightfield.diagrams.station.replay import load_recording, replay_station
from sightfield.diagrams.station.report import (
    events_of,
    summarise_station,
    write_station_report,
)
from sightfield.diagrams.station.run import FAILURE, run_station
from sightfield.hardware_io.links.robot_link import LinkError
from sightfield.systems.numerics.station.supervision import Reason, Standing


@pytest.fixture(scope="module")
def unheard(load_laboratory, tmp_path_factory):
    """A second and a half of robots that hear nothing, with a pause: the run, its log, its game."""
    path = tmp_path_factory.mktemp("unheard") / "run.log"
    scenario, game = load_laboratory("imperfections.radio.dropout=1.0", "seconds=1.5")
    operator = Operator()

    def at_tick(now):
        if abs(now - 0.2) < 0.01:
            operator.say("pause")
        elif abs(now - 0.4) < 0.01:
            operator.say("start")

    done = run_station(
        scenario, game, log=path, operator=operator, realtime_rate=0, at_tick=at_tick
    )
    return done, path, game


def test_every_change_is_an_event_and_what_is_wrong_a_fault(unheard):
    _, path, game = unheard
    events = events_of(read_run_log(path), game)
    assert [each.text for each in events[:4]] == ["armed", "running", "armed", "running"]
    assert [each.time for each in events[:4]] == pytest.approx([0, 0.05, 0.25, 0.45], abs=1e-3)
    faults = [each for each in events if each.fault]
    assert faults
    assert {each.text for each in faults} == {"held: its pose does not follow its commands"}


def test_the_clock_counts_the_ticks_at_which_a_robot_runs(unheard):
    done, path, _ = unheard
    log = read_run_log(path)
    running = (log.samples["supervisor.standing"] == Standing.RUNNING).any(axis=1)
    clock = log.samples["supervisor.clock"][:, 0]
    assert clock == pytest.approx(0.05 * np.cumsum(running))
    assert done.tracking_time == pytest.approx(clock[-1])
    assert 0 < done.tracking_time < 1.3


def test_the_summary_of_a_run_with_holds_is_written(unheard, tmp_path):
    done, path, game = unheard
    log = read_run_log(path)
    summary = summarise_station(done, log, game, "thesis_3v3", 1.5, "simulate")
    write_station_report(done, log, game, summary, tmp_path)
    written = json.loads((tmp_path / "summary.json").read_text())
    assert written == json.loads(json.dumps(summary))
    assert written["faults"] == sum(event["fault"] for event in written["events"]) > 0


def test_a_device_that_fails_ends_the_run_and_what_was_until_then_is_told(
    load_laboratory, tmp_path
):
    scenario, game = load_laboratory("seconds=3.0")

    def fail(now):
        if now > 0.97:
            raise LinkError("the radio takes nothing any more")

    done = run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0, at_tick=fail)
    assert (done.how, done.failure) == (FAILURE, "the radio takes nothing any more")
    log = read_run_log(tmp_path / "run.log")
    running = (log.samples["supervisor.standing"] == Standing.RUNNING).any(axis=1)
    assert 0.9 < log.times[-1] < 1.1
    # A tick in which something fails does not count, though it was written down before it did.
    assert done.tracking_time == pytest.approx(0.05 * (running.sum() - 1))
    summary = summarise_station(done, log, game, "broken", 3.0, "hardware")
    event = summary["events"][-1]
    assert (event["text"], event["fault"], summary["faults"]) == (done.failure, True, 1)
    assert write_station_report(done, log, game, summary, tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["ended"] == FAILURE


def test_one_that_fails_at_once_is_no_run(load_laboratory, tmp_path):
    scenario, game = load_laboratory()

    def fail(now):
        raise LinkError("the radio takes nothing at all")

    with pytest.raises(LinkError, match="nothing at all"):
        run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0, at_tick=fail)


def test_who_is_held_is_sent_nothing(unheard):
    log = read_run_log(unheard[1])
    held = log.samples["supervisor.reason"] == Reason.NOT_FOLLOWING
    assert held.any()
    assert (log.samples["team.sent_commands"].reshape(-1, 6, 2)[held] == 0).all()


def test_a_run_with_holds_gives_the_same_commands_bit_for_bit(unheard, tmp_path):
    result = replay_station(load_recording(unheard[1]), tmp_path / "again.log")
    assert (result.identical, result.differing) == (True, ())


def test_robots_drive_no_further_towards_what_they_feel_and_that_is_an_event_but_no_fault(
    load_laboratory, tmp_path
):
    # Sensors that feel walls from afar.
    scenario, game = load_laboratory("infrared.reflex=0.35", "seconds=3")
    run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0)
    log = read_run_log(tmp_path / "run.log")
    near = log.samples["supervisor.reason"] == Reason.OBSTACLE
    sent = log.samples["team.sent_commands"].reshape(-1, 6, 2)
    assert near.any()
    assert (log.samples["supervisor.standing"][near] == Standing.RUNNING).all()
    assert (sent[near, 0] <= 0).all()
    assert (sent[~near, 0] > 0).any()
    told = [each for each in events_of(log, game) if "obstacle" in each.text]
    assert told
    assert not any(each.fault for each in told)
