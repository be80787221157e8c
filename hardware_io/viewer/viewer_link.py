"""The controller's connection to the operator's view, and the system that sends it the state."""

import contextlib
import secrets
import threading
import time
import uuid
from collections import deque
from dataclasses import replace
from typing import Protocol

import numpy as np
import zmq
from pydrake.systems.framework import LeafSystem

from ...systems.drake_parts import read
from ...systems.numerics.errors import require, require_non_negative, require_positive
from ...systems.numerics.station.supervision import reason_words, standing_name, transitions
from .messages import (
    Event,
    RobotState,
    Scene,
    State,
    StopReport,
    decode_word,
    encode,
    lock_of,
    or_none,
)
from .operator import Operator

# How often the scene is sent again, for a view that was opened later [s].
_SCENE_PERIOD = 0.5
# How many events are shown.
_EVENTS = 50
# How long the thread waits for a word before it looks whether it shall end [ms].
_WAIT = 50


class ViewerLink:
    """Sends states to the view, and passes the words said there to the `Operator`.

    Nothing here waits for the view: messages that it does not take at once are dropped. Each run
    has a new key; words without it are not obeyed, except a stop.

    Attributes:
        key: Key of the run.
        stop_page: Address of the controller's own page with a stop button; "" if there is none.

    Args:
        states: Address to which states go.
        words: Address from which the operator's words come.
        scene: The scene to show.
        operator: Obeys the words.
    """

    def __init__(self, states: str, words: str, scene: Scene, operator: Operator) -> None:
        self._run = uuid.uuid4().hex
        self.key, self.stop_page = secrets.token_urlsafe(16), scene.stop_page
        self._scene = replace(scene, lock=lock_of(self._run, self.key))
        self._operator = operator
        self._state: State | None = None
        self._over = False
        self._words_said: deque[Event] = deque(maxlen=_EVENTS)
        # The socket is used by the run's thread and by the threads in which words arrive.
        self._sending = threading.Lock()
        self._scene_due = 0.0
        self._context = zmq.Context()
        self._states = self._context.socket(zmq.PUSH)
        self._states.setsockopt(zmq.SNDHWM, 16)
        # The last messages may still arrive, but closing does not wait long for that.
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
        """Show a word that was obeyed; a stop at once, as the run may send no further state."""
        state = self._state
        time_ = 0.0 if state is None else state.time
        self._words_said.append(Event(time=time_, text=f"{word}, said by {who}"))
        if word == "stop" and state is not None and not self._ended.is_set():
            self._send(encode(self._run, self._with_words(replace(state, operator=-1.0))))

    def end(self, how: str) -> None:
        """Say that the run is over, and how it ended, in one line."""
        self._over = True
        self._send(encode(self._run, how))

    def close(self) -> None:
        """Disconnect; the view keeps the last state, and is free for another run."""
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


class Shows(Protocol):
    """Something that takes a state."""

    def show(self, state: State) -> None:
        """Show it."""
        ...


class StatePublisher(LeafSystem):
    """Sends the state of the robots to the operator's view, a few times a second.

    .. pydrake_system::

        name: StatePublisher
        input_ports:
        - pursuer_poses
        - evader_poses
        - pursuer_valid
        - evader_valid
        - pursuer_age
        - evader_age
        - visibility
        - assignment
        - quality
        - battery
        - mode
        - sent_command
        - standing
        - reason
        output_ports: []

    =============  =====  ==========  =====
    port           size   unit        frame
    =============  =====  ==========  =====
    pursuer_poses  3 Np   m, m, rad   world
    evader_poses   3 Ne   m, m, rad   world
    pursuer_valid  Np     -           -
    evader_valid   Ne     -           -
    pursuer_age    Np     s           -
    evader_age     Ne     s           -
    visibility     Np Ne  -           -
    assignment     Np     -           -
    quality        N      -           -
    battery        N      V           -
    mode           1      -           -
    sent_command   2 N    m/s, rad/s  robot
    standing       N      -           -
    reason         N      -           -
    =============  =====  ==========  =====

    `standing` and `reason` are numbers of Standing and Reason; each change of them is an event.

    Source: the user interface of Zhang 2014, 2.2.8, Figure 2.24.

    Args:
        view: Where to.
        pursuers: Number of pursuers Np.
        evaders: Number of evaders Ne.
        period: Between states [s].
        offset: After which it begins [s].
        looks: How often in a period it looks for events.

    Raises:
        InvalidInput: The period is not positive, or the offset negative.
    """

    def __init__(
        self,
        view: Shows,
        *,
        pursuers: int,
        evaders: int,
        period: float = 0.1,
        offset: float = 0.0,
        looks: int = 1,
    ):
        super().__init__()
        require_positive("period", period)
        require_non_negative("offset", offset)
        require(looks > 0, "looks", "be positive", looks)
        self._view, self._shape = view, (pursuers, evaders)
        self._names = [f"pursuer {i}" for i in range(pursuers)]
        self._names += [f"evader {j}" for j in range(evaders)]
        # Last values seen, only to find changes; not a declared state.
        self._known: tuple[np.ndarray, np.ndarray] | None = None
        self._events: deque[Event] = deque(maxlen=_EVENTS)
        count = pursuers + evaders
        sizes = {
            "pursuer_poses": 3 * pursuers,
            "evader_poses": 3 * evaders,
            "pursuer_valid": pursuers,
            "evader_valid": evaders,
            "pursuer_age": pursuers,
            "evader_age": evaders,
            "visibility": pursuers * evaders,
            "assignment": pursuers,
            "quality": count,
            "battery": count,
            "mode": 1,
            "sent_command": 2 * count,
            "standing": count,
            "reason": count,
        }
        self._ports = {
            name: self.DeclareVectorInputPort(name, size) for name, size in sizes.items()
        }
        # When both are due, events are collected first.
        self.DeclarePeriodicPublishEvent(period / looks, offset, self._look)
        self.DeclarePeriodicPublishEvent(period, offset, self._publish)

    def _look(self, context):
        now = (read(self._ports["standing"], context), read(self._ports["reason"], context))
        for each in transitions(self._names, self._known, now):
            event = Event(time=context.get_time(), robot=each.robot, text=each.text)
            self._events.append(event)
        self._known = now

    def _publish(self, context):
        values = {name: read(port, context) for name, port in self._ports.items()}

        def both(name: str) -> np.ndarray:
            return np.concatenate([values[f"pursuer_{name}"], values[f"evader_{name}"]])

        self._view.show(
            State(
                time=context.get_time(),
                operator=float(values["mode"][0]),
                poses=both("poses").reshape(-1, 3).tolist(),
                valid=(both("valid") > 0.5).tolist(),
                age=[or_none(age) for age in both("age")],
                sight=(values["visibility"] > 0.5).reshape(self._shape).tolist(),
                assignment=np.rint(values["assignment"]).astype(int).tolist(),
                quality=[or_none(each) for each in values["quality"]],
                battery=[or_none(each) for each in values["battery"]],
                commands=values["sent_command"].reshape(-1, 2).tolist(),
                robots=[
                    RobotState(name=name, state=standing_name(standing), why=reason_words(reason))
                    for name, standing, reason in zip(
                        self._names, values["standing"], values["reason"], strict=True
                    )
                ],
                events=list(self._events),
            )
        )
