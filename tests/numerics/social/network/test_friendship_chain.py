"""Connected fractions: closed form, exact chain and a long run of Algorithm 2 agree."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.social.network.acceptance import (
    MemoryNetwork,
    MutualFriendsAcceptance,
    OwnAcceptance,
    Temperaments,
    thesis_temperaments,
)
from sightfield.systems.numerics.social.network.evolution import (
    FRIEND,
    EvolutionLimits,
    evolve,
    strangers,
)
from sightfield.systems.numerics.social.network.friendship_chain import (
    connected_fraction,
    friendship_chain,
)

ITERATIONS = 20_000
THESIS = thesis_temperaments()
FRACTIONS = [0.4 / 0.45, 0.5 / 0.52, 0.3 / 0.34]

STATEMENTS = {
    "1": lambda known: known.status[0] == FRIEND,
    "2": lambda known: known.status[1] == FRIEND,
    "3": lambda known: known.status[2] == FRIEND,
    "all": lambda known: len(known.friends) == 3,
    "some": lambda known: len(known.friends) > 0,
}
CROWDED = {
    "Table 2.3": EvolutionLimits(),
    "one request at a time": EvolutionLimits(requests=1, patience=2),
    "no patience": EvolutionLimits(requests=1, patience=0),
    "few friends": EvolutionLimits(requests=2, patience=10, friends=2),
}


def measured(temperaments, limits, seed):
    """Fraction of iterations in which each statement holds."""
    network, known = MemoryNetwork(temperaments, seed), strangers(temperaments.count)
    holds = dict.fromkeys(STATEMENTS, 0)
    for iteration in range(ITERATIONS):
        known = evolve(network, known, limits, iteration).known
        for name, statement in STATEMENTS.items():
            holds[name] += statement(known)
    return {name: count / ITERATIONS for name, count in holds.items()}


@pytest.fixture(scope="module")
def thesis_chain():
    return friendship_chain(THESIS, EvolutionLimits())


def test_the_closed_form_is_the_balance_of_flows():
    for p, q in ((0.4, 0.05), (1.0, 0.2), (0.3, 0.0)):
        fraction = connected_fraction(p, q)
        assert (1 - fraction) * p == pytest.approx(fraction * q)
    assert math.isnan(connected_fraction(0.0, 0.0))


@pytest.mark.parametrize("patience", [0, 1, 10])
def test_with_room_for_all_each_agent_is_a_friend_for_p_of_p_plus_q_whatever_the_patience(patience):
    chain = friendship_chain(THESIS, EvolutionLimits(patience=patience))
    for i, expected in enumerate(FRACTIONS):
        p, q = THESIS.acceptance.probability(i, ()), THESIS.unfriending[i]
        assert connected_fraction(p, q) == pytest.approx(expected)
        got = chain.fraction(lambda known, i=i: known.status[i] == FRIEND)
        assert got == pytest.approx(expected, abs=1e-12)


def test_the_error_of_a_time_average_of_two_states_is_that_of_the_closed_form(thesis_chain):
    """Its correlation falls as (1 - p - q)^k."""
    p, q = 0.4, 0.05
    fraction, rest = connected_fraction(p, q), 1 - p - q
    variance = fraction * (1 - fraction) * (1 + rest) / (1 - rest)
    got = thesis_chain.standard_error(STATEMENTS["1"], ITERATIONS)
    assert got == pytest.approx(math.sqrt(variance / ITERATIONS), rel=1e-9)


def test_independent_agents_are_all_connected_as_often_as_the_product_says(thesis_chain):
    all_of_them = thesis_chain.fraction(STATEMENTS["all"])
    assert all_of_them == pytest.approx(math.prod(FRACTIONS), abs=1e-12)
    none = 1 - thesis_chain.fraction(STATEMENTS["some"])
    assert none == pytest.approx(math.prod(1 - each for each in FRACTIONS), abs=1e-12)


@pytest.mark.parametrize("name", CROWDED)
@pytest.mark.parametrize("seed", [1, 2])
def test_a_long_run_is_within_four_standard_errors_of_the_stationary_values(name, seed):
    chain = friendship_chain(THESIS, CROWDED[name])
    for statement, got in measured(THESIS, CROWDED[name], seed).items():
        holds = STATEMENTS[statement]
        error = chain.standard_error(holds, ITERATIONS)
        assert abs(got - chain.fraction(holds)) <= 4 * error + 1e-12, statement


def test_four_standard_errors_would_tell_the_wrong_model():
    """So the test above means something: half the unfriending is seen, and so is a missed turn."""
    chain = friendship_chain(THESIS, EvolutionLimits())
    error = chain.standard_error(STATEMENTS["1"], ITERATIONS)
    assert abs(connected_fraction(0.4, 0.025) - FRACTIONS[0]) > 8 * error
    reasked_at_once = 0.4 / (0.4 + 0.05 * 0.6)
    assert abs(reasked_at_once - FRACTIONS[0]) > 8 * error


def test_with_mutual_friends_the_run_agrees_with_the_chain_too_and_they_help():
    mutual = Temperaments(
        acceptance=MutualFriendsAcceptance((0.1, 0.1, 0.1), frozenset({(0, 1), (2, 1)}), 0.5),
        unfriending=(0.1, 0.1, 0.1),
        rejection=(0.3, 0.3, 0.3),
    )
    alone = Temperaments(
        acceptance=OwnAcceptance((0.1, 0.1, 0.1)),
        unfriending=mutual.unfriending,
        rejection=mutual.rejection,
    )
    limits = EvolutionLimits(patience=3)
    chain = friendship_chain(mutual, limits)
    for statement, got in measured(mutual, limits, 3).items():
        holds = STATEMENTS[statement]
        assert abs(got - chain.fraction(holds)) <= 4 * chain.standard_error(holds, ITERATIONS)
    without = friendship_chain(alone, limits)
    for holds in STATEMENTS.values():
        assert chain.fraction(holds) > without.fraction(holds) + 0.05
    # Agent 2 has two acquaintances, the others one.
    assert chain.fraction(STATEMENTS["2"]) > chain.fraction(STATEMENTS["1"])


def test_all_three_are_connected_most_of_the_time(thesis_chain):
    """The thesis's first claim about Figure 2.34: three quarters of the iterations."""
    assert thesis_chain.fraction(STATEMENTS["all"]) == pytest.approx(0.7541, abs=1e-4)


