"""The controller's end of the line to the operator's view."""

import contextlib
import secrets
import threading
import time
import uuid
from collections import deque
from dataclasses import replace

import zmq

from .messages import Event, Scene, State, StopReport, decode_word, encode, lock_of
from .operator import Operator

# How often the scene is sent again, for a view that was opened later [s].
_SCENE_PERIOD = 0.5
# How many events are shown.
_EVENTS = 50
# How long the thread waits for a word before it looks whether it shall end [ms].
_WAIT = 50


class ViewerLink:
    """Tells a view how things stand, and the operator what was said there.

    Nothing here waits for the view: what it does not take at once is dropped. The run has a key,
    made anew; without it a word is not obeyed, but for a stop.

    Attributes:
        key: Of the run.
        stop_page: Address of the controller's own page with a stop, "" without.

    Args:
        states: Address to which states go.
        words: Address from which the operator's words come.
        scene: What is shown.
        operator: Who is told.
    """

    def __init__(self, states: str, words: str, scene: Scene, operator: Operator) -> None:
        self._run = uuid.uuid4().hex
        self.key, self.stop_page = secrets.token_urlsafe(16), scene.stop_page
        self._scene = replace(scene, lock=lock_of(self._run, self.key))
        self._operator = operator
        self._state: State | None = None
        self._over = False
        self._words_said: deque[Event] = deque(maxlen=_EVENTS)
        # The socket is used by the run and, after a word, by whoever said it.
        self._sending = threading.Lock()
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
        self._heard = time.monotonic()
        operator.on_word(self._tell)
        operator.watch_view(lambda: time.monotonic() - self._heard)

    def __enter__(self) -> "ViewerLink":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def show(self, state: State) -> None:
        """Send a state, and now and then the scene before it."""
        self._state = state
        if time.monotonic() >= self._scene_due:
            self._scene_due = time.monotonic() + _SCENE_PERIOD
            self._send(encode(self._run, self._scene))
        self._send(encode(self._run, self._with_words(state)))

    def _with_words(self, state: State) -> State:
        """The state with what the operator said."""
        stop = self._operator.stopped
        events = sorted([*state.events, *self._words_said], key=lambda event: event.time)
        report = state.stop if stop is None else StopReport(**vars(stop))
        return replace(state, events=events[-_EVENTS:], stop=report)

    def _tell(self, word: str, who: str) -> None:
        """Show a word that was obeyed, and at once: a stop is the last that a run does."""
        state = self._state
        time_ = 0.0 if state is None else state.time
        self._words_said.append(Event(time=time_, text=f"{word}, said by {who}"))
        if word == "stop" and state is not None and not self._ended.is_set():
            self._send(encode(self._run, self._with_words(replace(state, operator=-1.0))))

    def end(self, how: str) -> None:
        """Say that the run is over."""
        self._over = True
        self._send(encode(self._run, how))

    def close(self) -> None:
        """Leave the line; the view shows what it knows on, and is free for another run."""
        if not self._over:
            self.end("its controller left")
        self._operator.watch_view(lambda: 0.0)
        self._ended.set()
        self._thread.join()
        with self._sending:
            self._states.close()
        self._context.term()

    def _send(self, data: bytes) -> None:
        with self._sending, contextlib.suppress(zmq.Again, zmq.ZMQError):
            self._states.send(data, zmq.NOBLOCK)

    def _listen(self) -> None:
        while not self._ended.is_set():
            if self._words.poll(_WAIT):
                data = self._words.recv()
                self._heard = time.monotonic()
                word = decode_word(data)
                if word is not None and word.is_for(self._run, self._scene.lock):
                    self._operator.say(word.word, word.who)
        self._words.close()
