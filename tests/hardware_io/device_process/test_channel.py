"""Messages arrive whole and in order, or are dropped; nobody waits.

What one process writes another reads whole, or not at all.
"""

import socket
import subprocess
import sys
import time

import pytest

from sightfield.hardware_io.device_process.channel import Channel, Ended, NoticeBoard


def pair():
    first, second = socket.socketpair()
    return Channel(first), Channel(second)


def test_messages_arrive_in_their_order():
    ours, theirs = pair()
    assert all(ours.offer(each) for each in ("a", {"b": 1}, None))
    assert theirs.receive(1.0) == ["a", {"b": 1}, None]
    assert theirs.receive(0.0) == []


def test_what_the_other_side_does_not_take_is_dropped_and_what_it_took_in_part_is_whole():
    ours, theirs = pair()
    offered = [(number, bytes(5000)) for number in range(400)]
    taken = [message for message in offered if ours.offer(message)]
    assert 0 < len(taken) < len(offered)
    found = []
    while len(found) < len(taken):
        found += theirs.receive(1.0)
        # What is left of one goes with the next word.
        ours.offer("more")
    found = [each for each in found if each != "more"]
    assert found == taken


def test_who_has_gone_is_missed():
    ours, theirs = pair()
    theirs.close()
    with pytest.raises(Ended):
        ours.receive(1.0)
    with pytest.raises(Ended):
        ours.offer("anybody?")


# Writes notices of different lengths for as long as it is let, each made of one byte.
WRITER = """
import sys
from sightfield.hardware_io.device_process.channel import NoticeBoard
board = NoticeBoard(int(sys.argv[1]))
print("up", flush=True)
while True:
    for k in range(1, 200):
        board.write(bytes([k]) * (300 * k))
"""


def test_the_newest_notice_is_read_and_nothing_before_the_first():
    board = NoticeBoard()
    assert board.read() is None
    for notice in (b"first", b"second", b"", b"fourth"):
        board.write(notice)
        assert board.read() == notice
    board.close()


def test_a_reader_beside_a_busy_writer_sees_whole_notices_alone():
    board = NoticeBoard()
    writer = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(board.file)],
        pass_fds=(board.file,),
        stdout=subprocess.PIPE,
    )
    try:
        assert writer.stdout is not None
        writer.stdout.readline()
        # However seldom the two run at the same time.
        found, until = [], time.monotonic() + 60.0
        while len({notice[0] for notice in found}) <= 10 and time.monotonic() < until:
            found += [notice for _ in range(500) if (notice := board.read())]
    finally:
        writer.kill()
        writer.communicate()
    assert len({notice[0] for notice in found}) > 10
    assert all(notice == notice[:1] * (300 * notice[0]) for notice in found)
    # One that was killed in the middle of a notice leaves one that can be read.
    assert board.read() is not None
    board.close()


def test_a_notice_that_is_damaged_is_none():
    board = NoticeBoard()
    board.write(b"robot 3 drives")
    found = board._memory.find(b"robot 3")
    board._memory[found + 6 : found + 7] = b"4"
    assert board.read() is None
    board.close()


def test_a_notice_that_is_too_long_is_refused():
    board = NoticeBoard()
    with pytest.raises(ValueError, match="65536 bytes at most"):
        board.write(bytes(65537))
    board.close()
