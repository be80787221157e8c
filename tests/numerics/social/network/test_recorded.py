"""How a network of friends evolves, and what its pictures promise to tell, is as recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    MutualFriendsAcceptance,
    OwnAcceptance,
    Temperaments,
    draw_responses,
    thesis_temperaments,
)
from sightfield.systems.numerics.social.network.evolution import (
    Acquaintances,
    EvolutionLimits,
    choose_new,
    entropy,
    estimated_acceptance,
    evolve,
    expected_information,
    interest,
    strangers,
    take_answers,
    update_tallies,
)
from sightfield.systems.numerics.social.network.friendship_chain import (
    connected_fraction,
    friendship_chain,
)
from sightfield.systems.numerics.social.network.interface import Answer, Picture, Response

CHOOSY = MutualFriendsAcceptance((0.3, 0.45, 0.1, 0.6), frozenset({(0, 1), (2, 1), (3, 0)}))
CROWD = Temperaments(
    acceptance=CHOOSY, unfriending=(0.15, 0.2, 0.1, 0.25), rejection=(0.3, 0.1, 0.6, 0.2)
)
LIMITS = EvolutionLimits(requests=2, patience=3, friends=3)


def test_answers_are_drawn_as_recorded(as_recorded):
    generator = np.random.default_rng(8)
    drawn = [draw_responses(CROWD, {0, 2, 3}, {1}, generator) for _ in range(30)]
    as_recorded([[(each.agent, each.answer) for each in answers] for answers in drawn])
    chances = [CHOOSY.probability(agent, {0, 1, 3}) for agent in range(4)]
    as_recorded(chances, "chances")
    as_recorded(thesis_temperaments(), "thesis")


def test_a_network_evolves_as_recorded(as_recorded):
    network, known = MemoryNetwork(CROWD, 11), strangers(4)
    tallies = np.zeros((4, 2))
    found = []
    for number in range(40):
        wishes = np.random.default_rng(number).random(4).tolist() if number % 3 else None
        step = evolve(network, known, LIMITS, number, wishes)
        tallies = update_tallies(tallies, step)
        known = step.known
        found.append([known.status, known.queue, step.asked, step.requests_sent])
    as_recorded(found, "steps")
    as_recorded([tallies, estimated_acceptance(tallies)], "tallies")


def test_answers_are_taken_as_recorded(as_recorded):
    rng = np.random.default_rng(2)
    kinds, found = list(Answer), []
    for _ in range(60):
        known = Acquaintances(
            tuple(rng.integers(-2, 4, 4).tolist()), tuple(rng.permutation(4).tolist())
        )
        said = [
            Response(agent=int(rng.integers(4)), answer=kinds[int(rng.integers(3))])
            for _ in range(int(rng.integers(6)))
        ]
        found.append([take_answers(known, LIMITS, said), choose_new(known, LIMITS)])
    as_recorded([repr(each) for each in found[:8]], "first")
    as_recorded(
        [
            [*taken.status, len(errands.again), sum(errands.again), *errands.withdrawn, *chosen]
            for (taken, errands), (_, chosen) in found
        ],
        "all",
    )


def test_information_is_as_recorded(as_recorded):
    rng = np.random.default_rng(4)
    beliefs, views = rng.dirichlet(np.full(9, 0.7)), rng.uniform(0, 1, (4, 9))
    views[0, :4] = [0.0, 1.0, 0.0, 1.0]
    as_recorded(
        [entropy(beliefs), *(expected_information(beliefs, each) for each in views)], "each"
    )
    as_recorded(interest(beliefs, views, np.array([0.2, 0.5, 0.7, 0.1]), 3), "interest")


@pytest.mark.parametrize(
    "limits",
    [LIMITS, EvolutionLimits(requests=1, patience=1, friends=2), EvolutionLimits(patience=4)],
    ids=["two at once", "one at once", "usual"],
)
def test_chains_are_as_recorded(limits, as_recorded):
    own = Temperaments(
        acceptance=OwnAcceptance((0.35, 0.5, 0.2)),
        unfriending=(0.1, 0.07, 0.15),
        rejection=(0.1, 0.2, 0.3),
    )
    chain = friendship_chain(own, limits)
    first, all_of_them = (lambda known: 0 in known.friends), (lambda known: len(known.friends) > 1)
    about = f"{limits.requests} {limits.patience} {limits.friends}"
    as_recorded(
        [
            len(chain.states),
            chain.stationary @ np.arange(len(chain.states)),
            *(chain.fraction(each) for each in (first, all_of_them)),
            *(chain.standard_error(each, 300) for each in (first, all_of_them)),
            *(chain.chance_throughout(each, 4) for each in (first, all_of_them)),
        ],
        about,
    )


def test_a_friend_of_one_agent_is_connected_for_the_share_of_its_rates():
    assert connected_fraction(0.3, 0.1) == pytest.approx(0.75)
    assert connected_fraction(0.3, 0.0) == 1.0
    assert np.isnan(connected_fraction(0.0, 0.0))


def test_an_album_keeps_its_newest_hundred_and_needs_no_request():
    network = MemoryNetwork(
        Temperaments(acceptance=OwnAcceptance((1.0,)), unfriending=(0.0,), rejection=(0.0,)), 0
    )
    network.request(0)
    network.advance(0)
    for number in range(103):
        network.post(0, Picture(id=str(number), agent=0, time=float(number), data=b""))
    kept = [each.id for each in network.latest(0, 1000)]
    assert kept == [str(number) for number in range(102, 2, -1)]
    assert network.latest(0, 0) == []


@pytest.mark.parametrize(
    "make",
    [
        lambda: MutualFriendsAcceptance((0.3, 1.1), frozenset()),
        lambda: MutualFriendsAcceptance((0.3, 1.0), frozenset({(0, 2)})),
        lambda: MutualFriendsAcceptance((0.3, 1.0), frozenset({(1, 1)})),
        lambda: MutualFriendsAcceptance((0.3, 1.0), frozenset(), persuasion=1.1),
        lambda: OwnAcceptance((-0.1,)),
        lambda: thesis_temperaments((0.2, 0.2)),
        lambda: thesis_temperaments((0.2, 0.2, 1.2)),
        lambda: EvolutionLimits(requests=0),
        lambda: EvolutionLimits(friends=0),
        lambda: EvolutionLimits(patience=-1),
        lambda: strangers(-1),
        lambda: MemoryNetwork(CROWD, -1),
        lambda: MemoryNetwork(CROWD, 0).request(4),
        lambda: MemoryNetwork(CROWD, 0).latest(0, -1),
        lambda: connected_fraction(1.1, 0.5),
        lambda: connected_fraction(0.5, -0.1),
        lambda: expected_information(np.array([0.5, 0.6]), np.zeros(2)),
        lambda: expected_information(np.array([1.5, -0.5]), np.zeros(2)),
        lambda: expected_information(np.array([0.5, 0.5]), np.array([1.1, 0.0])),
        lambda: expected_information(np.array([0.5, 0.5]), np.array([-0.1, 0.0])),
        lambda: expected_information(np.array([0.5, 0.5]), np.zeros(3)),
    ],
)
def test_what_is_no_network_is_refused(make):
    with pytest.raises(InvalidInput, match="` must"):
        make()


def test_what_is_just_a_network_is_not_refused():
    assert OwnAcceptance((0.0, 1.0)).count() == 2
    assert EvolutionLimits(requests=1, friends=1, patience=0).patience == 0
    assert strangers(0).status == ()
    assert expected_information(np.array([1.0, 0.0]), np.array([1.0, 0.0])) == 0.0
    assert MemoryNetwork(CROWD, 0).agents() == (0, 1, 2, 3)
