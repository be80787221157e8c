"""What the viewer makes of what it hears, by a clock that a test sets; who may say what."""

import os
from dataclasses import replace
from types import SimpleNamespace

import pytest

from sightfield.hardware_io.viewer import server, view_address, viewer_link
from sightfield.hardware_io.viewer.messages import (
    Event,
    Scene,
    State,
    StopReport,
    Word,
    decode,
    decode_word,
    encode,
    encode_word,
    lock_of,
)
from sightfield.hardware_io.viewer.operator import Operator
from sightfield.hardware_io.viewer.server import ViewServer
from sightfield.hardware_io.viewer.view_address import endpoints, is_host, is_origin
from sightfield.hardware_io.viewer.viewer_link import ViewerLink

SCENE = Scene(
    title="one robot",
    mode="simulate",
    boundary=[[0, 0], [4, 0], [4, 3]],
    obstacles=[],
    limits=[],
    pursuers=["pursuer 0"],
    evaders=[],
    radius=0.12,
    lock=lock_of("a", "key"),
)
STATE = State(
    time=1.5,
    operator=1.0,
    poses=[[0.8, 0.5, 0.4]],
    valid=[True],
    age=[0.01],
    sight=[[]],
    assignment=[-1],
    quality=[0.9],
    battery=[7.4],
    commands=[[0.3, 1.0]],
)


@pytest.fixture
def view(monkeypatch):
    """A server without sockets, whose drawing and words are kept."""
    clock = SimpleNamespace(now=50.0)
    monkeypatch.setattr(server, "time", SimpleNamespace(monotonic=lambda: clock.now))
    made = ViewServer.__new__(ViewServer)
    made._scene = made._state = None
    made._run = made._ended = ""
    made._heard, made._drawn_stale, made._others = 0.0, False, {}
    made.drawn, made.said, made.clock = [], [], clock
    made._drawing = SimpleNamespace(
        scene=lambda scene: made.drawn.append(scene.title),
        state=lambda scene, state, *, stale: made.drawn.append((state.time, stale)),
    )
    made._publisher = SimpleNamespace(send=made.said.append)
    return made


def test_a_run_is_drawn_and_grows_stale_after_a_second(view):
    view.hear(b"noise")
    view.hear(encode("a", STATE))
    assert view.drawn == []
    assert view.report()["silence"] is None
    for _ in range(2):
        view.hear(encode("a", SCENE))
    view.hear(encode("a", STATE))
    assert view.drawn == ["one robot", (1.5, False)]
    view.clock.now += 1.0
    view._look()
    assert (view.stale, view.report()["silence"]) == (False, 1.0)
    view.clock.now += 0.001
    view._look()
    view._look()
    assert view.drawn[2:] == [(1.5, True)]
    assert view.said == [b"present"] * 3
    view.hear(encode("a", replace(STATE, time=2.0)))
    view.hear(encode("a", "the horizon"))
    assert view.drawn[3:] == [(2.0, False), (2.0, True)]
    report = view.report()
    assert (report["ended"], report["stale"], report["run"]) == ("the horizon", True, "a")
    assert (report["pid"], report["user"]) == (os.getpid(), os.getuid())
    view.hear(encode("a", replace(SCENE, title="again")))
    assert (view.drawn[-1], view.report()["state"], view.report()["ended"]) == ("again", None, "")


def test_another_run_is_named_while_the_first_goes_on_and_shown_when_that_is_stale(view):
    view.hear(encode("a", SCENE))
    view.hear(encode("a", STATE))
    other = replace(SCENE, title="the other")
    view.hear(encode("b", other))
    view.hear(encode("b", STATE))
    assert view.report()["others"] == ["the other"]
    view.clock.now += 0.999
    assert view.report()["others"] == ["the other"]
    view.hear(encode("a", STATE))
    view.clock.now += 0.001
    assert view.report()["others"] == []
    view.hear(encode("b", other))
    view.hear(encode("b", "it ended"))
    assert view.report()["others"] == []
    assert view.report()["run"] == "a"
    view.clock.now += 1.001
    view.hear(encode("b", other))
    assert view.report()["run"] == "b"


def test_the_run_s_own_page_steers_and_anybody_stops(view):
    assert not view.steers("key")
    assert view.say("stop", "")
    view.hear(encode("a", SCENE))
    assert view.steers("key")
    assert view.report("key")["steers"] is True
    assert view.say("start", "key")
    assert not view.say("pause", "other")
    words = [decode_word(each) for each in view.said]
    assert words == [
        Word(word="stop", run="", key=""),
        Word(word="start", run="a", key="key"),
    ]


