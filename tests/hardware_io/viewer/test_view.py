"""The operator's view: a process of its own that outlives controllers, and whose buttons work."""

import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from dataclasses import asdict

import pytest

from sightfield.hardware_io.viewer.messages import Scene, State
from sightfield.hardware_io.viewer.operator import Operator
from sightfield.hardware_io.viewer.view_address import find_view, open_view
from sightfield.hardware_io.viewer.viewer_link import ViewerLink
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.station.gates import PAUSED, RUNNING, STOPPED

SCENE = Scene(
    title="two robots",
    mode="simulate",
    boundary=[[0, 0], [4, 0], [4, 4], [0, 4]],
    obstacles=[[[1, 1], [2, 1], [2, 2], [1, 2]]],
    limits=[[[0.2, 0.2], [3.8, 0.2], [3.8, 3.8], [0.2, 3.8]]],
    pursuers=["pursuer 0"],
    evaders=["evader 0"],
    radius=0.12,
)
STATE = State(
    time=1.5,
    operator=1.0,
    poses=[[0.5, 0.5, 0.0], [3.0, 0.5, 1.0]],
    valid=[True, True],
    age=[0.01, 0.02],
    sight=[[True]],
    assignment=[0],
    quality=[0.9, None],
    battery=[7.4, None],
    commands=[[0.3, 1.0], [0.0, 0.0]],
)

# A controller that shows a state until it is killed.
CONTROLLER = """
import json, sys, time
from sightfield.hardware_io.viewer.messages import Scene, State
from sightfield.hardware_io.viewer.operator import Operator
from sightfield.hardware_io.viewer.viewer_link import ViewerLink
states, words, scene, state = sys.argv[1:]
link = ViewerLink(states, words, Scene(**json.loads(scene)), Operator())
while True:
    link.show(State(**json.loads(state)))
    time.sleep(0.05)
"""


