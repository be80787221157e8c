"""The thesis's laboratory, and a run in its emulation that many tests look at."""

from dataclasses import dataclass, field, replace
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
from sightfield.hardware_io.kinds.udp_board import UdpBoard
from sightfield.hardware_io.links.robot_link import RobotState


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


class Runaway(UdpBoard):
    """Goes on in silence, and tells nobody."""

    def targets(self, now):
        self._last.time = self._commanded = now if self._commanded > 0 else self._commanded
        return super().targets(now)


class Forgetful(UdpBoard):
    """Takes any number for a newer one."""

    def take(self, payload, now):
        self._last.sequence = 0
        super().take(payload, now)


class Timeless(UdpBoard):
    """Does not look at deadlines."""

    def _is_in_time(self, order, now):
        return True


class Stubborn(UdpBoard):
    """Says that it has stopped, and drives on."""

    def targets(self, now):
        return self._targets if self.state == RobotState.STOPPED else super().targets(now)


class Mute(UdpBoard):
    """Reports nothing."""

    def reports(self, now, sensed):
        return []


class Reversed(UdpBoard):
    """Counts backwards."""

    def reports(self, now, sensed):
        left, right = sensed.counts
        return super().reports(now, replace(sensed, counts=(-left, -right)))


class Lame(UdpBoard):
    """Hardly turns its wheels."""

    def targets(self, now):
        found = super().targets(now)
        return found and (0.2 * found[0], 0.2 * found[1])


class Eager(UdpBoard):
    """Is armed from the beginning."""

    def __init__(self, *words, **options):
        super().__init__(*words, **options)
        self.state = RobotState.IDLE


@pytest.fixture
def ill_board():
    """A function of a name: the board of a robot that does not do what its kind has to."""
    boards = (Runaway, Forgetful, Timeless, Stubborn, Mute, Reversed, Lame, Eager)
    return {each.__name__: each for each in boards}.__getitem__
