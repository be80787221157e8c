"""Who may steer by the operator's view: the run's own page, and nobody else; anybody may stop."""

import contextlib
import http.client
import json
import os
import signal
import socket
import stat
import time
from pathlib import Path

import numpy as np
import pytest

from sightfield.hardware_io.viewer.messages import (
    Event,
    RobotState,
    Scene,
    State,
    Word,
    decode,
    decode_word,
    encode,
    encode_word,
    lock_of,
)
from sightfield.hardware_io.viewer.operator import Operator, StopPage
from sightfield.hardware_io.viewer.view_address import endpoints, open_view
from sightfield.hardware_io.viewer.viewer_link import ViewerLink
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.station.gates import PAUSED, RUNNING, STOPPED

SCENE = Scene(
    title="two robots",
    mode="simulate",
    boundary=[[0, 0], [4, 0], [4, 4], [0, 4]],
    obstacles=[],
    limits=[],
    pursuers=["pursuer 0"],
    evaders=["evader 0"],
    radius=0.12,
)
STATE = State(
    time=1.5,
    operator=0.0,
    poses=[[0.5, 0.5, 0.0], [3.0, 0.5, 1.0]],
    valid=[True, True],
    age=[0.01, 0.02],
    sight=[[True]],
    assignment=[0],
    quality=[0.9, None],
    battery=[7.4, None],
    commands=[[0.3, 1.0], [0.0, 0.0]],
    robots=[
        RobotState(name="pursuer 0", state="running"),
        RobotState(name="evader 0", state="held", why="battery low"),
    ],
    events=[Event(time=1.2, robot="evader 0", text="held: battery low")],
)


def free_port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def close(view):
    with contextlib.suppress(ProcessLookupError):
        os.kill(view.pid, signal.SIGKILL)


@pytest.fixture
def view():
    """A view that is up."""
    opened = open_view(free_port())
    yield opened
    close(opened)


def port_of(url):
    return int(url.split(":")[2].split("/")[0])


def ask(url, method="GET", path="/", **headers):
    """Status, headers and body of an answer."""
    line = http.client.HTTPConnection("127.0.0.1", port_of(url), timeout=10)
    with contextlib.closing(line):
        line.request(method, path, headers={k.replace("_", "-"): v for k, v in headers.items()})
        answer = line.getresponse()
        return answer.status, dict(answer.getheaders()), answer.read()


def report(view, key=""):
    return json.loads(ask(view.url, path="/state", X_Sightfield_Key=key)[2])


def wait_for(condition, patience=10.0):
    deadline = time.monotonic() + patience
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


def shown(view, link):
    """Whether a run is the one that the view shows."""
    link.show(STATE)
    return report(view, link.key)["steers"]


@pytest.mark.parametrize("path", ["/", "/state", "/meshcat/main.min.js", "/scene", "/nothing"])
def test_a_name_of_another_site_for_this_machine_is_refused(view, path):
    port = port_of(view.url)
    for host in ("evil.example", f"evil.example:{port}", "127.0.0.1", f"127.0.0.1:{port}.evil"):
        assert ask(view.url, path=path, Host=host)[0] == 403
    assert ask(view.url, "POST", "/say/stop", Host=f"evil.example:{port}")[0] == 403


@pytest.mark.parametrize("path", ["/", "/state", "/meshcat/main.min.js", "/say/dance"])
def test_no_page_may_frame_the_view(view, path):
    _, headers, _ = ask(view.url, path=path)
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert headers["X-Frame-Options"] == "DENY"


def test_another_page_says_nothing_not_even_stop(view):
    for origin in ("http://evil.example", "null", f"http://127.0.0.1:{port_of(view.url) + 1}"):
        for path in ("/say/stop", "/say/start"):
            assert ask(view.url, "POST", path, Origin=origin)[0] == 403
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec_WebSocket_Version": "13"}
    key = {"Sec_WebSocket_Key": "dGhlIHNhbXBsZSBub25jZQ=="}
    assert ask(view.url, path="/scene", Origin="http://evil.example", **upgrade, **key)[0] == 403


