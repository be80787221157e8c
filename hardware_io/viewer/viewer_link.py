"""The controller's end of the line to the operator's view."""

import contextlib
import threading
import time
import uuid

import zmq

from .messages import Scene, State, encode
from .operator import Operator

# How often the scene is sent again, for a view that was opened later [s].
_SCENE_PERIOD = 1.0
# How long the thread waits for a word before it looks whether it shall end [ms].
_WAIT = 50


class ViewerLink:
    """Tells a view how things stand, and the operator what was said there.

    Nothing here waits for the view: what it does not take at once is dropped.

    Args:
        states: Address to which states go.
        words: Address from which the operator's words come.
        scene: What is shown.
        operator: Who is told.
    """

    def __init__(self, states: str, words: str, scene: Scene, operator: Operator) -> None:
        self._run = uuid.uuid4().hex
        self._scene, self._operator = scene, operator
        self._scene_due = 0.0
        self._context = zmq.Context()
        self._states = self._context.socket(zmq.PUSH)
        self._states.setsockopt(zmq.SNDHWM, 16)
        # What was sent last shall still arrive, but nobody waits for it long.
        self._states.setsockopt(zmq.LINGER, 500)
        self._states.connect(states)
        self._words = self._context.socket(zmq.SUB)
        self._words.setsockopt(zmq.SUBSCRIBE, b"")
        self._words.setsockopt(zmq.LINGER, 0)
        self._words.connect(words)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def __enter__(self) -> "ViewerLink":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def show(self, state: State) -> None:
        """Send a state, and now and then the scene before it."""
        if time.monotonic() >= self._scene_due:
            self._scene_due = time.monotonic() + _SCENE_PERIOD
            self._send(encode(self._run, self._scene))
        self._send(encode(self._run, state))

    def end(self, how: str) -> None:
        """Say that the run is over."""
        self._send(encode(self._run, how))

    def close(self) -> None:
        """Leave the line; the view shows what it knows on."""
        self._ended.set()
        self._thread.join()
        self._states.close()
        self._context.term()

    def _send(self, data: bytes) -> None:
        with contextlib.suppress(zmq.Again):
            self._states.send(data, zmq.NOBLOCK)

    def _listen(self) -> None:
        while not self._ended.is_set():
            if self._words.poll(_WAIT):
                self._operator.say(self._words.recv().decode(errors="replace"))
        self._words.close()
