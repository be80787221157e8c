"""The process that drives robots for a controller, and stops them if the controller dies.

`ProcessLink` runs it as a module; its arguments are two file descriptors, of its socket and of its
board. It runs with real-time priority and keeps CPUs awake, where the system lets it.
"""

import contextlib
import os
import pickle
import signal
import socket
import sys
import threading
import time
from collections.abc import Callable

import numpy as np

from ...systems.numerics.errors import InvalidInput, SightfieldError
from ..kinds.known_kinds import find_kind
from ..links.robot_link import OLDEST_POSES, LinkError, RobotLink
from .channel import (
    Answer,
    ArmAgain,
    Ask,
    Channel,
    Close,
    Drive,
    Ended,
    Hail,
    Notice,
    NoticeBoard,
    Open,
)
from .urgency import keep_awake

# After this silence of the controller its robots are told to stand [s], before any of them stops by
# itself and reports that it hears nothing; the order is repeated at this interval [s].
QUIET, _REPEAT = 0.14, 0.025
# Time between two notices when nothing happens, and delay of a notice after a report came [s]: the
# reports of a team come together, so that one notice serves for them all.
_ALIVE, _TOGETHER = 0.02, 0.002
# How long the robots may take to acknowledge the stop once the controller has gone, and how long
# the process may take to end after that [s].
_LAST_STOP, _LAST_PATIENCE = 0.3, 1.5


class LinkHost:
    """Carries out a controller's messages on a link.

    Args:
        link: The link, already connected.
        channel: Channel to the controller.
        board: Board on which the state of the link is published.
    """

    def __init__(self, link: RobotLink, channel: Channel, board: NoticeBoard) -> None:
        self._link, self._channel, self._board = link, channel, board
        self._failure = ""
        # When the controller last told robots to drive, and when they were last told to stand [s].
        self._told: float | None = None
        self._stood = 0.0
        self._news, self._closing = threading.Event(), threading.Event()
        self._writer = threading.Thread(target=self._keep_board, daemon=True)
        link.on_report = self._news.set

    def run(self) -> None:
        """Serve the controller until it sends `Close`.

        Raises:
            Ended: The controller has gone without sending `Close`.
        """
        self._writer.start()
        try:
            while not self._closing.is_set():
                drive = None
                for word in self._channel.receive(0.5 * _REPEAT):
                    if isinstance(word, Drive):
                        drive = word
                    else:
                        self._do(word)
                if drive is not None:
                    self._drive(drive)
                self._mind_silence(time.monotonic())
        finally:
            self._closing.set()
            self._writer.join()

    def _do(self, word: object) -> None:
        link = self._link
        if isinstance(word, Close):
            self._closing.set()
        elif isinstance(word, Ask):
            self._told = None
            threading.Thread(target=self._answer, args=(word,), daemon=True).start()
        elif isinstance(word, Hail):
            self._try(link.heartbeat)
        elif isinstance(word, ArmAgain):
            self._try(lambda: link.arm_again(word.robots))

    def _answer(self, ask: Ask) -> None:
        """Arm or stop, in a thread of its own: a stop does not wait for an arm."""
        act = self._link.arm if ask.what == "arm" else self._link.stop
        try:
            answer = Answer(ask.number, tuple(act(timeout=ask.timeout)))
        except SightfieldError as error:
            answer = Answer(ask.number, (), str(error), isinstance(error, InvalidInput))
        with contextlib.suppress(Ended):
            self._channel.offer(answer)

    def _drive(self, drive: Drive) -> None:
        self._told = time.monotonic()
        self._send(np.array(drive.speeds), np.array(drive.turn_rates), drive.deadline)

    def _mind_silence(self, now: float) -> None:
        """Tell the robots to stand if the controller's next command is late."""
        if self._told is None or now < max(self._told + QUIET, self._stood + _REPEAT):
            return
        self._stood, still = now, np.zeros(len(self._link.robots))
        self._send(still, still, now + OLDEST_POSES)

    def _send(self, speeds: np.ndarray, turn_rates: np.ndarray, deadline: float) -> None:
        link = self._link
        self._try(lambda: link.send(speeds, turn_rates, link.next_sequence(), deadline))

    def _try(self, act: Callable[[], object]) -> None:
        try:
            act()
        except LinkError as error:
            # Told at the controller's next command.
            self._failure = str(error)
            self._news.set()

    def _keep_board(self) -> None:
        while not self._closing.is_set():
            self._news.wait(_ALIVE)
            time.sleep(_TOGETHER)
            self._news.clear()
            link = self._link
            reports, health = link.telemetry(), link.health()
            notice = Notice(time.monotonic(), reports, health, self._failure)
            self._board.write(pickle.dumps(notice))


def main() -> None:
    """Open the link that the controller asks for, and drive the robots over it."""
    # Signals of the terminal are meant for the controller, which then tells this process.
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())
    # Switch threads often, so that a receiving thread does not wait long for the others.
    sys.setswitchinterval(1e-4)
    channel = Channel(socket.socket(fileno=int(sys.argv[1])))
    board = NoticeBoard(int(sys.argv[2]))
    with contextlib.suppress(Ended), keep_awake():
        _serve(channel, board)
    # Threads of drivers may hang.
    os._exit(0)


def _serve(channel: Channel, board: NoticeBoard) -> None:
    words: list[object] = []
    while not words:
        words = channel.receive(1.0)
    word = words[0]
    assert isinstance(word, Open)
    sys.path[:] = word.path
    link: RobotLink | None = None
    try:
        link = find_kind(word.kind).open_link(word.fleet)
        link.connect()
    except SightfieldError as error:
        channel.offer(Answer(0, (), str(error), isinstance(error, InvalidInput)))
        return
    try:
        channel.offer(Answer(0, tuple(link.robots)))
        LinkHost(link, channel, board).run()
    except (Ended, SystemExit):
        _end_soon()
        with contextlib.suppress(SightfieldError):
            link.stop(timeout=_LAST_STOP)
    finally:
        link.close()


def _end_soon() -> None:
    """Make the process end within `_LAST_PATIENCE`, even if a device hangs."""
    timer = threading.Timer(_LAST_PATIENCE, os._exit, (1,))
    timer.daemon = True
    timer.start()


if __name__ == "__main__":
    main()
