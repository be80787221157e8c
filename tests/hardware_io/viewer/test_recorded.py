"""What the operator's view is told to draw, and its messages, are as recorded."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.hardware_io.viewer import operator as operator_module
from sightfield.hardware_io.viewer.drawing import Drawing, SceneStore
from sightfield.hardware_io.viewer.messages import (
    Event,
    RobotState,
    Scene,
    State,
    StopReport,
    Word,
    decode,
    decode_word,
    encode,
    encode_word,
    lock_of,
    or_none,
)
from sightfield.hardware_io.viewer.operator import Operator, OperatorPort
from sightfield.hardware_io.viewer.viewer_link import StatePublisher

SCENE = Scene(
    title="three robots",
    mode="simulate",
    boundary=[[0.5, 0], [4, 0], [4.5, 3], [0, 3]],
    obstacles=[[[1, 1], [2, 1], [2, 2], [1, 2]], [[3, 1], [3.5, 1], [3.2, 2]]],
    limits=[[[0.7, 0.2], [3.8, 0.2], [3.8, 2.8], [0.7, 2.8]]],
    pursuers=["pursuer 0", "pursuer 1"],
    evaders=["evader 0"],
    radius=0.12,
)
STATE = State(
    time=1.5,
    operator=1.0,
    poses=[[0.8, 0.5, 0.4], [3.0, 0.6, 1.0], [2.4, 2.5, -2.0]],
    valid=[True, False, True],
    age=[0.01, 0.02, None],
    sight=[[True], [False]],
    assignment=[-1, 0],
    quality=[0.9, None, 0.5],
    battery=[7.4, None, 7.0],
    commands=[[0.3, 1.0], [0.0, 0.0], [0.1, 0.2]],
    robots=[RobotState(name="pursuer 0", state="held", why="it left the floor")],
    events=[Event(time=0.5, robot="evader 0", text="held")],
    stop=StopReport(who="me", when="10:00:00", acknowledgement="none"),
)


class Kept(SceneStore):
    """Keeps what it is told to show."""

    def __init__(self):
        super().__init__()
        self.told = []

    def _send(self, command):
        super()._send(command)
        lowered = command.lower()
        said = [lowered["type"], lowered["path"], lowered.get("property"), lowered.get("value")]
        if "matrix" in lowered:
            said.append([float(each) for each in lowered["matrix"]])
        if "object" in lowered:
            (geometry,), (material,) = (
                lowered["object"][each] for each in ("geometries", "materials")
            )
            data = geometry["data"]
            points = np.frombuffer(data["attributes"]["position"]["array"].data, np.float32)
            faces = np.frombuffer(data["index"]["array"].data, np.uint32)
            said += [points, faces, material["color"], material["type"]]
        self.told.append(said)


def test_a_scene_is_drawn_as_recorded(as_recorded):
    store = Kept()
    drawing = Drawing(store)
    drawing.scene(SCENE)
    as_recorded(store.told, "scene", relative=1e-5, absolute=1e-6)
    store.told.clear()
    drawing.state(SCENE, STATE, stale=False)
    as_recorded(store.told, "state", relative=1e-5, absolute=1e-6)
    store.told.clear()
    # Robots that look as before are only moved; who is not seen any more looks otherwise.
    drawing.state(SCENE, replace(STATE, sight=[[False], [False]]), stale=False)
    drawing.state(SCENE, STATE, stale=True)
    as_recorded([each[:2] for each in store.told], "again")
    drawing.scene(replace(SCENE, obstacles=[]))
    assert store.tree is not None


def test_messages_are_as_recorded(as_recorded):
    for what, name in ((SCENE, "scene"), (STATE, "state"), ("it ended", "end")):
        as_recorded(json.loads(encode("run 7", what)), name)
        found = decode(encode("run 7", what))
        assert found == (name, "run 7", what)
    as_recorded(lock_of("run 7", "key"), "lock")
    word = Word(word="start", run="run 7", key="key")
    assert decode_word(encode_word(word)) == word
    assert word.is_for("run 7", lock_of("run 7", "key"))
    assert not word.is_for("run 8", lock_of("run 8", "key"))
    assert not word.is_for("run 7", lock_of("run 7", "other"))
    assert not word.is_for("run 7", "")
    assert Word(word="stop").is_for("any", "")
    assert (or_none(np.inf), or_none(0.5)) == (None, 0.5)


class Shown:
    """A view that keeps what it is shown."""

    def __init__(self):
        self.states = []

    def show(self, state):
        self.states.append(state)


def test_states_are_published_as_recorded(as_recorded):
    view = Shown()
    publisher = StatePublisher(view, pursuers=2, evaders=1, period=0.1, offset=0.001, looks=2)
    simulator = Simulator(publisher)
    context, rng = simulator.get_mutable_context(), np.random.default_rng(3)
    for tick in range(12):
        for k in range(publisher.num_input_ports()):
            port = publisher.get_input_port(k)
            values = rng.uniform(0, 1.2, port.size())
            if port.get_name() in ("standing", "reason"):
                values = np.floor(values * 4 * (tick % 3 > 0))
            if port.get_name() in ("battery", "quality", "evader_age"):
                values[values > 0.8] = np.inf
            port.FixValue(context, values)
        simulator.AdvanceTo(0.05 * tick + 0.002)
    as_recorded(view.states[:2] + view.states[-1:], "states")
    assert len(view.states) == 6


def test_an_operator_hears_and_says_as_recorded(as_recorded, monkeypatch):
    monkeypatch.setattr(operator_module, "time", SimpleNamespace(strftime=lambda words: "10:20:30"))
    said, modes = [], []
    operator = Operator(running=False)
    operator.on_word(lambda word, who: said.append((word, who)))
    operator.on_stop(lambda: (3, 8))
    operator.on_stop(list)
    operator.on_stop(lambda: None)
    operator.on_stop(lambda: 1 / 0)
    for word in ("pause", "start", "start", "dance", "toggle", "toggle", "stop", "start", "stop"):
        operator.toggle("me") if word == "toggle" else operator.say(word, "you")
        modes.append((operator.mode, operator.starts_said))
    as_recorded([said, modes, vars(operator.stopped)])
    port = OperatorPort(operator, period=0.1)
    operator.watch_view(lambda: 0.7)
    simulator = Simulator(port)
    simulator.AdvanceTo(0.01)
    context = simulator.get_context()
    found = [
        port.GetOutputPort(each).Eval(context)[0] for each in ("mode", "starts_said", "view_age")
    ]
    assert found == [-1.0, 3.0, 0.7]


@pytest.mark.parametrize("running", [True, False])
def test_an_operator_begins_as_it_is_told(running):
    assert Operator(running=running).mode == (1.0 if running else 0.0)
    assert Operator().mode == 1.0
    assert Operator().view_age == 0.0
