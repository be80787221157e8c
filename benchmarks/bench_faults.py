"""Faults in the emulated laboratory: how soon robots stand, and what is said of them.

Runs in the time of the wall, a few seconds a fault, and is to run alone. As many moments of each
fault as MOMENTS says: `MOMENTS=30 make bench ARGS="-k faults"`; `KIND=udp` plays with robots of
that kind, `KIND=all` with those of each in turn; `FAULT="pose stuck,encoder dead"` plays these
alone.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pydrake.lcm import DrakeLcm

from sightfield.diagrams.scenario_files import find_scenario
from sightfield.diagrams.station import scenarios
from sightfield.diagrams.station.fault_campaign import FAULTS, run_faults
from sightfield.diagrams.station.hardware import (
    KINDS,
    AirSettings,
    RobotFleet,
    Surroundings,
    find_kind,
    find_view,
    read_run_log,
)
from sightfield.diagrams.station.laboratory_files import load_station
from sightfield.diagrams.station.ports import STANDING
from sightfield.diagrams.station.run import FAILURE
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.hardware_io.kinds.dds_node import LOOPBACK
from sightfield.hardware_io.mocap.lcm_poses import PosesMessage, encode
from sightfield.systems.numerics.station.supervision import Standing

pytestmark = pytest.mark.benchmarks

MOMENTS = int(os.environ.get("MOMENTS", "5"))
# Of the robots.
KIND = os.environ.get("KIND", "xbee")
CHOSEN = list(KINDS) if KIND == "all" else [KIND]
# Faults by name, with commas between them; all without.
PLAYED_FAULTS = [each for each in os.environ.get("FAULT", "").split(",") if each] or list(FAULTS)
# Of an emulation that keeps up with the wall all the time [s], and of robots whose radio is cut
# beside the silence after which they stop by themselves.
LIMIT, LIMIT_OF_SILENCE = 0.5, 0.1


# What ends a controller that drives real devices, done to it and its laboratory, and its exit code:
# what signals stop exits with 128 and their number, and the rest with a fault.
ENDINGS = {
    "SIGKILL": (lambda controller, laboratory: controller.send_signal(signal.SIGKILL), -9),
    "SIGHUP": (lambda controller, laboratory: controller.send_signal(signal.SIGHUP), 129),
    "SIGTERM": (lambda controller, laboratory: controller.send_signal(signal.SIGTERM), 143),
    "Ctrl-C": (lambda controller, laboratory: controller.send_signal(signal.SIGINT), 130),
    "serial line stalled": (lambda controller, laboratory: laboratory.stall_line(), 2),
    "viewer killed": (lambda controller, laboratory: kill_viewer(), 1),
}
# Radios alone have a serial line.
PLAYED = [
    (ending, kind)
    for ending in ENDINGS
    for kind in CHOSEN
    if ending != "serial line stalled" or kind == "xbee"
]
# Of a run whose viewer is killed, which goes to its horizon [s], and the viewer's port.
HORIZON, PORT = 8.0, 7321
# Poses go out on a network of their own.
NETWORK = "udpm://239.255.76.67:7681?ttl=0"


def kill_viewer() -> None:
    view = find_view(PORT)
    assert view is not None
    os.kill(view.pid, signal.SIGKILL)


@pytest.fixture
def laboratory():
    """The thesis's laboratory, its scenario and its game."""
    scenario = load_station(find_scenario("thesis_3v3", scenarios), ())
    return scenario, set_up_game(scenario.tracking)


