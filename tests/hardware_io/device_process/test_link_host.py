"""The process that drives the robots does what it is told, and holds them when nothing is said."""

import math
import pickle
import socket
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.hardware_io.device_process import link_host, process_link, urgency
from sightfield.hardware_io.device_process.channel import (
    Answer,
    ArmAgain,
    Ask,
    Channel,
    Close,
    Drive,
    Hail,
    Notice,
    NoticeBoard,
)
from sightfield.hardware_io.device_process.link_host import QUIET, LinkHost
from sightfield.hardware_io.device_process.process_link import ProcessLink
from sightfield.hardware_io.kinds.robot_kind import RobotFleet
from sightfield.hardware_io.links.robot_link import OLDEST_POSES, LinkError, LinkHealth
from sightfield.systems.numerics.errors import InvalidInput


class Link:
    """Remembers what it is told; two robots."""

    robots = (3, 8)

    def __init__(self):
        self.told, self.failure, self.number = [], None, 0

    def _note(self, *words):
        self.told.append(words)
        if self.failure is not None:
            raise self.failure

    def next_sequence(self):
        self.number += 1
        return self.number

    def send(self, speeds, turn_rates, sequence, deadline):
        self._note("send", speeds.tolist(), turn_rates.tolist(), sequence, deadline)

    def heartbeat(self):
        self._note("hail")

    def arm_again(self, robots):
        self._note("arm again", robots)

    def arm(self, timeout):
        self._note("arm", timeout)
        return [8]

    def stop(self, timeout):
        self._note("stop", timeout)
        return [3, 8]


@pytest.fixture
def host(monkeypatch):
    """A host of such a link, by a clock that a test sets; its answers are kept."""
    clock = SimpleNamespace(now=20.0)
    monkeypatch.setattr(link_host, "time", SimpleNamespace(monotonic=lambda: clock.now))
    channel = SimpleNamespace(said=[])
    channel.offer = channel.said.append
    made = LinkHost(Link(), channel, None)
    made.clock, made.told, made.said = clock, made._link.told, channel.said
    return made


def test_in_silence_robots_are_told_to_stand_again_and_again(host):
    host._mind_silence(20.0)
    assert host.told == []
    host._drive(Drive((0.3, 0.1), (1.0, -1.0), 20.25))
    assert host.told == [("send", [0.3, 0.1], [1.0, -1.0], 1, 20.25)]
    host._mind_silence(20.0 + QUIET - 1e-6)
    assert len(host.told) == 1
    host._mind_silence(20.0 + QUIET)
    still = [0.0, 0.0]
    assert host.told[1] == ("send", still, still, 2, 20.0 + QUIET + OLDEST_POSES)
    host._mind_silence(20.0 + QUIET + 0.0249)
    assert len(host.told) == 2
    host._mind_silence(20.0 + QUIET + 0.0251)
    assert len(host.told) == 3


def test_who_asks_for_a_stop_or_an_arm_is_answered_and_nobody_is_held_meanwhile(host):
    host._drive(Drive((0.0, 0.0), (0.0, 0.0), 21.0))
    host._answer(Ask(5, "arm", 0.7))
    host._answer(Ask(6, "stop", 0.4))
    assert host.told[1:] == [("arm", 0.7), ("stop", 0.4)]
    assert host.said == [Answer(5, (8,)), Answer(6, (3, 8))]
    for failure, misused in ((LinkError("gone"), False), (InvalidInput("wrong"), True)):
        host._link.failure = failure
        host._answer(Ask(7, "arm", 0.1))
        assert host.said[-1] == Answer(7, (), str(failure), misused)
    host._link.failure = None
    host._do(Ask(8, "stop", 0.2))
    host._mind_silence(99.0)
    assert [each[0] for each in host.told if each[0] == "send"] == ["send"]


def test_words_are_passed_on_and_a_failure_is_noted(host):
    host._do(Hail())
    host._do(ArmAgain((8,)))
    assert host.told == [("hail",), ("arm again", (8,))]
    host._link.failure = LinkError("the radio has gone")
    host._do(Hail())
    assert host._failure == "the radio has gone"
    assert host._news.is_set()
    assert not host._closing.is_set()
    host._do(Close())
    assert host._closing.is_set()


def health(quality=0.5):
    counts = dict.fromkeys(("sent", "acknowledged", "retried", "lost", "received", "refused"), 3)
    return LinkHealth(rssi=-40, round_trip=0.01, quality=(quality,) * 2, **counts)


@pytest.fixture
def link(monkeypatch):
    """A link whose process is played by the test, by a clock that the test sets."""
    clock = SimpleNamespace(now=30.0)
    monkeypatch.setattr(process_link, "time", SimpleNamespace(monotonic=lambda: clock.now))
    made = ProcessLink("udp", RobotFleet(robots=(3, 8)))
    made.said = []
    made._channel = SimpleNamespace(offer=made.said.append)
    made._board = NoticeBoard()
    made._looked, made.clock = 30.0, clock
    yield made
    made._board.close()