def test_without_the_runs_key_a_page_stops_and_does_not_start(view):
    operator = Operator(running=False)
    with ViewerLink(view.states, view.words, SCENE, operator) as link:
        assert wait_for(lambda: shown(view, link))
        for key in ("", "guess", link.key[:-1]):
            assert ask(view.url, "POST", "/say/start", X_Sightfield_Key=key)[0] == 403
            assert not report(view, key)["steers"]
        assert operator.mode == PAUSED
        assert ask(view.url, "POST", "/say/stop")[0] == 200
        assert wait_for(lambda: operator.mode == STOPPED)


def test_of_two_runs_on_one_view_a_press_starts_one_and_a_stop_stops_both(view):
    first, second = Operator(running=False), Operator(running=False)
    with (
        ViewerLink(view.states, view.words, SCENE, first) as one,
        ViewerLink(view.states, view.words, SCENE, second) as two,
    ):
        assert wait_for(lambda: shown(view, one))

        def told():
            one.show(STATE)
            two.show(STATE)
            return report(view)["others"] == ["two robots"]

        assert wait_for(told)
        if report(view, two.key)["steers"]:
            # Where a busy machine lets the first run be silent for long, the second one is shown.
            one, two, first, second = two, one, second, first
        assert report(view, one.key)["steers"]
        assert not report(view, two.key)["steers"]
        ask(view.url, "POST", "/say/start", X_Sightfield_Key=two.key)

        def started():
            one.show(STATE)
            ask(view.url, "POST", "/say/start", X_Sightfield_Key=one.key)
            return first.mode == RUNNING

        assert wait_for(started)
        assert second.mode == PAUSED
        ask(view.url, "POST", "/say/stop")
        assert wait_for(lambda: first.mode == second.mode == STOPPED)


def test_a_view_that_was_killed_and_opened_again_is_in_control(view):
    operator = Operator(running=False)
    with ViewerLink(view.states, view.words, SCENE, operator) as link:
        assert wait_for(lambda: shown(view, link))
        close(view)
        again = open_view(port_of(view.url))
        try:
            assert again.pid != view.pid
            assert wait_for(lambda: shown(again, link))

            def started():
                ask(again.url, "POST", "/say/start", X_Sightfield_Key=link.key)
                return operator.mode == RUNNING

            assert wait_for(started)
        finally:
            close(again)


def test_a_stop_says_who_asked_and_who_acknowledged_it(view):
    operator = Operator()
    operator.on_stop(lambda: (1, 3))
    with ViewerLink(view.states, view.words, SCENE, operator) as link:
        assert wait_for(lambda: shown(view, link))
        operator.say("stop", "the terminal")
        assert wait_for(lambda: report(view)["state"]["stop"] is not None)
        stop = report(view)["state"]["stop"]
        assert stop["who"] == "the terminal"
        assert stop["acknowledgement"].endswith("Robots that acknowledged it: 1, 3.")
        time.strptime(stop["when"], "%H:%M:%S")
        assert report(view)["state"]["events"][-1]["text"] == "stop, said by the terminal"
        # What is shown last of a run that was stopped is that it was.
        assert report(view)["state"]["operator"] == -1


def test_a_stop_of_which_a_robot_cannot_be_told_says_so():
    operator = Operator()

    def fail():
        raise OSError("the radio is gone")

    operator.on_stop(fail)
    operator.say("stop", "the terminal")
    assert operator.stopped is not None
    assert "could not be told: the radio is gone" in operator.stopped.acknowledgement