@contextmanager
def emulated(kind, scenario, game):
    """Robots that stand in for a kind's, their poses on the network, and how both are reached."""
    air, made = scenario.emulation, find_kind(kind)
    around = Surroundings(
        starts=np.concatenate([game.pursuer_starts, game.evader_starts]),
        air=AirSettings(frame_loss=air.frame_loss, delay=air.delay),
        world=game.world,
        silence=made.stops_after,
    )
    fleet = RobotFleet(robots=tuple(scenario.robots), chassis=scenario.supervision.chassis)
    with made.open_stand_in(fleet, around) as (robots, reached):
        lcm, ended = DrakeLcm(NETWORK), threading.Event()

        def tell():
            seen = (True,) * scenario.size
            while not ended.wait(0.01):
                poses = tuple(tuple(map(float, pose)) for pose in robots.poses())
                message = PosesMessage(time.time_ns() // 1000, tuple(scenario.bodies), poses, seen)
                lcm.Publish("poses", encode(message))

        thread = threading.Thread(target=tell, daemon=True)
        thread.start()
        settings = {
            "radio.kind": kind,
            "radio.port": reached.port or "none",
            "radio.baud_rate": reached.baud_rate,
            "radio.addresses": list(reached.addresses),
            "radio.options": dict(reached.options),
            "mocap.source": "lcm",
            "mocap.url": NETWORK,
            "mocap.channel": "poses",
        }
        yield robots, [f"{name}={json.dumps(value)}" for name, value in settings.items()]
        ended.set()
        thread.join()


def command(settings, out, *more):
    words = [Path(sys.executable).with_name("sightfield"), "station", "run", "--hardware", "--go"]
    return [*words, "--out", out, *more, *(word for each in settings for word in ("--set", each))]


def running_time(log):
    """Of a run's log: for how long some robot ran [s]."""
    standing = log.samples[STANDING]
    return len(log.times) and float((standing == Standing.RUNNING).any(axis=1).sum()) * 0.05


@pytest.mark.parametrize(("ending", "kind"), PLAYED)
def test_endings(ending, kind, laboratory, tmp_path):
    act, code = ENDINGS[ending]
    scenario, game = laboratory
    rng, rests, waits, codes = np.random.default_rng(3), [], [], []
    # Robots on loopback, whatever networks there are.
    environment = {**os.environ, "CYCLONEDDS_URI": LOOPBACK}
    told = timed = 0
    watched = ending == "viewer killed"
    horizon = HORIZON if watched else 60.0
    for number in range(MOMENTS):
        out = tmp_path / str(number)
        with emulated(kind, scenario, game) as (robots, settings):
            view = ("--view", "--port", str(PORT)) if watched else ("--no-view",)
            controller = subprocess.Popen(
                command(settings, out, "--seconds", str(horizon), *view),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=environment,
            )
            while np.abs(robots.wheel_speeds()).max() < 0.1:
                assert controller.poll() is None, controller.stdout.read().decode()
                time.sleep(0.01)
            time.sleep(rng.uniform(0.5, 3.0))
            at = robots.time()
            act(controller, robots)
            began = time.monotonic()
            if not watched:
                codes.append(controller.wait(30))
                waits.append(time.monotonic() - began)
            # A kind may go on for three seconds of silence, and a view is missed after one.
            time.sleep(find_kind(kind).stops_after + (2.0 if watched else 1.0))
            rests.append(float(robots.snapshot().still_since.max()) - at)
            if watched:
                codes.append(controller.wait(30))
        if (out / "summary.json").exists():
            summary = json.loads((out / "summary.json").read_text())
            log = read_run_log(out / "run.log")
            texts = [each["text"] for each in summary["events"]]
            told += any("gone" in text or "stopped" in text for text in texts) or (
                summary["ended"] == FAILURE and summary["faults"] > 0
            )
            timed += abs(summary["tracking_time"] - running_time(log)) < 0.05 + 1e-9
    ends = f"; the program ends after {np.median(waits):.2f} s, {max(waits):.2f} s" if waits else ""
    print(
        f"\n{kind}, {ending}: {MOMENTS} moments, robots stand after {np.median(rests):.2f} s "
        f"(median), {max(rests):.2f} s (most){ends}, with {sorted(set(codes))}; an event says so "
        f"in {told}, tracking time is that of running ticks in {timed}"
    )
    assert set(codes) == {code}


@pytest.mark.parametrize("kind", CHOSEN)
def test_faults(kind, laboratory, tmp_path):
    scenario, game = laboratory
    scenario = replace(scenario, radio=replace(scenario.radio, kind=kind))
    names = np.random.default_rng(1).permutation(PLAYED_FAULTS * MOMENTS).tolist()
    moments = run_faults(scenario, game, names, log=tmp_path / "run.log", seed=2)
    print()
    for fault in PLAYED_FAULTS:
        limit = LIMIT
        if fault == "radio cut":
            limit = max(LIMIT, find_kind(kind).stops_after + LIMIT_OF_SILENCE)
        found = [moment for moment in moments if moment.fault == fault]
        rest = np.array([moment.rest for moment in found])
        noticed = np.array([moment.noticed for moment in found])
        said = Counter(
            reason.name for moment in found for robot in moment.reasons for reason in robot
        )
        others = Counter(reason.name for moment in found for reason in moment.others)
        held = sum(bool(moment.others) for moment in found)
        silent = sum(not all(moment.reasons) for moment in found)
        print(
            f"{kind}, {fault}: {len(found)} moments, robots stand after {np.median(rest):.2f} s "
            f"(median), {rest.max():.2f} s (most), {noticed.max():.2f} s after it shows, "
            f"{(noticed > limit).sum()} of these over {limit} s; nothing said of a robot in "
            f"{silent}, others held in {held} {dict(others)}; {dict(said)}"
        )
