"""The operator's view: a web server that draws what controllers tell it, and outlives them."""

import json
import os
import time
from pathlib import Path
from typing import Any

import meshcat
import tornado.ioloop
import tornado.web
import zmq
from meshcat.servers.zmqserver import WebSocketHandler
from zmq.eventloop.zmqstream import ZMQStream

from .drawing import Drawing
from .messages import Scene, State, decode
from .operator import WORDS
from .scene_store import SceneStore

# After so long without a word what is shown is stale [s].
STALE_AFTER = 1.0
# How often staleness is looked at [ms].
_LOOK = 200
# What of the laboratory's traffic may be heard is this machine's own.
_HERE = "127.0.0.1"


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
        context = zmq.Context()
        pull = context.socket(zmq.PULL)
        self._states = pull.bind_to_random_port(f"tcp://{_HERE}")
        self._stream = ZMQStream(pull)
        self._stream.on_recv(lambda frames: self.hear(frames[0]))
        self._publisher = context.socket(zmq.PUB)
        self._words = self._publisher.bind_to_random_port(f"tcp://{_HERE}")
        server = self._application().listen(port, address=_HERE)
        self.port: int = next(iter(server._sockets.values())).getsockname()[1]
        self._timer = tornado.ioloop.PeriodicCallback(self._look, _LOOK)
        self._timer.start()

    def _application(self) -> tornado.web.Application:
        viewer = Path(str(meshcat.__file__)).parent / "viewer" / "dist"
        assets = {"path": str(viewer)}
        return tornado.web.Application(
            [
                ("/", _Page),
                ("/state", _StateHandler, {"view": self}),
                ("/say/(.*)", _SayHandler, {"view": self}),
                ("/scene", WebSocketHandler, {"bridge": self._store}),
                ("/meshcat/(.*)", tornado.web.StaticFileHandler, assets),
            ]
        )

    @property
    def stale(self) -> bool:
        """Whether nobody has said for long how things stand."""
        return bool(self._ended) or time.monotonic() - self._heard > STALE_AFTER

    def hear(self, data: bytes) -> None:
        """Take a message of a controller; what is none is dropped.

        Args:
            data: The bytes.
        """
        message = decode(data)
        if message is None:
            return
        _, run, content = message
        if isinstance(content, Scene):
            if run != self._run or self._scene != content:
                self._run, self._scene, self._state, self._ended = run, content, None, ""
                self._drawing.scene(content)
            return
        # What an earlier run still has to say is no longer of interest.
        if run != self._run or self._scene is None:
            return
        if isinstance(content, str):
            self._ended = content
        else:
            self._state, self._heard = content, time.monotonic()
        self._draw()

    def say(self, word: str) -> None:
        """Tell every controller what the operator said."""
        self._publisher.send(word.encode())

    def report(self) -> dict[str, Any]:
        """Everything that a page shows beside the scene, and where controllers connect."""
        return {
            "program": "sightfield viewer",
            "pid": os.getpid(),
            "states": f"tcp://{_HERE}:{self._states}",
            "words": f"tcp://{_HERE}:{self._words}",
            "scene": None if self._scene is None else vars(self._scene),
            "state": None if self._state is None else vars(self._state),
            "stale": self.stale,
            "silence": time.monotonic() - self._heard if self._state is not None else None,
            "ended": self._ended,
        }

    def _look(self) -> None:
        if self.stale != self._drawn_stale:
            self._draw()

    def _draw(self) -> None:
        self._drawn_stale = self.stale
        if self._scene is not None and self._state is not None:
            self._drawing.state(self._scene, self._state, stale=self._drawn_stale)


class _Page(tornado.web.RequestHandler):
    def get(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.write((Path(__file__).parent / "page.html").read_text(encoding="utf-8"))


class _ViewHandler(tornado.web.RequestHandler):
    def initialize(self, view: ViewServer) -> None:
        self.view = view


class _StateHandler(_ViewHandler):
    def get(self) -> None:
        self.set_header("Cache-Control", "no-store")
        self.set_header("Content-Type", "application/json")
        self.write(json.dumps(self.view.report()))


class _SayHandler(_ViewHandler):
    def post(self, word: str) -> None:
        # A page of somebody else's, open in the same browser, has no say here.
        origin = self.request.headers.get("Origin", "")
        if word not in WORDS or origin not in ("", f"http://{self.request.host}"):
            self.set_status(403)
            return
        self.view.say(word)


def serve(port: int) -> None:
    """Run the view until it is ended.

    Args:
        port: Of the page.
    """
    ViewServer(port)
    tornado.ioloop.IOLoop.current().start()
