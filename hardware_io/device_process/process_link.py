"""A link whose devices are driven by a separate process."""

import contextlib
import itertools
import pickle
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence

import numpy as np

from ...systems.numerics.errors import InvalidInput, require_non_negative
from ..kinds.robot_kind import RobotFleet
from ..links.robot_link import LinkError, LinkHealth, RobotLink, RobotReport
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
from .urgency import go_first

# How long the process may take to open the devices, and to close them [s].
_OPENING, _CLOSING = 20.0, 1.6
# How much longer than the robots it may take to answer [s].
_ANSWERING = 0.3
# How long it may publish nothing new [s], and how much of each pause between the controller's own
# looks counts towards that at most [s].
_SILENCE, _PAUSE = 1.0, 0.1


class ProcessLink(RobotLink):
    """A link of any kind, run in a separate process.

    That process reads and stamps the robots' reports as they come, however busy the controller is.
    Only `arm` and `stop` wait for a device. If the controller is silent for 0.14 s, the process
    tells the robots to stand; if it ends without `close`, even killed, the process stops them. If
    the process ends or hangs, this link raises an error, and robots stop by themselves.

    Args:
        kind: Name of the kind of robots, which the process looks up with `find_kind`.
        fleet: The robots, and how they are reached.

    Raises:
        InvalidInput: On entering: the kind refuses the fleet.
        LinkError: On entering: the way to the robots cannot be opened.
    """

    def __init__(self, kind: str, fleet: RobotFleet) -> None:
        super().__init__(fleet.robots)
        self._open = Open(kind, fleet, tuple(sys.path))
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: Channel | None = None
        self._board: NoticeBoard | None = None
        self._numbers = itertools.count(1)
        self._answers: dict[int, Answer] = {}
        self._changed = threading.Condition()
        self._ended = False
        self._reader: threading.Thread | None = None
        # The last notice, as bytes and decoded; how long there has been no new one [s], and when
        # `_mind` last looked [s].
        self._last: tuple[bytes | None, Notice | None] = (None, None)
        self._silent, self._looked = 0.0, 0.0

    def connect(self) -> None:
        """Start the process, and let it open the link to the robots.

        Raises:
            InvalidInput: The kind refuses the fleet.
            LinkError: The link cannot be opened.
        """
        ours, theirs = socket.socketpair()
        board = self._board = NoticeBoard()
        files = (theirs.fileno(), board.file)
        self._process = subprocess.Popen(
            [sys.executable, "-m", f"{__package__}.link_host", *map(str, files)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=files,
            # A signal from the terminal is for the controller.
            start_new_session=True,
        )
        theirs.close()
        go_first(self._process.pid)
        channel = self._channel = Channel(ours)
        self._ended, self._last, self._silent = False, (None, None), 0.0
        self._answers.clear()
        self._reader = threading.Thread(target=self._listen, args=(channel,), daemon=True)
        self._reader.start()
        channel.offer(self._open)
        try:
            self._answer(0, _OPENING, "open the way to the robots")
        except Exception:
            self._let_go()
            raise
        self._looked = time.monotonic()

    def close(self) -> None:
        """Close the devices and end the process, which is killed if it takes too long."""
        if self._process is None:
            return
        # The process may have ended already.
        with contextlib.suppress(LinkError):
            self._say(Close())
        self._let_go()

    def heartbeat(self) -> None:
        """See `RobotLink`."""
        self._say(Hail())

    def arm(self, timeout: float = 1.0) -> tuple[int, ...]:
        """See `RobotLink`.

        Args:
            timeout: How long to wait [s].
        """
        return self._ask("arm", timeout)

    def arm_again(self, robots: Sequence[int]) -> None:
        """See `RobotLink`.

        Args:
            robots: Their numbers.
        """
        self._say(ArmAgain(tuple(robots)))

    def stop(self, timeout: float = 0.5) -> tuple[int, ...]:
        """See `RobotLink`.

        Args:
            timeout: How long to wait [s].
        """
        return self._ask("stop", timeout)

    def send(
        self, speeds: np.ndarray, turn_rates: np.ndarray, sequence: int, deadline: float
    ) -> None:
        """See `RobotLink`; the process numbers what it sends by itself.

        Args:
            speeds: Shape (n,) [m/s].
            turn_rates: Shape (n,) [rad/s].
            sequence: Number of the command.
            deadline: As of `RobotLink` [s].
        """
        self._say(Drive(tuple(speeds.tolist()), tuple(turn_rates.tolist()), deadline))
        # Checked after sending, so that the command is not delayed.
        self._mind()

    def telemetry(self) -> dict[int, RobotReport]:
        """The latest report of every robot that was heard, stamped on arrival in the process."""
        notice = self._look()
        return {} if notice is None else notice.reports

    def health(self) -> LinkHealth:
        """How the link has been."""
        notice = self._look()
        if notice is not None:
            return notice.health
        nothing = (0.0,) * len(self.robots)
        return LinkHealth(
            sent=0,
            acknowledged=0,
            retried=0,
            lost=0,
            received=0,
            refused=0,
            rssi=None,
            round_trip=None,
            quality=nothing,
        )

    def _look(self) -> Notice | None:
        """The newest notice; None before the first."""
        with self._changed:
            # While a notice is being written, this reads the one before.
            found = None if self._board is None else self._board.read()
            if found is not None and found != self._last[0]:
                self._last, self._silent = (found, pickle.loads(found)), 0.0
            return self._last[1]

    def _mind(self) -> None:
        """Check that the process reports no failure and is not silent for too long.

        Raises:
            LinkError: It reports a failure, or has said nothing new for too long.
        """
        notice = self._look()
        with self._changed:
            now = time.monotonic()
            self._silent += min(now - self._looked, _PAUSE)
            self._looked = now
            silent = self._silent
        if notice is not None and notice.failure:
            raise LinkError(notice.failure)
        if silent > _SILENCE:
            raise LinkError(
                f"the process that drives the robots has said nothing for {silent:.1f} s"
            )

    def _say(self, word: object) -> None:
        if self._channel is None:
            raise LinkError("the link is not open: use it in a `with` statement")
        try:
            # A message that the process cannot take now is dropped: it would only come late.
            self._channel.offer(word)
        except Ended:
            raise LinkError("the process that drives the robots has ended") from None

    def _ask(self, what: str, timeout: float) -> tuple[int, ...]:
        require_non_negative("timeout", timeout)
        number = next(self._numbers)
        self._say(Ask(number, what, timeout))
        return self._answer(number, timeout + _ANSWERING, what)

    def _answer(self, number: int, patience: float, what: str) -> tuple[int, ...]:
        """Wait for an answer; none in time counts as no robot having answered."""
        with self._changed:
            self._changed.wait_for(lambda: number in self._answers or self._ended, patience)
            answer = self._answers.pop(number, None)
            ended = self._ended
        if answer is None:
            if ended or number == 0:
                how = "has ended" if ended else f"did not {what} within {patience:g} s"
                raise LinkError(f"the process that drives the robots {how}")
            return ()
        if answer.failure:
            raise (InvalidInput if answer.misused else LinkError)(answer.failure)
        return answer.robots

    def _listen(self, channel: Channel) -> None:
        try:
            while True:
                for word in channel.receive(10.0):
                    with self._changed:
                        self._answers[word.number] = word
                        self._changed.notify_all()
        except Ended:
            with self._changed:
                self._ended = True
                self._changed.notify_all()

    def _let_go(self) -> None:
        process, self._process = self._process, None
        channel, self._channel = self._channel, None
        assert process is not None
        assert channel is not None
        try:
            process.wait(_CLOSING)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if self._reader is not None:
            self._reader.join()
        channel.close()
        # Keep the last notice after the board is closed.
        self._look()
        with self._changed:
            board, self._board = self._board, None
        if board is not None:
            board.close()
