"""Scanning reads the newest pictures of every friend, and none of them twice."""

from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    OwnAcceptance,
    Temperaments,
)
from sightfield.systems.numerics.social.network.interface import Picture, scan


def friendly_network(count):
    network = MemoryNetwork(
        Temperaments(
            acceptance=OwnAcceptance((1.0,) * count),
            unfriending=(0.0,) * count,
            rejection=(0.0,) * count,
        ),
        0,
    )
    for agent in range(count):
        network.request(agent)
    network.advance(0)
    return network


def post(network, agent, number):
    made = Picture(id=f"{agent}-{number}", agent=agent, time=float(number), data=b"")
    network.post(agent, made)
    return made


def test_the_newest_pictures_of_each_friend_are_read_oldest_first():
    network = friendly_network(2)
    pictures = [[post(network, agent, number) for number in range(4)] for agent in range(2)]
    found = scan(network, (1, 0), 2)
    assert found.pictures == (*pictures[0][2:], *pictures[1][2:])


def test_nothing_new_is_nothing_to_read_and_something_new_is_read_alone():
    network = friendly_network(1)
    for number in range(3):
        post(network, 0, number)
    last = scan(network, (0,), 2)
    assert scan(network, (0,), 2, last).pictures == ()
    new = post(network, 0, 3)
    assert scan(network, (0,), 2, last).pictures == (new,)


def test_a_friend_lost_meanwhile_is_passed_over_and_its_pictures_stay_known():
    network = friendly_network(2)
    post(network, 0, 0)
    last = scan(network, (0, 1), 1)
    network.withdraw(0)
    late = post(network, 1, 0)
    last = scan(network, (0, 1), 1, last)
    assert last.pictures == (late,)
    network.request(0)
    network.advance(1)
    assert scan(network, (0, 1), 1, last).pictures == ()


@given(
    st.lists(
        st.tuples(st.integers(0, 1), st.integers(0, 4), st.booleans()), min_size=1, max_size=20
    ),
    st.integers(1, 3),
)
def test_no_picture_is_read_twice_and_none_is_missed_while_they_come_slowly(steps, count):
    network, last, read, posted, number = friendly_network(2), None, [], set(), 0
    for agent, pictures, both in steps:
        for _ in range(min(pictures, count)):
            posted.add(post(network, agent, number).id)
            number += 1
        last = scan(network, (0, 1) if both else (agent,), count, last)
        read += [each.id for each in last.pictures]
    assert len(read) == len(set(read))
    assert set(read) == posted
