"""Each fault once, in emulation: robots that it is about soon stand, and it is said why."""

import pytest

from sightfield.diagrams.station.fault_campaign import FAULTS, run_faults
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.supervision import Reason

# Of these one at least is said; what is wrong with the air shows in several ways.
TOLD = {
    "two bodies swapped": {Reason.JUMP},
    "heading turned by pi": {Reason.FLIP},
    "pose jumps by 1 m": {Reason.JUMP},
    "pose outside the world": {Reason.OUTSIDE},
    "pose stuck": {Reason.NOT_FOLLOWING, Reason.ODOMETRY},
    "motion capture frozen": {Reason.NOT_SEEN},
    "robot reset": {Reason.RESET},
    "encoder dead": {Reason.MOTOR, Reason.ODOMETRY},
    "encoder reversed": {Reason.MOTOR, Reason.ODOMETRY},
    "radio cut": {Reason.SILENT, Reason.DEAF, Reason.NOT_FOLLOWING},
}


@pytest.fixture(scope="module")
def moments(load_laboratory, require_tool, tmp_path_factory):
    """Every fault once, by name."""
    require_tool("avr-gcc", "gcc-avr avr-libc libsimavr-dev")
    scenario, game = load_laboratory()
    log = tmp_path_factory.mktemp("faults") / "run.log"
    return {each.fault: each for each in run_faults(scenario, game, list(FAULTS), log=log)}


@pytest.mark.parametrize("fault", FAULTS)
def test_robots_stand_and_it_is_said_why(moments, fault):
    moment = moments[fault]
    assert len(moment.robots) == (FAULTS[fault].robots or 6)
    # In the benchmark 0.5 s; a busy machine passes too.
    assert moment.rest < 1.0
    assert all(TOLD[fault].intersection(said) for said in moment.reasons), moment


def test_a_fault_that_is_unknown_is_refused(load_laboratory, tmp_path):
    with pytest.raises(InvalidInput, match="fire"):
        run_faults(*load_laboratory(), ["fire"], log=tmp_path / "run.log")