@pytest.fixture(scope="module")
def view():
    """A view that is up."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    opened = open_view(port)
    yield opened
    with contextlib.suppress(ProcessLookupError):
        os.kill(opened.pid, signal.SIGTERM)


def report(view):
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    with opener.open(f"{view.url}state") as answer:
        return json.loads(answer.read())


def wait_for(condition, patience=10.0):
    """Until it holds; whether it does."""
    deadline = time.monotonic() + patience
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


def say(view, word, key="", **headers):
    headers["X-Sightfield-Key"] = key
    request = urllib.request.Request(f"{view.url}say/{word}", method="POST", headers=headers)
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    opener.open(request).close()


def test_a_view_that_is_open_is_found_and_used_again(view):
    port = int(view.url.rsplit(":", 1)[1].strip("/"))
    assert open_view(port) == view
    assert find_view(port) == view


def test_where_nothing_listens_there_is_no_view():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    assert find_view(port) is None


def test_a_port_that_something_else_has_is_refused():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        # It answers the look for a view with nonsense.
        taker = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "import socket, sys\n"
                "server = socket.socket(fileno=int(sys.argv[1]))\n"
                "client, _ = server.accept()\n"
                "client.recv(4096)\n"
                "client.sendall(b'HTTP/1.0 200 OK\\r\\n\\r\\nhello')\n"
                "client.close()\n",
                str(other.fileno()),
            ],
            pass_fds=[other.fileno()],
        )
        with pytest.raises(InvalidInput, match=f"`--port` must be free, .*; got {port}"):
            open_view(port)
        taker.wait(10)


@pytest.mark.parametrize("port", [0, 80, 70000])
def test_a_port_out_of_range_is_refused(port):
    with pytest.raises(InvalidInput, match="`--port` must be from 1024 to 65535"):
        open_view(port)


def test_the_words_of_the_page_reach_the_operator(view):
    operator = Operator()

    def tell(link, word):
        link.show(STATE)
        # Until the view has heard of the run, it lets nobody steer it.
        with contextlib.suppress(urllib.error.HTTPError):
            say(view, word, link.key)

    with ViewerLink(view.states, view.words, SCENE, operator) as link:
        for word, mode in (("pause", PAUSED), ("start", RUNNING), ("stop", STOPPED)):
            # A line that was opened just now misses what is said before it stands.
            assert wait_for(lambda word=word, mode=mode: tell(link, word) or operator.mode == mode)


@pytest.mark.parametrize(("word", "origin"), [("dance", ""), ("start", "http://elsewhere.example")])
def test_other_words_and_other_pages_are_refused(view, word, origin):
    with pytest.raises(urllib.error.HTTPError, match="403"):
        say(view, word, **({"Origin": origin} if origin else {}))


def test_a_controller_knows_for_how_long_its_view_has_been_gone(view):
    operator = Operator()
    assert operator.view_age == 0
    with ViewerLink(view.states, view.words, SCENE, operator):
        time.sleep(1.0)
        assert operator.view_age < 0.7
        os.kill(view.pid, signal.SIGSTOP)
        try:
            time.sleep(1.2)
            assert operator.view_age > 0.9
        finally:
            os.kill(view.pid, signal.SIGCONT)
    # Who shows nothing misses nothing.
    assert operator.view_age == 0


def test_a_state_that_is_not_repeated_is_stale(view):
    with ViewerLink(view.states, view.words, SCENE, Operator()) as link:
        assert wait_for(lambda: link.show(STATE) or report(view)["stale"] is False)
        assert report(view)["state"] == asdict(STATE)
        assert wait_for(lambda: report(view)["stale"])
        assert report(view)["silence"] >= 1.0


def test_the_end_of_a_run_is_told(view):
    with ViewerLink(view.states, view.words, SCENE, Operator()) as link:
        assert wait_for(lambda: link.show(STATE) or report(view)["stale"] is False)
        link.end("the horizon")
    assert wait_for(lambda: report(view)["ended"] == "the horizon")
    assert report(view)["stale"]


@pytest.mark.browser
def test_the_view_survives_its_controller_and_says_so_on_the_page(view, new_page):
    watched = new_page()
    page = watched.page
    page.goto(view.url)
    arguments = [view.states, view.words, json.dumps(asdict(SCENE)), json.dumps(asdict(STATE))]
    controller = subprocess.Popen([sys.executable, "-c", CONTROLLER, *arguments])
    try:
        page.wait_for_function("document.querySelector('#status').className === 'running'")
        assert page.inner_text("h1") == "two robots (simulate)"
        assert page.locator("#robots tr").count() == 2
        # Both nodes, the line of sight and the chase.
        assert page.locator("#graph circle").count() == 2
        assert page.locator("#graph line").count() == 2
        place = "['laboratory', 'robots', '1']"
        page.wait_for_function(f"viewer.scene_tree.find({place}).object.position.x === 3")
    finally:
        controller.kill()
        controller.wait()
    page.wait_for_function("document.body.classList.contains('old')")
    assert "STALE: the controller is silent" in page.inner_text("#status")
    assert "last known state, at 1.5 s" in page.inner_text("#veil")
    assert page.is_disabled("#start")
    # The last that is known is shown on, in grey, to whoever looks now for the first time.
    colour = "viewer.scene_tree.find(['laboratory', 'robots', '1', 'body'])"
    page.reload()
    page.wait_for_function(f"{colour}.object.children[0]?.material.color.getHex() === 0x9aa1ab")
    assert page.locator("#robots tr").count() == 2
    assert [each for each in watched.complaints if "WebSocket" not in each] == []


@pytest.mark.browser
def test_the_space_bar_on_the_page_is_an_emergency_stop(view, new_page):
    page = new_page().page
    page.goto(view.url)
    operator = Operator()
    with ViewerLink(view.states, view.words, SCENE, operator) as link:
        assert wait_for(lambda: link.show(STATE) or report(view)["stale"] is False)

        def pressed():
            page.keyboard.press("Space")
            return operator.mode == STOPPED

        assert wait_for(pressed)
