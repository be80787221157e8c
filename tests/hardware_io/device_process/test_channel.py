"""Messages arrive whole and in order, or are dropped; nobody waits."""

import socket

import pytest

from sightfield.hardware_io.device_process.channel import Channel, Ended


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
