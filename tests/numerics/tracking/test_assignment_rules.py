"""Who tracks whom, by every rule."""

from itertools import permutations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.assignment.matching import match_pairs
from sightfield.systems.numerics.tracking.assignment.rules import ASSIGNMENT_RULES
from sightfield.systems.numerics.tracking.assignment.team_view import TeamView
from sightfield.systems.numerics.tracking.assignment.voting import borda_scores


def view(risk, visible=None, **options):
    """A TeamView with everyone in sight and positions that do not matter, unless said."""
    risk = np.asarray(risk, dtype=float)
    visible = np.ones(risk.shape, dtype=bool) if visible is None else np.asarray(visible, bool)
    pursuers = np.column_stack([np.arange(len(risk)), np.zeros(len(risk))])
    evaders = np.column_stack([np.arange(risk.shape[1]), np.ones(risk.shape[1])])
    return TeamView(visible, risk, **{"pursuers": pursuers, "evaders": evaders, **options})


def random_view(game):
    n, m, seed = game
    rng = np.random.default_rng(seed)
    return view(rng.uniform(0, 3, (n, m)), rng.random((n, m)) < 0.6)


views = st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(0, 10_000)).map(random_view)

# Nobody sees evader 0, which is the riskiest to all, first in the order, and nearest to all.
UNSEEN_RISKIEST = view(
    [[9.0, 1.0, 2.0], [8.0, 2.0, 1.0]],
    [[False, True, True], [False, True, True]],
    evaders=np.array([[0.5, 0.0], [2.0, 1.0], [3.0, 1.0]]),
)
# The same last in the order, with more pursuers than evaders in sight.
UNSEEN_RISKIEST_OF_FEW = view(
    [[1.0, 9.0], [2.0, 8.0], [1.5, 7.0]],
    [[True, False], [True, False], [True, False]],
    evaders=np.array([[3.0, 3.0], [1.0, 0.1]]),
)
# To each of two pursuers the riskiest is the evader that only the other sees; one sees none.
SEEN_BY_THE_OTHER = view([[1.0, 9.0], [9.0, 1.0], [9.0, 9.0]], [[1, 0], [0, 1], [0, 0]])
# The least risky evader, which a least total would take, is out of sight of both.
UNSEEN_LEAST_RISKY = view([[0.0, 5.0], [0.0, 6.0]], [[False, True], [False, True]])
NOTHING_IN_SIGHT = view([[1.0, 2.0], [3.0, 4.0]], [[False, False], [False, False]])


@pytest.mark.parametrize("extra", ["stay", "riskiest"])
@pytest.mark.parametrize("rule", ASSIGNMENT_RULES)
@given(seen=views)
@example(seen=UNSEEN_RISKIEST)
@example(seen=UNSEEN_RISKIEST_OF_FEW)
@example(seen=SEEN_BY_THE_OTHER)
@example(seen=UNSEEN_LEAST_RISKY)
@example(seen=NOTHING_IN_SIGHT)
def test_nobody_is_sent_after_an_evader_out_of_sight(rule, extra, seen):
    targets = ASSIGNMENT_RULES[rule](seen._replace(extra=extra))
    assert targets.shape == (len(seen.risk),)
    assert all(j == -1 or seen.visible[i, j] for i, j in enumerate(targets))


# In print, a pursuer is extra only where pursuers outnumber all evaders, seen or not.
@pytest.mark.parametrize(
    "rule", [rule for rule in ASSIGNMENT_RULES if rule not in ("stay", "borda_printed")]
)
@given(seen=views)
@example(seen=UNSEEN_RISKIEST)
@example(seen=UNSEEN_RISKIEST_OF_FEW)
@example(seen=SEEN_BY_THE_OTHER)
@example(seen=UNSEEN_LEAST_RISKY)
def test_with_none_to_stay_whoever_sees_an_evader_goes_after_one(rule, seen):
    targets = ASSIGNMENT_RULES[rule](seen._replace(extra="riskiest"))
    assert ((targets >= 0) == seen.visible.any(axis=1)).all()


@pytest.mark.parametrize("maximise", [False, True])
@given(seen=views)
@example(seen=UNSEEN_RISKIEST)
@example(seen=UNSEEN_RISKIEST_OF_FEW)
@example(seen=SEEN_BY_THE_OTHER)
@example(seen=UNSEEN_LEAST_RISKY)
@example(seen=NOTHING_IN_SIGHT)
def test_matching_is_the_best_of_all_matchings(maximise, seen):
    n, m = seen.risk.shape
    best = None
    for columns in permutations([*range(m), *([-1] * n)], n):
        pairs = [(i, j) for i, j in enumerate(columns) if j >= 0]
        if all(seen.visible[i, j] for i, j in pairs):
            total = sum(seen.risk[i, j] for i, j in pairs)
            # As many pairs as possible first, then the total.
            value = (len(pairs), total if maximise else -total)
            best = value if best is None else max(best, value)
    targets = match_pairs(seen.risk, seen.visible, maximise=maximise)
    pairs = [(i, j) for i, j in enumerate(targets) if j >= 0]
    total = sum(seen.risk[i, j] for i, j in pairs)
    assert len({j for _, j in pairs}) == len(pairs)
    assert best is not None
    assert len(pairs) == best[0]
    assert (total if maximise else -total) == pytest.approx(best[1])