def test_pages_of_this_machine_alone_are_answered():
    assert is_host("127.0.0.1:7010", 7010)
    assert is_host("localhost:7010", 7010)
    for host in (None, "127.0.0.1", "127.0.0.1:7011", "elsewhere:7010", "localhost:70100"):
        assert not is_host(host, 7010)
    for origin in (None, "", "http://127.0.0.1:7010", "http://localhost:8"):
        assert is_origin(origin, (7010, 8))
    for origin in ("http://127.0.0.1:9", "https://localhost:8", "null"):
        assert not is_origin(origin, (7010, 8))


def test_the_folder_of_sockets_is_one_s_own_alone(tmp_path, monkeypatch):
    temporary = SimpleNamespace(gettempdir=lambda: str(tmp_path))
    monkeypatch.setattr(view_address, "tempfile", temporary)
    folder = tmp_path / f"sightfield-{os.getuid()}"
    found = endpoints(7010)
    assert found == (f"ipc://{folder}/7010.states", f"ipc://{folder}/7010.words")
    assert folder.stat().st_mode & 0o777 == 0o700
    for mode in (0o710, 0o701, 0o770):
        folder.chmod(mode)
        with pytest.raises(ValueError, match="be yours alone"):
            endpoints(7010)
    folder.chmod(0o700)
    assert endpoints(7011).words.endswith("7011.words")


@pytest.fixture
def link(monkeypatch):
    """A controller's end without sockets; what it sends is kept."""
    clock = SimpleNamespace(now=20.0)
    monkeypatch.setattr(viewer_link, "time", SimpleNamespace(monotonic=lambda: clock.now))
    made = ViewerLink.__new__(ViewerLink)
    made._run, made._scene, made._operator = "a", SCENE, Operator()
    made._state, made._over, made._scene_due = None, False, 0.0
    made._words_said = viewer_link.deque(maxlen=50)
    made._ended = SimpleNamespace(is_set=lambda: False)
    made.sent, made.clock = [], clock
    made._send = lambda data: made.sent.append(decode(data))
    return made


def test_a_scene_goes_out_twice_a_second_and_a_state_always(link):
    kinds = []
    for moment in (0.0, 0.1, 0.499, 0.5, 0.9, 1.0):
        link.clock.now = 20.0 + moment
        link.sent.clear()
        link.show(STATE)
        kinds.append([each[0] for each in link.sent])
    both = ["scene", "state"]
    assert kinds == [both, ["state"], ["state"], both, ["state"], both]


def test_words_become_events_in_their_order_and_a_stop_goes_out_at_once(link):
    link._tell("start", "me")
    link.show(replace(STATE, events=[Event(time=0.5, robot="r", text="held")]))
    link._tell("pause", "you")
    assert len(link.sent) == 2
    link._operator.stopped = None
    link._tell("stop", "you")
    _, run, state = link.sent[-1]
    assert (run, state.operator, state.time) == ("a", -1.0, 1.5)
    assert [(each.time, each.text) for each in state.events] == [
        (0.0, "start, said by me"),
        (0.5, "held"),
        (1.5, "pause, said by you"),
        (1.5, "stop, said by you"),
    ]
    link._operator.say("stop", "them")
    told = link._with_words(STATE).stop
    assert isinstance(told, StopReport)
    assert told.who == "them"
    many = [Event(time=float(k), text=str(k)) for k in range(60)]
    shown = link._with_words(replace(STATE, events=many)).events
    assert (len(shown), shown[-1].text) == (50, "59")
    link.end("the horizon")
    assert link.sent[-1] == ("end", "a", "the horizon")
    assert link._over


def test_words_that_are_for_this_run_are_said_to_the_operator(link):
    said = []
    link._operator = SimpleNamespace(say=lambda *words: said.append(words))
    coming = [
        b"noise",
        encode_word(Word(word="start", run="a", key="key")),
        encode_word(Word(word="pause", run="a", key="other")),
        encode_word(Word(word="pause", run="b", key="key")),
        encode_word(Word(word="stop", who="somebody")),
    ]
    closed, looks = [], iter([True, False, True, True, True, True])

    def poll(patience):
        assert patience == 50
        link.clock.now += 1.0
        return next(looks)

    link._words = SimpleNamespace(
        poll=poll, recv=lambda: coming.pop(0), close=lambda: closed.append(True)
    )
    link._ended = SimpleNamespace(is_set=lambda: not coming)
    link._listen()
    assert said == [("start", "the operator's view"), ("stop", "somebody")]
    assert link._heard == 26.0
    assert closed == [True]
