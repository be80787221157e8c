"""The operator's view: a web server that draws the states of controllers, and outlives them.

Run as `python -m sightfield.hardware_io.viewer.server PORT`.
"""

import contextlib
import json
import os
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

import meshcat
import tornado.ioloop
import tornado.web
import zmq
from meshcat.servers.zmqserver import WebSocketHandler
from zmq.eventloop.zmqstream import ZMQStream

from .drawing import Drawing, SceneStore
from .messages import PRESENT, WORDS, Scene, State, Word, decode, encode_word
from .view_address import HEADERS, endpoints, is_host, is_origin

# The view is stale after this time without a state [s].
STALE_AFTER = 1.0
# How often staleness is checked [ms].
_LOOK = 200
# The page is served on loopback only.
_HERE = "127.0.0.1"
# The header in which a page sends its key.
KEY = "X-Sightfield-Key"


class ViewServer:
    """Takes states from controllers, shows them, and passes on the operator's words.

    Args:
        port: Of the page; 0 lets the system choose.
    """

    def __init__(self, port: int = 0) -> None:
        self._store = SceneStore()
        self._drawing = Drawing(self._store)
        self._scene: Scene | None = None
        self._state: State | None = None
        self._run, self._ended = "", ""
        self._heard, self._drawn_stale = 0.0, False
        # Other runs by number: when each was last heard, and its title.
        self._others: dict[str, tuple[float, str]] = {}
        # The page first: the port decides which process may bind the sockets.
        server = self._application().listen(port, address=_HERE)
        self.port: int = next(iter(server._sockets.values())).getsockname()[1]
        where = endpoints(self.port)
        context = zmq.Context()
        pull = context.socket(zmq.PULL)
        pull.bind(where.states)
        self._stream = ZMQStream(pull)
        self._stream.on_recv(lambda frames: self.hear(frames[0]))
        self._publisher = context.socket(zmq.PUB)
        self._publisher.bind(where.words)
        self._timer = tornado.ioloop.PeriodicCallback(self._look, _LOOK)
        self._timer.start()

    def _application(self) -> tornado.web.Application:
        viewer = Path(str(meshcat.__file__)).parent / "viewer" / "dist"
        assets = {"path": str(viewer)}
        return tornado.web.Application(
            [
                ("/", _Page),
                ("/state", _StateHandler),
                ("/say/(.*)", _SayHandler),
                ("/scene", _SceneHandler, {"bridge": self._store}),
                ("/meshcat/(.*)", _Assets, assets),
            ],
            default_handler_class=_ViewHandler,
            view=self,
        )

    @property
    def stale(self) -> bool:
        """Whether the run has ended, or sent no state for longer than `STALE_AFTER`."""
        return bool(self._ended) or time.monotonic() - self._heard > STALE_AFTER

    def hear(self, data: bytes) -> None:
        """Take a message of a controller; invalid ones are dropped.

        Args:
            data: The bytes.
        """
        message = decode(data)
        if message is None:
            return
        _, run, content = message
        if run != self._run and self._scene is not None and not self.stale:
            # One run at a time: a second one waits until the first is over, or silent.
            if isinstance(content, Scene):
                self._others[run] = (time.monotonic(), content.title)
            elif isinstance(content, str):
                self._others.pop(run, None)
            return
        if isinstance(content, Scene):
            # A run repeats its scene; redraw only when run or scene have changed.
            if run != self._run or self._scene != content:
                self._run, self._scene, self._state, self._ended = run, content, None, ""
                self._drawing.scene(content)
            return
        # Ignore late messages of an earlier run.
        if run != self._run or self._scene is None:
            return
        if isinstance(content, str):
            self._ended = content
        else:
            self._state, self._heard = content, time.monotonic()
        self._draw()

    def steers(self, key: str) -> bool:
        """Whether a key allows its page to start and pause the run that is shown.

        Args:
            key: Key of the page.
        """
        return self._scene is not None and Word(word="start", run=self._run, key=key).is_for(
            self._run, self._scene.lock
        )

    def say(self, word: str, key: str) -> bool:
        """Send the operator's word to controllers if it is allowed; returns whether it is.

        Args:
            word: One of WORDS; a stop is for all runs.
            key: Key of the page.
        """
        allowed = word == "stop" or self.steers(key)
        if allowed:
            self._publisher.send(encode_word(Word(word=word, run=self._run, key=key)))
        return allowed

    def report(self, key: str = "") -> dict[str, Any]:
        """Everything that a page shows beside the drawing, and who runs this view.

        Args:
            key: Key of the page.
        """
        now = time.monotonic()
        others = [title for heard, title in self._others.values() if now - heard < STALE_AFTER]
        return {
            "program": "sightfield viewer",
            "pid": os.getpid(),
            "user": os.getuid(),
            "run": self._run,
            "steers": self.steers(key),
            "others": sorted(others),
            "scene": None if self._scene is None else asdict(self._scene),
            "state": None if self._state is None else asdict(self._state),
            "stale": self.stale,
            "silence": time.monotonic() - self._heard if self._state is not None else None,
            "ended": self._ended,
        }

    def _look(self) -> None:
        self._publisher.send(PRESENT)
        if self.stale != self._drawn_stale:
            self._draw()

    def _draw(self) -> None:
        self._drawn_stale = self.stale
        if self._scene is not None and self._state is not None:
            self._drawing.state(self._scene, self._state, stale=self._drawn_stale)


class _Guarded(tornado.web.RequestHandler):
    """Answers calls for this machine, from its own pages."""

    @property
    def view(self) -> ViewServer:
        """The view that serves these requests."""
        return self.settings["view"]

    def set_default_headers(self) -> None:
        for name, value in HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        request = self.request
        known = is_origin(request.headers.get("Origin"), (self.view.port,))
        if not (known and is_host(request.headers.get("Host"), self.view.port)):
            raise tornado.web.HTTPError(403)


class _ViewHandler(_Guarded):
    """Answers that nothing is there."""

    def get(self) -> None:
        raise tornado.web.HTTPError(404)


class _Assets(_Guarded, tornado.web.StaticFileHandler):
    """Meshcat's own files."""


class _SceneHandler(_Guarded, WebSocketHandler):
    """The line on which a page hears of the scene."""

    def check_origin(self, origin: str) -> bool:
        return is_origin(origin, (self.view.port,))

    def on_message(self, message: str | bytes) -> None:
        """Ignore messages: pages must not change the scene."""


class _Page(_Guarded):
    def get(self) -> None:
        self.write((Path(__file__).parent / "page.html").read_text(encoding="utf-8"))


class _StateHandler(_Guarded):
    def get(self) -> None:
        self.set_header("Content-Type", "application/json")
        self.write(json.dumps(self.view.report(self.request.headers.get(KEY, ""))))


class _SayHandler(_Guarded):
    def post(self, word: str) -> None:
        if word not in WORDS or not self.view.say(word, self.request.headers.get(KEY, "")):
            raise tornado.web.HTTPError(403)


def serve(port: int) -> None:
    """Run the view until it is ended.

    Args:
        port: Of the page.
    """
    ViewServer(port)
    tornado.ioloop.IOLoop.current().start()


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        serve(int(sys.argv[1]))