def test_hungarian_pairs_each_pursuer_with_its_least_risk_or_its_greatest():
    seen = view([[1, 5], [2, 9]])
    assert ASSIGNMENT_RULES["hungarian"](seen).tolist() == [1, 0]
    assert ASSIGNMENT_RULES["hungarian_max"](seen).tolist() == [0, 1]


def test_extra_pursuers_stay_or_take_the_riskiest_evader_they_see():
    risk = [[1, 5], [2, 9], [3, 4]]
    assert ASSIGNMENT_RULES["hungarian"](view(risk)).tolist() == [0, -1, 1]
    assert ASSIGNMENT_RULES["hungarian"](view(risk, extra="riskiest")).tolist() == [0, 1, 1]
    blind = [[True, True], [False, False], [True, True]]
    assert ASSIGNMENT_RULES["hungarian"](view(risk, blind, extra="riskiest")).tolist() == [0, -1, 1]


def test_with_fewer_pursuers_than_evaders_every_pursuer_has_one():
    targets = ASSIGNMENT_RULES["hungarian"](view([[3, 1, 2], [3, 2, 1]]))
    assert targets.tolist() == [1, 2]


def test_an_evader_that_nobody_sees_is_nobodys():
    targets = ASSIGNMENT_RULES["hungarian"](view([[0, 7], [0, 8]], [[False, True], [False, True]]))
    assert sorted(targets.tolist()) == [-1, 1]


def test_borda_points_by_hand():
    # Rankings 2 > 0 > 1 and 0 > 2 > 1, with 2, 1 and 0 points for the places.
    risk = np.array([[5.0, 1.0, 9.0], [8.0, 2.0, 3.0]])
    assert borda_scores(risk, np.ones((2, 3), bool)).tolist() == [3.0, 0.0, 3.0]
    # The second pursuer does not see evader 0: it ranks 2 > 1 only.
    ranked = np.array([[True, True, True], [False, True, True]])
    assert borda_scores(risk, ranked).tolist() == [1.0, 1.0, 4.0]
    # Where it sees evader 2 only, neither of the others gets the point of the second place.
    ranked = np.array([[True, True, True], [False, False, True]])
    assert borda_scores(risk, ranked).tolist() == [1.0, 0.0, 4.0]


def test_borda_assigns_by_score_both_ways():
    # Everyone ranks 0 > 1 > 2. One pursuer: the least score is evader 2, the greatest evader 0.
    risk = [[3.0, 2.0, 1.0]]
    assert ASSIGNMENT_RULES["borda_min"](view(risk)).tolist() == [2]
    assert ASSIGNMENT_RULES["borda_max"](view(risk)).tolist() == [0]


def test_printed_algorithm_sends_an_extra_pursuer_after_the_least_risky_evader():
    risk = [[3.0, 1.0], [3.0, 1.0], [3.0, 1.0]]
    printed = ASSIGNMENT_RULES["borda_printed"](view(risk))
    corrected = ASSIGNMENT_RULES["borda_min"](view(risk, extra="riskiest"))
    left_over = 2
    assert sorted(printed[:2]) == sorted(corrected[:2]) == [0, 1]
    assert printed[left_over] == 1
    assert corrected[left_over] == 0


def test_printed_algorithm_ranks_evaders_out_of_sight_too():
    # Pursuer 1 sees evader 1 alone, yet in print its view of evader 0 counts: 2 points to 0.
    seen = view([[1.0, 2.0], [5.0, 3.0]], [[True, True], [False, True]])
    everyone = np.ones((2, 2), bool)
    assert borda_scores(seen.risk, everyone).tolist() == [1.0, 1.0]
    assert borda_scores(seen.risk, seen.visible).tolist() == [0.0, 2.0]


def test_baselines():
    visible = [[True, True, False], [False, False, False]]
    positions = {"pursuers": np.zeros((2, 2)), "evaders": np.array([[3.0, 0], [1, 1], [0.1, 0]])}
    seen = view([[9.0, 1.0, 99.0], [1.0, 1.0, 1.0]], visible, **positions)
    assert ASSIGNMENT_RULES["own_riskiest"](seen).tolist() == [0, -1]
    assert ASSIGNMENT_RULES["nearest"](seen).tolist() == [1, -1]
    assert ASSIGNMENT_RULES["stay"](seen).tolist() == [-1, -1]


def test_lots_are_fair_repeatable_and_kept_while_the_view_lasts():
    risk = np.ones((1, 3))
    visible = [[True, False, True]]
    draws = [
        ASSIGNMENT_RULES["random_visible"](view(risk, visible, seed=seed))[0]
        for seed in range(2000)
    ]
    assert set(draws) == {0, 2}
    # A fair lot leaves this interval once in a million.
    assert 890 < draws.count(0) < 1110
    again = ASSIGNMENT_RULES["random_visible"](view(2 * risk, visible, seed=7))
    assert again[0] == draws[7]
