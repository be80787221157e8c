"""The operator's mode, and its inputs and outputs: keys, a stop page, a port for the diagram.

The keys need no page, and the controller serves the stop page itself: both can stop the robots
while the view is down.
"""

import html
import json
import os
import select
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Protocol

import numpy as np
from pydrake.systems.framework import LeafSystem

from ...systems.drake_parts import state_vector
from ...systems.numerics.errors import require_positive
from ...systems.station.gates import PAUSED, RUNNING, STOPPED
from .view_address import HEADERS, is_host, is_origin

MODE_NAMES = {RUNNING: "running", PAUSED: "paused", STOPPED: "stopped"}


@dataclass(frozen=True)
class Stop:
    """An emergency stop.

    Attributes:
        who: Asked for it.
        when: By the clock on the wall, hours, minutes and seconds.
        acknowledgement: Who acknowledged it, in words.
    """

    who: str
    when: str
    acknowledgement: str


class Operator:
    """The operator's mode, set from any thread.

    A stop is final: nothing moves again in this run. Actions that must happen at once on a stop,
    without waiting for the next tick, are registered with `on_stop`.

    Attributes:
        stopped: The emergency stop, once there is one.
        starts_said: How often the operator has said start.

    Args:
        running: Whether the run may go on from the start, or waits for the word.
    """

    def __init__(self, *, running: bool = True) -> None:
        self._mode = RUNNING if running else PAUSED
        self._lock = threading.Lock()
        self._at_once: list[Callable[[], object]] = []
        self._listeners: list[Callable[[str, str], object]] = []
        self._view_age: Callable[[], float] = lambda: 0.0
        self.stopped: Stop | None = None
        self.starts_said = 0

    @property
    def view_age(self) -> float:
        """Since the operator's view was last heard [s]; 0 without one."""
        return self._view_age()

    def watch_view(self, age: Callable[[], float]) -> None:
        """Set the function that tells how long the operator's view has been silent.

        Args:
            age: Returns that time [s].
        """
        self._view_age = age

    @property
    def mode(self) -> float:
        """Number of the mode: RUNNING, PAUSED or STOPPED."""
        return self._mode

    def on_stop(self, act: Callable[[], object]) -> None:
        """Register an action to be done at once when the operator stops the robots.

        Args:
            act: The action; may return the robots that acknowledged it.
        """
        self._at_once.append(act)

    def on_word(self, hear: Callable[[str, str], object]) -> None:
        """Register a listener for each obeyed word and who said it; a stop is carried out first."""
        self._listeners.append(hear)

    def say(self, word: str, who: str = "the program") -> None:
        """Obey start, pause or stop; other words are ignored.

        Args:
            word: What is said.
            who: Who says it.
        """
        with self._lock:
            if word == "stop":
                first, self._mode = self._mode != STOPPED, STOPPED
            elif word in ("start", "pause"):
                first = False
                if self._mode != STOPPED:
                    self._mode = RUNNING if word == "start" else PAUSED
                    self.starts_said += word == "start"
            else:
                return
        if first:
            self._stop(who)
        elif word == "stop" or self._mode == STOPPED:
            return
        for hear in self._listeners:
            hear(word, who)

    def _stop(self, who: str) -> None:
        when = time.strftime("%H:%M:%S")
        # Known at once, and completed when robots have answered.
        self.stopped = Stop(who, when, "The controller sends nothing but zeros.")
        for act in self._at_once:
            # If one action fails the others must still be done; the gate is closed already.
            try:
                robots = act()
            except Exception as error:
                words = f"The robots could not be told: {error}."
            else:
                words = _acknowledged(robots)
            if words:
                self.stopped = Stop(who, when, f"{self.stopped.acknowledgement} {words}")

    def toggle(self, who: str = "the program") -> None:
        """Pause a running run, or else start it.

        Args:
            who: Who says so.
        """
        self.say("pause" if self._mode == RUNNING else "start", who)


def _acknowledged(robots: object) -> str:
    if not isinstance(robots, Iterable):
        return ""
    names = ", ".join(map(str, robots))
    return f"Robots that acknowledged it: {names or 'none'}."


class Attends(Protocol):
    """Something that knows the operator's mode."""

    starts_said: int

    @property
    def mode(self) -> float:
        """Number of the mode: 1 to run, 0 for a pause, -1 for an emergency stop."""
        ...

    @property
    def view_age(self) -> float:
        """Since the operator's view was last heard [s]; 0 without one."""
        ...


