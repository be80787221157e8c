"""The thesis's laboratory, and a run in its emulation that many tests look at."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from sightfield.diagrams.scenario_files import find_scenario
from sightfield.diagrams.station import scenarios
from sightfield.diagrams.station.hardware import Operator
from sightfield.diagrams.station.laboratory_files import load_station
from sightfield.diagrams.station.run import StationRun, run_station
from sightfield.diagrams.station.session import open_laboratory
from sightfield.diagrams.tracking.game import set_up_game


@pytest.fixture(scope="session")
def load_laboratory():
    """A function of settings: the laboratory of `thesis_3v3` and its game."""

    def load(*settings):
        scenario = load_station(find_scenario("thesis_3v3", scenarios), settings)
        return scenario, set_up_game(scenario.tracking)

    return load


@dataclass
class EmulatedRun:
    """What happened in the emulation.

    Attributes:
        run: How it ended.
        log: Its log.
        moving: Speed of each robot's faster wheel when something was cut, by what it was [m/s].
        rest: How long after that each robot stood still, by what it was [s].
        lag: How far the emulation was behind, at most [s].
    """

    run: StationRun | None = None
    log: Path = Path()
    moving: dict[str, np.ndarray] = field(default_factory=dict)
    rest: dict[str, np.ndarray] = field(default_factory=dict)
    lag: float = 0.0


# When what is cut, and for how long [s].
RADIO, MOCAP, STOP, PAUSE = 4.0, 6.5, 9.0, 0.6


@pytest.fixture(scope="session")
def emulated_run(load_laboratory, require_tool, tmp_path_factory):
    """Six robots on the real firmware: they track, the radio is cut, the motion capture freezes,
    the operator stops them."""
    require_tool("avr-gcc", "gcc-avr avr-libc libsimavr-dev")
    scenario, game = load_laboratory("seconds=30")
    result = EmulatedRun(log=tmp_path_factory.mktemp("emulated") / "run.log")
    operator = Operator()
    cut: dict[str, float] = {}
    with open_laboratory(scenario, game, "emulate", operator) as devices:
        laboratory = devices.laboratory

        def act(what, now, since, do, undo):
            """Cut something at its time, and mend it after the pause."""
            if now >= since and what not in cut:
                result.moving[what] = np.abs(laboratory.wheel_speeds()).max(axis=1)
                cut[what] = laboratory.time()
                do()
            if now >= since + PAUSE and what not in result.rest:
                result.rest[what] = laboratory.snapshot().still_since - cut[what]
                undo()

        def at_tick(now):
            result.lag = max(result.lag, laboratory.snapshot().lag)
            act("radio", now, RADIO, laboratory.cut_radio, laboratory.restore_radio)
            act("mocap", now, MOCAP, devices.poses.freeze, devices.poses.thaw)
            if now >= STOP and "stop" not in cut:
                result.moving["stop"] = np.abs(laboratory.wheel_speeds()).max(axis=1)
                cut["stop"] = laboratory.time()
                operator.say("stop")

        result.run = run_station(
            scenario,
            game,
            devices,
            log=result.log,
            mode="emulate",
            operator=operator,
            at_tick=at_tick,
        )
        while laboratory.time() < cut["stop"] + PAUSE:
            pass
        result.rest["stop"] = laboratory.snapshot().still_since - cut["stop"]
    return result
