"""The network in memory draws what its temperaments say, and shows albums to friends only."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    MutualFriendsAcceptance,
    OwnAcceptance,
    Temperaments,
)
from sightfield.systems.numerics.social.network.interface import (
    Answer,
    NotFriends,
    Picture,
    SocialNetwork,
)


def network_of(friending, unfriending, rejection, seed=0) -> SocialNetwork:
    return MemoryNetwork(
        Temperaments(
            acceptance=OwnAcceptance(friending), unfriending=unfriending, rejection=rejection
        ),
        seed,
    )


def picture(agent, number):
    return Picture(id=f"{agent}-{number}", agent=agent, time=float(number), data=b"anything")


def test_answers_come_with_their_probabilities():
    network = network_of((0.3,), (0.0,), (0.25,), seed=3)
    counts = dict.fromkeys(Answer, 0)
    runs = 20_000
    for iteration in range(runs):
        network.request(0)
        network.advance(iteration)
        for each in network.responses():
            counts[each.answer] += 1
        network.withdraw(0)
    for answer, chance in ((Answer.ACCEPTED, 0.3), (Answer.REJECTED, 0.7 * 0.25)):
        spread = np.sqrt(chance * (1 - chance) / runs)
        assert abs(counts[answer] / runs - chance) < 4 * spread


def test_silence_keeps_a_request_open_and_a_rejection_closes_it():
    silent, rejecting = network_of((0.0,), (0.0,), (0.0,)), network_of((0.0,), (0.0,), (1.0,))
    for network, answers in ((silent, 0), (rejecting, 1)):
        network.request(0)
        for iteration in range(3):
            network.advance(iteration)
        assert len(network.responses()) == answers


def test_only_who_was_asked_answers_and_a_request_withdrawn_is_not_answered():
    network = network_of((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    network.request(1)
    network.request(2)
    network.withdraw(2)
    network.advance(0)
    assert [(each.agent, each.answer) for each in network.responses()] == [(1, Answer.ACCEPTED)]
    assert network.responses() == []
    assert network.friends() == {1}


def test_only_friends_read_an_album_newest_first():
    network = network_of((1.0, 1.0), (0.0, 1.0), (0.0, 0.0))
    pictures = [picture(1, number) for number in range(4)]
    for each in pictures:
        network.post(1, each)
    with pytest.raises(NotFriends, match="agent 1"):
        network.latest(1, 2)
    network.request(1)
    network.advance(0)
    assert network.latest(1, 2) == [pictures[3], pictures[2]]
    assert network.latest(1, 9) == pictures[::-1]
    assert network.latest(1, 0) == []
    network.advance(1)
    assert network.responses()[-1].answer is Answer.UNFRIENDED
    with pytest.raises(NotFriends):
        network.latest(1, 2)


def test_an_album_holds_its_newest_pictures():
    network = network_of((1.0,), (0.0,), (0.0,))
    network.request(0)
    network.advance(0)
    for number in range(130):
        network.post(0, picture(0, number))
    assert network.latest(0, 500) == [picture(0, number) for number in range(129, 29, -1)]


def test_withdrawing_from_a_friend_ends_the_friendship():
    network = network_of((1.0,), (0.0,), (0.0,))
    network.request(0)
    network.advance(0)
    network.withdraw(0)
    assert network.friends() == frozenset()


def test_one_agents_luck_does_not_hang_on_who_else_is_asked():
    def accepted_at(asked):
        network = network_of((0.1, 0.1), (0.0, 0.0), (0.5, 0.5), seed=8)
        for iteration in range(100):
            for agent in asked:
                network.request(agent)
            network.advance(iteration)
            if 1 in network.friends():
                return iteration
        return None

    assert accepted_at([1]) == accepted_at([0, 1])
    assert accepted_at([1]) is not None


def test_each_mutual_friend_gives_one_more_chance():
    model = MutualFriendsAcceptance((0.1, 0.2, 0.3), frozenset({(0, 1), (2, 0)}), 0.5)
    assert model.probability(0, ()) == pytest.approx(0.1)
    assert model.probability(0, {1}) == pytest.approx(1 - 0.9 * 0.5)
    assert model.probability(0, {1, 2}) == pytest.approx(1 - 0.9 * 0.25)
    assert model.probability(1, {2}) == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda: OwnAcceptance((0.5, 1.5)), r"friending\[1\]"),
        (lambda: MutualFriendsAcceptance((0.5,), frozenset({(0, 1)})), "acquaintances"),
        (lambda: MutualFriendsAcceptance((0.5, 0.5), frozenset({(1, 1)})), "acquaintances"),
        (lambda: MutualFriendsAcceptance((0.5,), frozenset(), float("nan")), "persuasion"),
        (lambda: network_of((0.5,), (0.5, 0.5), (0.5,)), "unfriending"),
        (lambda: network_of((0.5,), (0.5,), (-0.5,)), r"rejection\[0\]"),
        (lambda: network_of((0.5,), (0.5,), (0.5,), seed=-1), "seed"),
        (lambda: network_of((0.5,), (0.5,), (0.5,)).request(1), "agent"),
        (lambda: network_of((0.5,), (0.5,), (0.5,)).post(0, picture(1, 0)), "picture.agent"),
    ],
)
def test_what_is_no_probability_or_no_agent_is_refused(make, name):
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        make()