def test_the_controllers_own_page_stops_without_any_view():
    operator, view_port = Operator(), free_port()
    with StopPage(operator, "a <game>", view_port) as page:
        status, headers, body = ask(page.url)
        assert status == 200
        assert b"a &lt;game&gt;" in body
        assert headers["X-Frame-Options"] == "DENY"
        port = port_of(page.url)
        assert ask(page.url, Host=f"evil.example:{port}")[0] == 403
        assert ask(page.url, "POST", "/stop", Host="evil.example")[0] == 403
        assert ask(page.url, "POST", "/stop", Origin="http://evil.example")[0] == 403
        assert operator.mode == RUNNING
        # As the operator's view asks for it when its own server is gone.
        origin = f"http://127.0.0.1:{view_port}"
        status, _, body = ask(page.url, "POST", "/stop", Origin=origin)
        assert (status, json.loads(body)["who"]) == (200, "the stop page")
        assert operator.mode == STOPPED
        assert b"Stopped by the stop page" in ask(page.url)[2]


def test_no_other_account_can_speak_to_a_controller(tmp_path, monkeypatch):
    folder = Path(endpoints(7010).words.removeprefix("ipc://")).parent
    assert stat.S_IMODE(folder.stat().st_mode) == 0o700
    assert endpoints(7010) == endpoints(7010) != endpoints(7011)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    (tmp_path / f"sightfield-{os.getuid()}").mkdir()
    (tmp_path / f"sightfield-{os.getuid()}").chmod(0o777)
    with pytest.raises(InvalidInput, match="must be yours alone"):
        endpoints(7010)


def test_words_come_out_as_they_went_in_and_others_are_none():
    word = Word(word="start", run="r", key="k", who="somebody")
    assert decode_word(encode_word(word)) == word
    for data in (b"", b"stop", b"7", b"{}", b'{"word": 1}', b'{"word": "stop", "more": 1}'):
        assert decode_word(data) is None


@pytest.mark.parametrize(
    ("word", "heard"),
    [
        (Word(word="start", run="r", key="k"), True),
        (Word(word="start", run="other", key="k"), False),
        (Word(word="start", run="r", key="other"), False),
        (Word(word="stop"), True),
    ],
)
def test_a_word_is_for_its_run_and_a_stop_for_all(word, heard):
    assert word.is_for("r", lock_of("r", "k")) is heard


def test_a_run_without_a_key_is_steered_by_nobody():
    assert not Word(word="start", run="r").is_for("r", "")


def test_a_state_of_a_controller_that_knows_no_supervisor_is_taken():
    message = json.loads(encode("r", STATE))
    for name in ("robots", "events", "stop"):
        del message[name]
    decoded = decode(json.dumps(message).encode())
    assert decoded is not None
    assert isinstance(decoded[2], State)
    assert (decoded[2].robots, decoded[2].events, decoded[2].stop) == ([], [], None)
    assert decode(encode("r", STATE)) == ("state", "r", STATE)


@pytest.mark.browser
def test_the_page_shows_robots_events_and_stops_when_its_viewer_is_gone(view, new_page):
    page = new_page().page
    operator = Operator(running=False)
    with (
        StopPage(operator, "two robots", port_of(view.url)) as stop,
        ViewerLink(
            view.states, view.words, Scene(**{**vars(SCENE), "stop_page": stop.url}), operator
        ) as link,
    ):
        page.goto(f"{view.url}#{link.key}")
        assert wait_for(lambda: shown(view, link))
        assert wait_for(lambda: link.show(STATE) or page.is_enabled("#start"))
        marks = page.inner_text("#robots")
        assert "evader 0 held" in marks
        assert "battery low" in marks
        assert "pursuer 0 running" in marks
        assert "1.20 s evader 0: held: battery low" in page.inner_text("#events")
        close(view)
        page.wait_for_function("document.querySelector('#status').innerText.includes('ended')")
        page.click("#stop")
        assert wait_for(lambda: operator.mode == STOPPED)
        assert operator.stopped is not None
        assert operator.stopped.who == "the stop page"