def tell(link, number, failure=""):
    link._board.write(
        pickle.dumps(Notice(float(number), {3: number}, health(0.1 * number), failure))
    )


def drive(link):
    link.send(np.array([0.1, 0.2]), np.array([0.3, 0.4]), 1, 31.0)


def test_what_is_noticed_is_told_and_nothing_is_known_before(link):
    assert link.telemetry() == {}
    nothing = link.health()
    assert (nothing.sent, nothing.lost, nothing.received, nothing.refused) == (0, 0, 0, 0)
    assert (nothing.acknowledged, nothing.retried, nothing.rssi) == (0, 0, None)
    assert nothing.quality == (0.0, 0.0)
    tell(link, 4)
    assert link.telemetry() == {3: 4}
    assert link.health() == health(0.4)
    drive(link)
    assert link.said == [Drive((0.1, 0.2), (0.3, 0.4), 31.0)]


def test_a_process_that_is_silent_for_a_second_of_ticks_is_an_error(link):
    tell(link, 1)
    # What passes between two words counts for a tenth of a second at most.
    for k in range(10):
        link.clock.now += 5.0 if k < 5 else 0.1
        drive(link)
    link.clock.now += 0.05
    with pytest.raises(LinkError, match=r"has said nothing for 1\.\d s"):
        drive(link)
    tell(link, 2)
    drive(link)
    tell(link, 3, failure="a cable came off")
    with pytest.raises(LinkError, match="a cable came off"):
        drive(link)


def test_answers_are_those_to_the_questions(link):
    link._answers = {1: Answer(1, (8,)), 2: Answer(2, (), "no", True), 3: Answer(3, (), "gone")}
    assert link.arm(timeout=0.0) == (8,)
    assert link.said[-1] == Ask(1, "arm", 0.0)
    with pytest.raises(InvalidInput, match="no"):
        link.stop(timeout=0.0)
    with pytest.raises(LinkError, match="gone"):
        link.stop(timeout=0.0)
    link._ended = True
    with pytest.raises(LinkError, match="has ended"):
        link.arm(timeout=0.0)
    with pytest.raises(InvalidInput, match="`timeout`"):
        link.arm(timeout=-0.1)


def test_a_question_that_nobody_answers_has_nobody_for_an_answer(link, monkeypatch):
    monkeypatch.setattr(process_link, "_ANSWERING", 0.001)
    assert link.arm(timeout=0.0) == ()
    with pytest.raises(LinkError, match=r"did not open within 0\.001 s"):
        link._answer(0, 0.001, "open")


def test_a_long_message_comes_in_pieces_and_what_is_left_goes_first():
    ours, theirs = map(Channel, socket.socketpair())
    sent, came = list(range(40_000)), []
    assert ours.offer(sent)
    assert ours._rest == b"" or not ours.offer("dropped")
    for _ in range(50):
        came += theirs.receive(0.0)
        if came:
            break
        ours._push(ours._rest)
    assert came == [sent]
    for end in (ours, theirs):
        end.close()


def test_a_board_holds_the_longest_notice_and_the_newest_of_many():
    board = NoticeBoard()
    other = NoticeBoard(board.file)
    for number in range(20):
        board.write(bytes([number]) * 65536)
        assert other.read() == bytes([number]) * 65536
    assert math.isfinite(board._newest())
    assert board._newest() == 20
    # Who opens it later goes on with its numbers.
    later = NoticeBoard(board.file)
    later.write(b"later")
    assert board.read() == b"later"
    assert later._newest() == 21
    for each in (later, other, board):
        each.close()


def test_a_process_goes_first_with_the_least_of_those_priorities(monkeypatch):
    asked = []
    monkeypatch.setattr(urgency.os, "sched_setscheduler", lambda *words: asked.append(words))
    assert urgency.go_first(77) is True
    ((process, policy, parameter),) = asked
    assert (process, policy, parameter.sched_priority) == (77, urgency.os.SCHED_RR, 1)
    urgency.go_first()
    assert asked[1][0] == 0

    def refuse(*_):
        raise PermissionError

    monkeypatch.setattr(urgency.os, "sched_setscheduler", refuse)
    assert urgency.go_first() is False


def test_the_processor_is_kept_awake_by_a_latency_of_nothing(tmp_path):
    with urgency.keep_awake(str(tmp_path / "latency")) as may:
        assert may is True
        assert (tmp_path / "latency").read_bytes() == bytes(4)
    with urgency.keep_awake(str(tmp_path / "nowhere" / "latency")) as may:
        assert may is False
