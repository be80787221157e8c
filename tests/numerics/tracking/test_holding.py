"""A team holds its assignment until there is a reason to leave it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.assignment.holding import (
    COST,
    HOLDS,
    hold_or_choose,
    is_broken,
)
from sightfield.systems.numerics.tracking.assignment.rules import ASSIGNMENT_RULES
from sightfield.systems.numerics.tracking.assignment.team_view import TeamView


def view_of(visible, risk=None):
    visible = np.array(visible, dtype=bool)
    n, m = visible.shape
    risk = np.ones((n, m)) if risk is None else np.array(risk, dtype=float)
    return TeamView(visible, risk, np.zeros((n, 2)), np.zeros((m, 2)))


def always(*targets):
    """A rule that has one answer."""
    return lambda view: np.array(targets)


ALL = [[1, 1], [1, 1]]


class TestBroken:
    @pytest.mark.parametrize(
        ("visible", "held", "broken"),
        [
            # Each sees its own.
            (ALL, [0, 1], False),
            ([[1, 0], [0, 1]], [0, 1], False),
            # The first has lost its own, whoever else sees it.
            ([[0, 1], [1, 1]], [0, 1], True),
            # Both share one while the other goes without, and one could go.
            (ALL, [0, 0], True),
            ([[1, 0], [1, 1]], [0, 0], True),
            # Both share one, and neither sees the other.
            ([[1, 0], [1, 0]], [0, 0], False),
            # One is idle, and sees one that nobody has.
            (ALL, [0, -1], True),
            # One is idle, and sees only one that has its pursuer.
            ([[1, 0], [1, 0]], [0, -1], False),
            # Nobody sees anybody.
            ([[0, 0], [0, 0]], [-1, -1], False),
            # More pursuers than evaders: all are looked after.
            ([[1], [1], [1]], [0, -1, -1], False),
            ([[1], [1], [1]], [0, 0, 0], False),
            # One that has its own alone cannot be spared, though it sees another.
            ([[1, 1]], [0], False),
        ],
    )
    def test_by_cases(self, visible, held, broken):
        assert is_broken(np.array(visible, dtype=bool), np.array(held)) == broken

    @given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 4), m=st.integers(1, 4), data=st.data())
    def test_it_is_no_matter_of_numbers(self, seed, n, m, data):
        rng = np.random.default_rng(seed)
        visible = rng.random((n, m)) < 0.6
        held = np.array([rng.choice([-1, *np.flatnonzero(row)]) for row in visible])
        held[rng.random(n) < 0.1] = rng.integers(m)
        ours = data.draw(st.permutations(range(n)))
        theirs = data.draw(st.permutations(range(m)))
        renamed = np.array([-1 if held[i] < 0 else theirs.index(held[i]) for i in ours])
        assert is_broken(visible[ours][:, theirs].copy(), renamed) == is_broken(visible, held)


class TestHolds:
    @pytest.mark.parametrize("hold", HOLDS)
    def test_at_the_start_the_rule_decides(self, hold):
        assert hold_or_choose(view_of(ALL), None, always(1, 0), hold).tolist() == [1, 0]

    @pytest.mark.parametrize("hold", HOLDS)
    def test_what_is_broken_is_chosen_anew(self, hold):
        view = view_of([[0, 1], [1, 1]])
        assert hold_or_choose(view, np.array([0, 1]), always(1, 0), hold).tolist() == [1, 0]

    def test_without_a_hold_the_rule_decides_always(self):
        chosen = hold_or_choose(view_of(ALL), np.array([0, 1]), always(1, 0), "none")
        assert chosen.tolist() == [1, 0]

    @pytest.mark.parametrize("hold", ["until_lost", "cost"])
    def test_what_is_not_broken_is_held_against_a_rule_that_is_indifferent(self, hold):
        chosen = hold_or_choose(view_of(ALL), np.array([0, 1]), always(1, 0), hold)
        assert chosen.tolist() == [0, 1]

    def test_until_lost_does_not_ask_the_rule(self):
        def never(view):
            raise AssertionError("asked")

        chosen = hold_or_choose(view_of(ALL), np.array([0, 1]), never, "until_lost")
        assert chosen.tolist() == [0, 1]

    @pytest.mark.parametrize("share", [0.9 * COST, 1.1 * COST])
    @pytest.mark.parametrize("better", [True, False])
    def test_cost_changes_when_the_total_moves_by_more_than_a_share(self, share, better):
        # The greater total is 10 per metre, the lesser is that share below it.
        held, other = (10.0, 10.0 * (1 - share))[:: 1 if better else -1]
        risk = [[0.5 * held, 0.5 * other], [0.5 * other, 0.5 * held]]
        chosen = hold_or_choose(view_of(ALL, risk), np.array([0, 1]), always(1, 0), "cost")
        assert chosen.tolist() == ([1, 0] if share > COST else [0, 1])


@pytest.mark.parametrize("hold", ["until_lost", "cost"])
@pytest.mark.parametrize("rule", ["hungarian", "hungarian_max", "borda_max"])
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 4), m=st.integers(1, 4))
def test_whoever_is_held_is_in_sight_and_nobody_idle_could_help(hold, rule, seed, n, m):
    rng = np.random.default_rng(seed)
    held = None
    for _ in range(20):
        visible = rng.random((n, m)) < 0.7
        view = view_of(visible, rng.uniform(0.1, 5.0, (n, m)))
        before, held = held, hold_or_choose(view, held, ASSIGNMENT_RULES[rule], hold)
        for i in np.flatnonzero(held >= 0):
            assert visible[i, held[i]]
        if before is not None and hold == "until_lost" and not np.array_equal(before, held):
            assert is_broken(visible, before)
        # An idle pursuer sees only evaders that others look after.
        for i in np.flatnonzero(held < 0):
            assert np.isin(np.flatnonzero(visible[i]), held).all()