@pytest.mark.browser
def test_on_a_telephone_nothing_is_wider_than_the_page(view, new_page):
    page = new_page().page
    page.set_viewport_size({"width": 400, "height": 800})
    with ViewerLink(view.states, view.words, SCENE, Operator()) as link:
        page.goto(f"{view.url}#{link.key}")
        assert wait_for(lambda: shown(view, link))
        assert wait_for(lambda: link.show(STATE) or page.locator("#robots tr").count() == 3)
        assert page.evaluate("document.documentElement.scrollWidth") == 400
        canvas = page.locator("#meshcat canvas")
        assert wait_for(
            lambda: canvas.evaluate("c => [c.clientWidth, c.clientHeight]") == [400] * 2
        )
        scene = page.locator("#scene").bounding_box()
        stop = page.locator("#stop").bounding_box()
        assert stop is not None
        assert scene is not None
        # What happens and the stop, and below it all of the laboratory.
        assert stop["y"] + stop["height"] < scene["y"]
        assert scene["y"] + scene["height"] < 800


# Where the corners of the floor are on the page, which is a box [px].
CORNERS = """() => {
    viewer.camera.updateWorldMatrix(true, false);
    viewer.scene.updateWorldMatrix(true, true);
    const floor = new MeshCat.THREE.Box3(), pane = document.querySelector("#scene");
    viewer.scene.traverse(part => { if (part.isMesh) floor.expandByObject(part); });
    const {x, y, width, height} = pane.getBoundingClientRect();
    const corners = [];
    for (const east of [floor.min.x, floor.max.x]) for (const south of [floor.min.z, floor.max.z]) {
        const seen = new MeshCat.THREE.Vector3(east, 0, south).project(viewer.camera);
        corners.push([x + (seen.x + 1) / 2 * width, y + (1 - seen.y) / 2 * height]);
    }
    return [corners, [x, y], [x + width, y + height]];
}"""


@pytest.mark.browser
def test_a_page_of_any_shape_shows_the_whole_laboratory(view, new_page):
    page = new_page().page
    with ViewerLink(view.states, view.words, SCENE, Operator()) as link:
        page.goto(f"{view.url}#{link.key}")
        assert wait_for(lambda: shown(view, link))
        assert wait_for(lambda: link.show(STATE) or page.locator("#robots tr").count() == 3)
        for width, height in ((1920, 1080), (1024, 768), (400, 800), (1280, 720), (820, 1180)):
            page.set_viewport_size({"width": width, "height": height})

            def fits():
                link.show(STATE)
                corners, low, high = map(np.array, page.evaluate(CORNERS))
                # As wide as it may be, nearly.
                wide = np.ptp(corners[:, 0]) / (high - low).min()
                return (corners >= low).all() and (corners <= high).all() and wide > 0.6

            assert wait_for(fits), (width, height, page.evaluate(CORNERS))


@pytest.mark.browser
def test_a_page_with_another_runs_address_can_only_stop(view, new_page):
    page = new_page().page
    page.goto(f"{view.url}#another")
    with ViewerLink(view.states, view.words, SCENE, Operator()) as link:
        assert wait_for(lambda: shown(view, link))
        assert wait_for(
            lambda: link.show(STATE) or "can stop the run" in page.inner_text("#notice")
        )
        assert page.is_disabled("#start")
        assert page.is_enabled("#stop")


@pytest.mark.browser
def test_another_page_can_neither_frame_the_view_nor_say_anything(view, new_page):
    page = new_page().page
    operator = Operator(running=False)
    with ViewerLink(view.states, view.words, SCENE, operator) as link:
        assert wait_for(lambda: shown(view, link))
        page.goto("data:text/html,<h1>another site</h1>")
        said = "u => fetch(u, {method: 'POST'}).then(a => a.status, e => 'refused')"
        assert page.evaluate(said, f"{view.url}say/start") == "refused"
        page.evaluate(
            "u => { const f = document.createElement('iframe'); f.src = u; f.id = 'in';"
            " document.body.append(f); return new Promise(done => f.onload = () => done()); }",
            view.url,
        )
        frame = next(each for each in page.frames if each is not page.main_frame)
        assert frame.query_selector("#stop") is None
        assert operator.mode == PAUSED
