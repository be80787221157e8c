"""What the operator says is done, and a stop stays."""

import io
import os
import pty
import threading

import pytest
from pydrake.systems.analysis import Simulator

from sightfield.hardware_io.viewer.messages import Scene, State, decode, encode, or_none
from sightfield.hardware_io.viewer.operator import Operator, OperatorPort, keys
from sightfield.systems.station.gates import PAUSED, RUNNING, STOPPED


def test_a_run_can_be_paused_and_go_on():
    operator = Operator(running=False)
    modes = [operator.mode]
    for word in ("start", "pause", "nonsense", "start"):
        operator.say(word)
        modes.append(operator.mode)
    assert modes == [PAUSED, RUNNING, PAUSED, PAUSED, RUNNING]


def test_the_pause_key_does_both():
    operator = Operator()
    operator.toggle()
    assert operator.mode == PAUSED
    operator.toggle()
    assert operator.mode == RUNNING


def test_nothing_undoes_a_stop():
    operator = Operator()
    for word in ("stop", "start", "pause"):
        operator.say(word)
        assert operator.mode == STOPPED
    operator.toggle()
    assert operator.mode == STOPPED


def test_a_stop_is_done_at_once_and_once_whatever_else_fails():
    operator, done = Operator(), []

    def fail():
        done.append("failed")
        raise OSError("the radio is gone")

    operator.on_stop(fail)
    # The gate is closed before anything slow is done.
    operator.on_stop(lambda: done.append(operator.mode))
    for _ in range(3):
        operator.say("stop")
    assert done == ["failed", STOPPED]


def test_a_port_says_what_the_operator_wants():
    operator = Operator()
    port = OperatorPort(operator, period=0.1)
    simulator, said = Simulator(port), []
    for k, word in enumerate(("start", "pause", "stop", "start")):
        operator.say(word)
        simulator.AdvanceTo(0.1 * k + 0.05)
        said.append(port.GetOutputPort("mode").Eval(simulator.get_context())[0])
    assert said == [1, 0, -1, -1]
    # After a stop nobody starts.
    assert port.GetOutputPort("starts_said").Eval(simulator.get_context()) == 1
    assert port.GetOutputPort("view_age").Eval(simulator.get_context()) == 0
    operator.watch_view(lambda: 0.7)
    simulator.AdvanceTo(0.45)
    assert port.GetOutputPort("view_age").Eval(simulator.get_context()) == 0.7


@pytest.fixture
def terminal():
    """Descriptors of a terminal: where keys are pressed, and where they are read."""
    ours, theirs = pty.openpty()
    yield ours, theirs
    os.close(ours)
    os.close(theirs)


def test_keys_in_a_terminal_are_heard_one_by_one(terminal):
    ours, theirs = terminal
    heard, all_heard = [], threading.Event()

    def stop():
        heard.append("stop")
        all_heard.set()

    with keys({" ": stop, "p": lambda: heard.append("pause")}, terminal=theirs) as attended:
        assert attended
        # No newline: keys come at once. An x stands for nothing.
        os.write(ours, b"xp ")
        assert all_heard.wait(5)
    assert heard == ["pause", "stop"]


def test_without_a_terminal_there_are_no_keys():
    read, write = os.pipe()
    with keys({" ": lambda: None}, terminal=read) as attended:
        assert not attended
    os.close(read)
    os.close(write)


def test_where_no_terminal_is_named_it_is_standard_input(terminal, monkeypatch):
    ours, theirs = terminal
    heard = threading.Event()
    with open(theirs, "rb", buffering=0, closefd=False) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with keys({"s": heard.set}) as attended:
            assert attended
            os.write(ours, b"s")
            assert heard.wait(5)


@pytest.mark.parametrize("stdin", [None, io.StringIO("s")], ids=["service", "replaced"])
def test_without_a_standard_input_there_are_no_keys(stdin, monkeypatch):
    monkeypatch.setattr("sys.stdin", stdin)
    with keys({"s": lambda: None}) as attended:
        assert not attended


SCENE = Scene(
    title="t",
    mode="simulate",
    boundary=[[0, 0], [1, 0], [1, 1]],
    obstacles=[],
    limits=[],
    pursuers=["p"],
    evaders=["e"],
    radius=0.1,
)
STATE = State(
    time=1.0,
    operator=1.0,
    poses=[[0, 0, 0], [1, 1, 1]],
    valid=[True, False],
    age=[0.01, None],
    sight=[[True]],
    assignment=[0],
    quality=[1.0, None],
    battery=[None, 7.4],
    commands=[[0, 0], [0, 0]],
)


@pytest.mark.parametrize(("what", "kind"), [(SCENE, "scene"), (STATE, "state"), ("over", "end")])
def test_messages_come_out_as_they_went_in(what, kind):
    assert decode(encode("a run", what)) == (kind, "a run", what)


@pytest.mark.parametrize(
    "data",
    [b"", b"\xff", b"7", b"[]", b"{}", b'{"kind": "state", "run": "r"}', b'{"kind": 1, "run": 2}'],
)
def test_what_is_no_message_is_none(data):
    assert decode(data) is None


def test_what_is_not_known_is_nothing_in_json():
    assert [or_none(each) for each in (1.5, float("inf"), float("nan"))] == [1.5, None, None]
