"""Faults in the emulated laboratory: how soon robots stand, and what is said of them.

Runs in the time of the wall, a few seconds a fault, and is to run alone. As many moments of each
fault as MOMENTS says: `MOMENTS=30 make bench ARGS="-k faults"`; `KIND=udp` plays with robots of
that kind.
"""

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
from sightfield.diagrams.station.station_files import load_station
from sightfield.diagrams.tracking.game import set_up_game
from sightfield.hardware_io.emulation.laboratory import EmulatedLaboratory
from sightfield.hardware_io.mocap.lcm_message import PosesMessage, encode

pytestmark = pytest.mark.benchmarks

MOMENTS = int(os.environ.get("MOMENTS", "5"))
# Of the robots in `test_faults`.
KIND = os.environ.get("KIND", "xbee")
# Of an emulation that keeps up with the wall all the time [s].
LIMIT = 0.5


# What ends a controller that drives real devices; each is done to it and its laboratory.
ENDINGS = {
    "SIGKILL": lambda controller, laboratory: controller.send_signal(signal.SIGKILL),
    "SIGHUP": lambda controller, laboratory: controller.send_signal(signal.SIGHUP),
    "SIGTERM": lambda controller, laboratory: controller.send_signal(signal.SIGTERM),
    "Ctrl-C": lambda controller, laboratory: controller.send_signal(signal.SIGINT),
    "serial line stalled": lambda controller, laboratory: laboratory.stall_line(),
}
# Poses go out on a network of their own.
NETWORK = "udpm://239.255.76.67:7681?ttl=0"


@pytest.fixture
def laboratory():
    """The thesis's laboratory, its scenario and its game."""
    scenario = load_station(find_scenario("thesis_3v3", scenarios), ())
    return scenario, set_up_game(scenario.tracking)


@contextmanager
def emulated(scenario, game):
    """The laboratory's robots behind a serial port, and their poses on the network."""
    starts = np.concatenate([game.pursuer_starts, game.evader_starts])
    air = scenario.emulation
    with EmulatedLaboratory(
        scenario.robots, starts, frame_loss=air.frame_loss, delay=air.delay, world=game.world
    ) as robots:
        lcm, ended = DrakeLcm(NETWORK), threading.Event()

        def tell():
            seen = (True,) * scenario.size
            while not ended.wait(0.01):
                poses = tuple(tuple(map(float, pose)) for pose in robots.poses())
                message = PosesMessage(time.time_ns() // 1000, tuple(scenario.bodies), poses, seen)
                lcm.Publish("poses", encode(message))

        thread = threading.Thread(target=tell, daemon=True)
        thread.start()
        yield robots
        ended.set()
        thread.join()


@pytest.mark.parametrize("ending", ENDINGS)
def test_endings(ending, laboratory, tmp_path):
    scenario, game = laboratory
    rng, rests, waits, codes = np.random.default_rng(3), [], [], []
    for number in range(MOMENTS):
        with emulated(scenario, game) as robots:
            settings = (
                f"radio.port={robots.radio_port}",
                "mocap.source=lcm",
                f"mocap.url={NETWORK}",
                "mocap.channel=poses",
            )
            command = [Path(sys.executable).with_name("sightfield"), "station", "run", "--hardware"]
            command += ["--go", "--no-view", "--seconds", "60", "--out", tmp_path / str(number)]
            for setting in settings:
                command += ["--set", setting]
            controller = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
            )
            while np.abs(robots.wheel_speeds()).max() < 0.1:
                assert controller.poll() is None, controller.stdout.read().decode()
                time.sleep(0.01)
            time.sleep(rng.uniform(0.5, 3.0))
            at = robots.time()
            ENDINGS[ending](controller, robots)
            began = time.monotonic()
            codes.append(controller.wait(30))
            waits.append(time.monotonic() - began)
            time.sleep(1.0)
            rests.append(float(robots.snapshot().still_since.max()) - at)
    print(
        f"\n{ending}: {MOMENTS} moments, robots stand after {np.median(rests):.2f} s (median), "
        f"{max(rests):.2f} s (most); the program ends after {np.median(waits):.2f} s, "
        f"{max(waits):.2f} s, with {sorted(set(codes))}"
    )


def test_faults(laboratory, tmp_path):
    scenario, game = laboratory
    scenario = replace(scenario, radio=replace(scenario.radio, kind=KIND))
    names = np.random.default_rng(1).permutation(list(FAULTS) * MOMENTS).tolist()
    moments = run_faults(scenario, game, names, log=tmp_path / "run.log", seed=2)
    print()
    for fault in FAULTS:
        found = [moment for moment in moments if moment.fault == fault]
        rest = np.array([moment.rest for moment in found])
        said = Counter(
            reason.name for moment in found for robot in moment.reasons for reason in robot
        )
        others = sum(bool(moment.others) for moment in found)
        silent = sum(not all(moment.reasons) for moment in found)
        print(
            f"{fault}: {len(found)} moments, robots stand after {np.median(rest):.2f} s (median), "
            f"{rest.max():.2f} s (most), {(rest > LIMIT).sum()} over {LIMIT} s; nothing said of a "
            f"robot in {silent}, others held in {others}; {dict(said)}"
        )