def test_at_least_one_is_connected_for_long_but_not_for_ever(thesis_chain):
    """Its second claim is likely over a run as long as its experiment, and is no property."""
    some = STATEMENTS["some"]
    assert 1 - thesis_chain.fraction(some) == pytest.approx(5.03e-4, abs=1e-6)
    assert thesis_chain.chance_throughout(some, 100) == pytest.approx(0.961, abs=1e-3)
    assert thesis_chain.chance_throughout(some, 20_000) < 1e-3


def test_a_statement_that_always_holds_has_no_error(thesis_chain):
    assert thesis_chain.fraction(lambda known: True) == pytest.approx(1)
    assert thesis_chain.standard_error(lambda known: True, 10) == pytest.approx(0, abs=1e-12)
    assert thesis_chain.chance_throughout(lambda known: True, 10) == pytest.approx(1)


def test_each_row_of_the_transition_matrix_is_a_distribution():
    for limits in CROWDED.values():
        chain = friendship_chain(THESIS, limits)
        assert np.allclose(chain.transition.sum(axis=1), 1)
        assert np.allclose(chain.stationary @ chain.transition, chain.stationary, atol=1e-14)


def test_what_is_no_probability_or_no_temperament_is_refused():
    with pytest.raises(InvalidInput, match="`friending` must"):
        connected_fraction(2.0, 0.1)
    with pytest.raises(InvalidInput, match="`unfriending` must"):
        connected_fraction(0.2, -3.0)
    with pytest.raises(InvalidInput, match="`temperaments` must be of type Temperaments"):
        friendship_chain(2, EvolutionLimits())
