"""Algorithm 2 keeps its limits, has patience and ends it, and loses no agent for good."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    OwnAcceptance,
    Temperaments,
)
from sightfield.systems.numerics.social.network.evolution import (
    FRIEND,
    STRANGER,
    Acquaintances,
    EvolutionLimits,
    choose_new,
    evolve,
    strangers,
    take_answers,
    with_friends,
)
from sightfield.systems.numerics.social.network.interface import Answer, Response


def network_of(friending, unfriending, rejection, seed=0):
    return MemoryNetwork(
        Temperaments(
            acceptance=OwnAcceptance(tuple(friending)),
            unfriending=tuple(unfriending),
            rejection=tuple(rejection),
        ),
        seed,
    )


class Counting(MemoryNetwork):
    """Counts the requests between two readings of the answers."""

    def begin(self):
        super().begin()
        self.sent, self.most_sent = 0, 0

    def request(self, agent):
        super().request(agent)
        self.sent += 1
        self.most_sent = max(self.most_sent, self.sent)

    def responses(self):
        self.sent = 0
        return super().responses()


def says(answer, *agents):
    return [Response(agent=agent, answer=answer) for agent in agents]


def test_the_first_agents_in_line_are_asked_as_many_as_answers_may_be_awaited():
    known, chosen = choose_new(strangers(5), EvolutionLimits(requests=3, friends=9))
    assert chosen == (0, 1, 2)
    assert known.status == (0, 0, 0, STRANGER, STRANGER)
    assert choose_new(known, EvolutionLimits(requests=3, friends=9))[1] == ()


def test_friends_and_requests_together_never_exceed_the_most_friends():
    """The printed comparison would let one more through."""
    limits = EvolutionLimits(requests=3, friends=2)
    assert len(choose_new(strangers(5), limits)[1]) == 2
    assert choose_new(with_friends(5, [4]), limits)[1] == (0,)
    assert choose_new(with_friends(5, [3, 4]), limits)[1] == ()


def test_the_most_interesting_are_asked_first_and_ties_in_turn():
    limits = EvolutionLimits(requests=2, friends=9)
    assert choose_new(strangers(4), limits, [0.0, 1.0, 3.0, 1.0])[1] == (2, 1)


@pytest.mark.parametrize("answer", [None, Answer.REJECTED])
def test_an_agent_is_passed_over_when_its_counter_exceeds_the_patience_even_if_it_rejects(answer):
    limits = EvolutionLimits(requests=1, patience=2, friends=1)
    known, _ = choose_new(strangers(1), limits)
    for count in (1, 2):
        known, errands = take_answers(known, limits, says(answer, 0) if answer else [])
        assert known.status == (count,)
        assert errands.again == ((0,) if answer else ())
        assert errands.withdrawn == ()
    known, errands = take_answers(known, limits, says(answer, 0) if answer else [])
    assert known.status == (STRANGER,)
    assert errands.again == ()
    assert errands.withdrawn == (() if answer else (0,))


def test_an_agent_passed_over_goes_to_the_end_of_the_line_and_is_asked_again_in_its_turn():
    limits = EvolutionLimits(requests=1, patience=0, friends=3)
    known, order = strangers(3), []
    for _ in range(7):
        known, chosen = choose_new(known, limits)
        order += chosen
        known, _ = take_answers(known, limits, [])
    assert order == [0, 1, 2, 0, 1, 2, 0]


def test_an_agent_that_unfriends_is_a_stranger_again():
    known, _ = take_answers(with_friends(2, [0, 1]), EvolutionLimits(), says(Answer.UNFRIENDED, 1))
    assert known.status == (FRIEND, STRANGER)


def test_the_last_word_counts_when_an_agent_accepts_and_unfriends_between_two_readings():
    both = says(Answer.ACCEPTED, 0) + says(Answer.UNFRIENDED, 0)
    known, errands = take_answers(Acquaintances((3,), (0,)), EvolutionLimits(), both)
    assert known.status == (STRANGER,)
    assert (errands.again, errands.withdrawn) == ((), ())


def test_an_acceptance_that_crosses_its_withdrawal_is_taken_if_there_is_room():
    late = says(Answer.ACCEPTED, 1)
    known, errands = take_answers(with_friends(2, [0]), EvolutionLimits(friends=2), late)
    assert (known.friends, errands.withdrawn) == ((0, 1), ())
    known, errands = take_answers(with_friends(2, [0]), EvolutionLimits(friends=1), late)
    assert (known.friends, errands.withdrawn) == ((0,), (1,))


chances = st.lists(st.floats(0, 1), min_size=1, max_size=6)


@given(chances, st.integers(1, 4), st.integers(0, 4), st.integers(1, 5), st.integers(0, 99))
def test_limits_hold_and_the_pursuer_knows_its_friends(friending, requests, patience, most, seed):
    limits = EvolutionLimits(requests=requests, patience=patience, friends=most)
    count = len(friending)
    network = Counting(
        Temperaments(
            acceptance=OwnAcceptance(tuple(friending)),
            unfriending=(0.2,) * count,
            rejection=(0.5,) * count,
        ),
        seed,
    )
    known = strangers(count)
    for iteration in range(40):
        done = evolve(network, known, limits, iteration)
        known = done.known
        assert set(known.friends) == network.friends()
        assert len(known.friends) + len(known.waiting) <= most
        assert len(known.waiting) <= requests
        assert max(known.status) <= patience
        assert sorted(known.queue) == list(range(count))
        assert set(known.waiting) <= set(done.asked)
    assert network.most_sent <= requests


def test_agents_that_always_accept_and_never_leave_are_friends_after_one_iteration():
    network = network_of([1, 1, 1], [0, 0, 0], [0, 0, 0])
    done = evolve(network, strangers(3), EvolutionLimits(), 0)
    assert done.known.friends == (0, 1, 2)
    assert done.requests_sent == 3


def test_a_rejecting_agent_does_not_keep_the_others_from_being_asked():
    network = network_of([0, 1], [0, 0], [1, 0])
    known, limits = strangers(2), EvolutionLimits(requests=1, patience=3)
    for iteration in range(5):
        known = evolve(network, known, limits, iteration).known
    assert known.friends == (1,)


@pytest.mark.parametrize(
    ("name", "value"), [("requests", 0), ("patience", -1), ("friends", 0), ("requests", 2.0)]
)
def test_limits_are_whole_numbers_in_range(name, value):
    with pytest.raises(InvalidInput, match=f"`{name}` must be a whole number"):
        EvolutionLimits(**{name: value})


def test_friends_must_be_agents():
    with pytest.raises(InvalidInput, match="`friends`"):
        with_friends(2, [2])


def test_a_run_repeats_exactly():
    def friends(network):
        network.begin()
        known, found = strangers(3), []
        for iteration in range(50):
            known = evolve(network, known, EvolutionLimits(), iteration).known
            found.append(known)
        return found

    network = network_of([0.4, 0.5, 0.3], [0.05, 0.02, 0.04], [0.2] * 3, seed=5)
    first = friends(network)
    assert friends(network) == first
    other = network_of([0.4, 0.5, 0.3], [0.05, 0.02, 0.04], [0.2] * 3, seed=6)
    assert friends(other) != first
    assert np.mean([len(known.friends) for known in first]) > 1
