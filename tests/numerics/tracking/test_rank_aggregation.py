"""One ranking out of many, against brute force, known elections and symmetry."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.assignment.rules import ASSIGNMENT_RULES
from sightfield.systems.numerics.tracking.assignment.team_view import TeamView
from sightfield.systems.numerics.tracking.assignment.voting import (
    AGGREGATIONS,
    MOST_EVADERS,
    copeland_scores,
    kemeny_ranking,
    kemeny_scores,
    places,
    preferences,
)

# The capital of Tennessee, Memphis, Nashville, Chattanooga, Knoxville, each voter for the nearest:
# the stock example, as in "Kemeny method" and "Copeland's method", Wikipedia, with its results.
TENNESSEE = {"MNCK": 42, "NCKM": 26, "CKNM": 15, "KCNM": 17}
# Condorcet 1785, from H. P. Young, Condorcet's theory of voting, Am. Pol. Sci. Rev. 82 (1988):
# a majority prefers a to b, b to c, and c to a; Borda ranks b a c, Kemeny b c a.
CONDORCET = {"abc": 23, "bca": 17, "bac": 2, "cab": 10, "cba": 8}


def election(ballots):
    """Risks of which each row ranks the candidates, in alphabetical order, as one voter did."""
    names = sorted(next(iter(ballots)))
    rows = [
        [-ballot.index(name) for name in names] for ballot, n in ballots.items() for _ in [0] * n
    ]
    return np.array(rows, dtype=float), names


def scored(rule, ballots):
    risk, names = election(ballots)
    return dict(zip(names, AGGREGATIONS[rule](risk, np.ones(risk.shape, bool)), strict=True))


def ranked(rule, ballots):
    scores = scored(rule, ballots)
    return "".join(sorted(scores, key=lambda name: -scores[name]))


profiles = st.tuples(st.integers(1, 5), st.integers(1, 5), st.integers(0, 10_000))


def random_ballots(profile, seen=0.7):
    n, m, seed = profile
    rng = np.random.default_rng(seed)
    return rng.uniform(0, 1, (n, m)), rng.random((n, m)) < seen


# Risks, and who is seen by whom. The riskiest evader of all is on nobody's ballot.
UNSEEN_RISKIEST = (
    np.array([[9.0, 1.0, 2.0], [8.0, 2.0, 1.0], [7.0, 3.0, 1.0]]),
    np.array([[False, True, True], [False, True, True], [False, True, False]]),
)
# It is on one ballot of three, as the last; the other two would put it first.
SEEN_BY_ONE = (
    np.array([[1.0, 2.0, 9.0], [1.0, 2.0, 9.0], [2.0, 3.0, 1.0]]),
    np.array([[True, True, False], [True, True, False], [True, True, True]]),
)


@pytest.mark.parametrize(
    ("rule", "order"), [("borda", "NCMK"), ("copeland", "NCKM"), ("kemeny", "NCKM")]
)
def test_the_capital_of_tennessee(rule, order):
    assert ranked(rule, TENNESSEE) == order


def test_the_points_of_tennessee():
    assert scored("borda", TENNESSEE) == {"M": 126, "N": 194, "C": 173, "K": 107}
    assert scored("copeland", TENNESSEE) == {"M": 0, "N": 3, "C": 2, "K": 1}
    assert scored("dowdall", TENNESSEE) == pytest.approx(
        {
            "M": 42 + 58 / 4,
            "N": 26 + 42 / 2 + 32 / 3,
            "C": 15 + 43 / 2 + 42 / 3,
            "K": 17 + 15 / 2 + 26 / 3 + 42 / 4,
        }
    )


def test_where_majorities_go_round_in_a_circle():
    assert ranked("borda", CONDORCET) == "bac"
    assert ranked("kemeny", CONDORCET) == "bca"
    assert set(scored("copeland", CONDORCET).values()) == {1.0}


@given(profile=profiles)
def test_kemeny_contradicts_the_ballots_least_of_all_orders(profile):
    preferred = preferences(*random_ballots(profile))

    def contradictions(order):
        return sum(preferred[order[k], order[j]] for k in range(len(order)) for j in range(k))

    best = min(contradictions(order) for order in permutations(range(len(preferred))))
    found = kemeny_ranking(preferred)
    assert sorted(found) == list(range(len(preferred)))
    assert contradictions(found) == best


@given(ballots=profiles.map(random_ballots))
@example(ballots=UNSEEN_RISKIEST)
@example(ballots=SEEN_BY_ONE)
def test_places_and_preferences_are_those_counted_by_hand(ballots):
    risk, seen = ballots
    place, preferred = places(risk, seen), preferences(risk, seen)
    n, m = risk.shape
    for i in range(n):
        for j in range(m):
            if seen[i, j]:
                assert place[i, j] == sum(seen[i, k] and risk[i, k] > risk[i, j] for k in range(m))
    for j in range(m):
        for k in range(m):
            votes = [seen[i, j] and seen[i, k] and risk[i, j] > risk[i, k] for i in range(n)]
            assert preferred[j, k] == sum(votes)


@given(profile=profiles)
def test_the_evader_that_wins_every_duel_is_first(profile):
    risk, seen = random_ballots(profile)
    preferred = preferences(risk, seen)
    for j in range(len(preferred)):
        others = np.arange(len(preferred)) != j
        if (preferred[j, others] > preferred[others, j]).all():
            assert copeland_scores(risk, seen).argmax() == j
            assert kemeny_scores(risk, seen)[j] == len(preferred) - 1


@pytest.mark.parametrize("rule", AGGREGATIONS)
@given(profile=profiles)
def test_what_all_agree_on_is_the_result(rule, profile):
    n, m, seed = profile
    one = np.random.default_rng(seed).uniform(0, 1, m)
    scores = AGGREGATIONS[rule](np.tile(one, (n, 1)), np.ones((n, m), bool))
    assert np.argsort(-scores).tolist() == np.argsort(-one).tolist()


@pytest.mark.parametrize("rule", AGGREGATIONS)
@given(profile=profiles)
def test_the_order_of_the_pursuers_does_not_matter(rule, profile):
    risk, seen = random_ballots(profile)
    scores = AGGREGATIONS[rule](risk, seen)
    np.testing.assert_allclose(AGGREGATIONS[rule](risk[::-1], seen[::-1]), scores)


@pytest.mark.parametrize("rule", ["borda", "dowdall", "copeland"])
@given(profile=profiles)
def test_renaming_the_evaders_renames_the_scores(rule, profile):
    risk, seen = random_ballots(profile)
    scores = AGGREGATIONS[rule](risk, seen)
    mirrored = AGGREGATIONS[rule](risk[:, ::-1], seen[:, ::-1])
    np.testing.assert_allclose(mirrored, scores[::-1])


@pytest.mark.parametrize("rule", ["borda", "copeland"])
@given(profile=profiles)
def test_turning_every_ballot_round_turns_the_scores_round(rule, profile):
    risk, _ = random_ballots(profile)
    everyone = np.ones(risk.shape, bool)
    scores, turned = (AGGREGATIONS[rule](sign * risk, everyone) for sign in (1, -1))
    np.testing.assert_allclose(scores + turned, scores[0] + turned[0])


@pytest.mark.parametrize("rule", AGGREGATIONS)
@given(ballots=profiles.map(random_ballots))
@example(ballots=UNSEEN_RISKIEST)
@example(ballots=SEEN_BY_ONE)
def test_how_risky_an_evader_out_of_sight_would_be_makes_no_difference(rule, ballots):
    risk, seen = ballots
    for unseen in (-100.0, 0.0, 100.0):
        other = AGGREGATIONS[rule](np.where(seen, risk, unseen), seen)
        np.testing.assert_array_equal(other, AGGREGATIONS[rule](risk, seen))


def test_a_pursuer_says_nothing_of_whom_it_does_not_see():
    # Two of three see both evaders and disagree; the third sees the second evader alone.
    risk, seen = np.array([[2.0, 1], [1, 2], [0, 1]]), np.array([[1, 1], [1, 1], [0, 1]], bool)
    assert preferences(risk, seen).tolist() == [[0, 1], [1, 0]]
    assert copeland_scores(risk, seen).tolist() == [0.5, 0.5]


def test_more_evaders_than_kemeny_can_order_are_refused():
    risk = np.zeros((1, MOST_EVADERS + 1))
    with pytest.raises(InvalidInput, match="`evaders` must be at most 12 for kemeny; got 13"):
        kemeny_scores(risk, risk > -1)


@pytest.mark.parametrize("name", AGGREGATIONS)
def test_one_pursuer_goes_for_the_least_or_the_riskiest(name):
    risk = np.array([[1.0, 3.0, 2.0]])
    view = TeamView(np.ones((1, 3), bool), risk, np.zeros((1, 2)), np.zeros((3, 2)))
    assert ASSIGNMENT_RULES[f"{name}_max"](view).tolist() == [1]
    assert ASSIGNMENT_RULES[f"{name}_min"](view).tolist() == [0]