class OperatorPort(LeafSystem):
    """Samples the operator's mode periodically.

    .. pydrake_system::

        name: OperatorPort
        input_ports: []
        output_ports:
        - mode
        - starts_said
        - view_age

    ===========  ====  ====  =====  ===========
    port         size  unit  frame  feedthrough
    ===========  ====  ====  =====  ===========
    mode         1     -     -      -
    starts_said  1     -     -      -
    view_age     1     s     -      -
    ===========  ====  ====  =====  ===========

    `mode` is 1 to run, 0 for a pause, -1 for an emergency stop; `starts_said` is how often the
    operator has said start, and `view_age` how long the operator's view has been silent, 0 without
    one.

    Source: the user interface of Zhang 2014, 2.2.8, Figure 2.24.

    Args:
        operator: Whose.
        period: Between ticks [s].

    Raises:
        InvalidInput: The period is not positive.
    """

    def __init__(self, operator: Attends, *, period: float):
        super().__init__()
        require_positive("period", period)
        self._operator = operator
        self._states = [self.DeclareDiscreteState(state_vector(np.zeros(1))) for _ in range(3)]
        self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._sample)
        for name, state in zip(("mode", "starts_said", "view_age"), self._states, strict=True):
            self.DeclareStateOutputPort(name, state)

    def _sample(self, context, discrete_state):
        operator = self._operator
        values = (operator.mode, operator.starts_said, operator.view_age)
        for state, value in zip(self._states, values, strict=True):
            discrete_state.set_value(state, np.array([float(value)]))


# How long the thread waits for a key before it looks whether it shall end [s].
_WAIT = 0.1


@contextmanager
def keys(
    actions: Mapping[str, Callable[[], object]], terminal: int | None = None
) -> Iterator[bool]:
    """Call the action of each key pressed while the block runs; yield whether there is a terminal.

    Args:
        actions: Actions by key, one character each.
        terminal: Its file descriptor; None for standard input.
    """
    place = terminal
    if place is None:
        # A service has no standard input, and one that was replaced has no descriptor.
        with suppress(AttributeError, OSError):
            place = sys.stdin.fileno()
    if place is None or not os.isatty(place):
        yield False
        return
    # Imported only here: these modules are missing on systems without such terminals.
    import termios
    import tty

    before = termios.tcgetattr(place)
    ended = threading.Event()

    def listen() -> None:
        while not ended.is_set():
            if select.select([place], [], [], _WAIT)[0]:
                for key in os.read(place, 64).decode(errors="ignore"):
                    actions.get(key, lambda: None)()

    thread = threading.Thread(target=listen, daemon=True)
    # Keys come at once, and Ctrl-C still works.
    tty.setcbreak(place)
    thread.start()
    try:
        yield True
    finally:
        ended.set()
        thread.join()
        termios.tcsetattr(place, termios.TCSADRAIN, before)


_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Sightfield: stop</title><style>
body {{ margin: 0; padding: 16px; font: 18px/1.4 system-ui, sans-serif; background: #fbfbfa; }}
h1 {{ font-size: 20px; margin: 0 0 8px; }}
button {{ width: 100%; height: 60vh; font: inherit; font-size: 36px; font-weight: 700; color: #fff;
         background: #c81e1e; border: 2px solid #8f1212; border-radius: 12px; cursor: pointer; }}
</style></head><body><h1>{title}</h1><p id="state">{state}</p>
<form method="post" action="stop"><button id="stop" autofocus>EMERGENCY STOP</button></form>
</body></html>
"""


class StopPage:
    """Serves a page with a stop button until it is closed, in a separate thread.

    Any user of this machine may stop the robots by it; it cannot start them.

    Args:
        operator: Told of a stop.
        title: Title of the run.
        view_port: Port of the operator's view, whose page may ask for a stop as well.
    """

    def __init__(self, operator: Operator, title: str, view_port: int) -> None:
        class Handler(_Handler):
            pass

        Handler.operator, Handler.title = operator, title
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        port = int(self._server.server_address[1])
        Handler.port, Handler.view_port = port, view_port
        self.url = f"http://127.0.0.1:{port}/"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def __enter__(self) -> "StopPage":
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Handler(BaseHTTPRequestHandler):
    operator: Operator
    title: str
    port: int
    view_port: int
    # Time-out of a silent connection, so that it does not keep its thread for ever [s].
    timeout = 10

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing in the terminal."""

    def do_GET(self) -> None:
        """The page."""
        if not is_host(self.headers["Host"], self.port):
            self._answer(403, "text/plain", "not for this machine\n")
        elif self.path != "/":
            self._answer(404, "text/plain", "nothing is here\n")
        else:
            stop, state = self.operator.stopped, MODE_NAMES[self.operator.mode]
            if stop is not None:
                state = f"Stopped by {stop.who} at {stop.when}. {stop.acknowledgement}"
            page = _PAGE.format(title=html.escape(self.title), state=html.escape(state))
            self._answer(200, "text/html; charset=utf-8", page)

    def do_POST(self) -> None:
        """The stop."""
        known = is_origin(self.headers["Origin"], (self.port, self.view_port))
        if not (known and is_host(self.headers["Host"], self.port) and self.path == "/stop"):
            self._answer(403, "text/plain", "not for this machine\n")
            return
        self.operator.say("stop", "the stop page")
        if "text/html" in self.headers.get("Accept", ""):
            self._answer(303, "text/plain", "", Location="/")
        else:
            stop = self.operator.stopped
            self._answer(200, "application/json", json.dumps(stop and vars(stop)))

    def _answer(self, status: int, kind: str, text: str, **headers: str) -> None:
        data = text.encode()
        self.send_response(status)
        for name, value in (HEADERS | headers).items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)
