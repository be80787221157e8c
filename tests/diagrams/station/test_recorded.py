"""A run in the simulated laboratory, its report and its scenario are as recorded."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

from sightfield.diagrams.station.hardware import read_run_log
from sightfield.diagrams.station.laboratories import ticks_of
from sightfield.diagrams.station.make_station import MakeStation
from sightfield.diagrams.station.recording import station_tree
from sightfield.diagrams.station.replay import convert_recording, load_recording, replay_station
from sightfield.diagrams.station.report import RunEvent, events_of, summarise_station
from sightfield.diagrams.station.run import run_station
from sightfield.diagrams.station.scenario import (
    Emulation,
    Mocap,
    OmniCameraDevice,
    Radio,
    StationScenario,
    Supervision,
)
from sightfield.systems.numerics.errors import InvalidInput

SETTINGS = (
    "seconds=1.6",
    "imperfections.mocap={delay: 0.021, jitter: 0.02, dropout: 0.1, quantum: 0.001, seed: 4}",
    "imperfections.radio={period: 0.05, delay: 0.012, dropout: 0.15, seed: 5}",
    "imperfections.infrared={period: 0.1, delay: 0.03, dropout: 0.1, seed: 6}",
    "infrared.reflex=0.25",
    "supervision.jump=0.08",
)


@pytest.fixture(scope="module")
def run(load_laboratory, tmp_path_factory):
    """A run of nearly two seconds: scenario, game, how it ended, its log's path."""
    scenario, game = load_laboratory(*SETTINGS)
    path = tmp_path_factory.mktemp("run") / "run.log"
    return scenario, game, run_station(scenario, game, log=path, realtime_rate=0.0), path


def test_a_run_is_as_recorded(run, as_recorded):
    _, _, done, path = run
    log = read_run_log(path)
    as_recorded(log.samples, "samples", relative=1e-5, absolute=1e-6)
    as_recorded([log.times, done.how, done.tracking_time, done.lost_evader], "times")
    as_recorded({name: part.size for name, part in log.memory[3][1].items()}, "memory")


def test_its_summary_is_as_recorded(run, as_recorded):
    scenario, game, done, path = run
    log = read_run_log(path)
    told = summarise_station(done, log, game, "nearly", scenario.seconds, "simulate")
    timed = ("wall_time", "realtime_factor")
    as_recorded({k: v for k, v in told.items() if k not in timed}, relative=1e-5)
    failed = replace(done, failure="a wheel came off")
    told = summarise_station(failed, log, game, "nearly", scenario.seconds, "simulate")
    assert told["events"][-1] == vars(RunEvent(float(log.times[-1]), "", "a wheel came off", True))


def test_events_are_as_recorded(run, as_recorded):
    _, game, _, path = run
    log, rng = read_run_log(path), np.random.default_rng(3)
    shape = log.samples["supervisor.standing"].shape
    samples = {
        **log.samples,
        "supervisor.standing": np.where(rng.random(shape) < 0.1, 2.0, 1.0),
        "supervisor.reason": np.where(rng.random(shape) < 0.05, 13.0, 0.0),
        "operator.view_age": np.where(rng.random((shape[0], 1)) < 0.3, 1.5, 0.2),
    }
    as_recorded([vars(each) for each in events_of(replace(log, samples=samples), game)])


def test_a_run_is_played_again_and_converted_as_recorded(run, tmp_path, as_recorded):
    *_, path = run
    recording = load_recording(path)
    as_recorded(replay_station(recording, tmp_path / "again.log"), "comparison")
    convert_recording(recording, tmp_path / "run.mcap")
    log, other = read_run_log(path), read_run_log(tmp_path / "run.mcap")
    assert other.times.tolist() == log.times.tolist()
    assert len(other.memory) == len(log.memory)
    assert all(other.samples[each].tobytes() == log.samples[each].tobytes() for each in log.samples)
    # With other numbers in one row the first that differs is told.
    spoilt = {name: values.copy() for name, values in log.samples.items()}
    spoilt["team.velocity_commands"][7, 2] += 0.25
    changed = replace(recording, log=replace(log, samples=spoilt))
    found = replay_station(changed, tmp_path / "other.log")
    assert (found.identical, found.first_difference) == (False, 7)
    assert found.greatest_difference == pytest.approx(0.25)
    assert found.differing == ("team.velocity_commands",)


def test_a_tree_of_a_scenario_is_as_recorded(run, as_recorded):
    scenario, game, *_ = run
    as_recorded(station_tree(scenario, game), "tree")
    as_recorded([scenario.radii, scenario.bodies, scenario.names, scenario.robots], "lists")


def test_the_parts_of_a_station_are_as_recorded(load_laboratory, as_recorded):
    scenario, game = load_laboratory("omni_camera={source: none}")
    builder = DiagramBuilder()
    builder.AddSystem(MakeStation(scenario, game=game))
    station = builder.Build().GetSystems()[0]
    as_recorded([each.get_name() for each in station.GetSystems()], "systems")


def test_ticks_are_whole_periods():
    assert ticks_of(np.array([0.0, 0.0499, 0.05, 0.1499999999, 0.15]), 0.05).tolist() == [
        *[0, 0, 1, 2],
        3,
    ]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Radio(repeats=101), "`repeats` must be 100 at most"),
        (lambda: Radio(robots=[1, 1]), "`robots` must differ"),
        (lambda: OmniCameraDevice(rate=1000.1), "`rate` must be 1000 at most"),
        (lambda: Emulation(frame_loss=1.001), r"`frame_loss` must lie in \[0, 1\]"),
        (lambda: Emulation(frame_loss=-0.001), r"`frame_loss` must lie in \[0, 1\]"),
        (lambda: Radio(heartbeat=0.0), "`heartbeat` must be positive"),
        (lambda: Radio(kind=""), "`kind` must name a kind"),
        (lambda: OmniCameraDevice(stale_after=0.0), "`stale_after` must be positive"),
        (lambda: Emulation(delay=-0.1), "`delay` must be zero or positive"),
        (lambda: Mocap(stale_after=0.0), "`stale_after` must be positive"),
        (lambda: Mocap(source="log"), "`log` must name a recorded run"),
        (lambda: Mocap(topic="poses"), "`topic` must have {body} in it"),
        (lambda: Supervision(jump=0.0), "`jump` must be positive"),
        (lambda: Supervision(silent_after=0.0), "`silent_after` must be positive"),
        (lambda: Supervision(slack=100.1), "`slack` must be 100 at most"),
    ],
)
def test_what_goes_too_far_is_refused(make, message):
    with pytest.raises(InvalidInput, match=message):
        make()


def test_what_goes_as_far_as_it_may_is_not(load_laboratory):
    scenario, _ = load_laboratory()
    assert Radio(repeats=100).repeats == 100
    assert OmniCameraDevice(rate=1000.0).rate == 1000.0
    assert (Emulation(frame_loss=1.0).frame_loss, Emulation(frame_loss=0.0).seed) == (1.0, 0)
    assert Supervision(slack=100.0).slack == 100.0
    assert replace(scenario, time_step=0.001).time_step == 0.001
    assert replace(scenario, time_step=scenario.period).period == scenario.period
    for step in (0.0009, scenario.period + 1e-6):
        with pytest.raises(InvalidInput, match="`time_step` must be"):
            replace(scenario, time_step=step)


def test_what_a_scenario_says_by_itself_is_as_recorded(load_laboratory, as_recorded):
    scenario, _ = load_laboratory()
    as_recorded(
        {
            k: v
            for k, v in vars(StationScenario(tracking=scenario.tracking)).items()
            if k != "tracking"
        }
    )
