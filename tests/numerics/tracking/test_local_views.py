"""Pursuers that know what they see and what neighbours tell them."""

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from sightfield.systems.numerics.tracking.assignment.rules import ASSIGNMENT_RULES, decentralised
from sightfield.systems.numerics.tracking.assignment.team_view import TeamView

# Rules by which a pursuer never looks at what another sees.
SELFISH = ("random_visible", "own_riskiest", "nearest", "stay")

games = st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(0, 10_000))


def random_view(game):
    n, m, seed = game
    rng = np.random.default_rng(seed)
    pursuers, evaders = rng.uniform(0, 4, (n, 2)), rng.uniform(0, 4, (m, 2))
    visible = rng.random((n, m)) < 0.6
    return TeamView(visible, rng.uniform(0, 3, (n, m)), pursuers, evaders, seed=seed)


# Nobody sees evader 0, the riskiest to all and nearest to all; the last hears nobody.
UNSEEN_RISKIEST = TeamView(
    visible=np.array([[False, True, True], [False, True, True], [False, False, True]]),
    risk=np.array([[9.0, 1.0, 2.0], [8.0, 2.0, 1.0], [7.0, 6.0, 1.0]]),
    pursuers=np.array([[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]]),
    evaders=np.array([[0.5, 0.1], [2.0, 2.0], [3.0, 2.0]]),
)
# Did the first tell how risky evader 0 is, which it does not see, the printed algorithm, which
# ranks all, would send the other elsewhere.
UNSEEN_BY_ONE = TeamView(
    visible=np.array([[False, True, True], [True, True, True]]),
    risk=np.array([[1.0, 3.0, 2.0], [2.0, 3.0, 1.0]]),
    pursuers=np.array([[0.0, 0.0], [1.0, 0.0]]),
    evaders=np.array([[0.5, 0.1], [2.0, 2.0], [3.0, 2.0]]),
)


@pytest.mark.parametrize("name", [name for name in ASSIGNMENT_RULES if name != "borda_printed"])
@given(game=games)
def test_when_all_hear_all_there_might_as_well_be_a_centre(name, game):
    view = random_view(game)
    assert (
        decentralised(ASSIGNMENT_RULES[name], 6.0)(view).tolist()
        == ASSIGNMENT_RULES[name](view).tolist()
    )


@pytest.mark.parametrize("name", SELFISH)
@given(game=games, radio_range=st.floats(0, 3))
def test_pursuers_for_themselves_need_no_radio(name, game, radio_range):
    view = random_view(game)
    assert (
        decentralised(ASSIGNMENT_RULES[name], radio_range)(view).tolist()
        == ASSIGNMENT_RULES[name](view).tolist()
    )


@pytest.mark.parametrize("name", ASSIGNMENT_RULES)
@given(view=games.map(random_view), radio_range=st.floats(0, 4))
@example(view=UNSEEN_RISKIEST, radio_range=0.0)
@example(view=UNSEEN_RISKIEST, radio_range=1.0)
@example(view=UNSEEN_BY_ONE, radio_range=1.0)
@example(view=UNSEEN_RISKIEST._replace(extra="riskiest"), radio_range=4.0)
def test_what_nobody_tells_makes_no_difference(name, view, radio_range):
    rule = decentralised(ASSIGNMENT_RULES[name], radio_range)
    before = rule(view)
    assert all(j == -1 or view.visible[i, j] for i, j in enumerate(before))
    for i in range(len(before)):
        gaps = np.hypot(*(view.pursuers - view.pursuers[i]).T)
        others = view._replace(visible=view.visible.copy(), risk=view.risk.copy())
        others.visible[gaps > radio_range] ^= True
        others.risk[gaps > radio_range] += 5.0
        others.risk[~view.visible] += 7.0
        assert rule(others)[i] == before[i]


def test_out_of_earshot_two_go_for_the_same_evader():
    view = TeamView(
        visible=np.ones((2, 2), bool),
        risk=np.array([[1.0, 2.0], [1.0, 9.0]]),
        pursuers=np.array([[0.0, 0.0], [3.0, 0.0]]),
        evaders=np.array([[1.0, 1.0], [2.0, 1.0]]),
    )
    assert decentralised(ASSIGNMENT_RULES["hungarian"], 2.9)(view).tolist() == [0, 0]
    assert decentralised(ASSIGNMENT_RULES["hungarian"], 3.0)(view).tolist() == [1, 0]


def test_what_a_neighbour_heard_from_others_is_not_passed_on():
    # Three in a row, each hearing the next: the ends do not know of each other.
    view = TeamView(
        visible=np.ones((3, 3), bool),
        risk=np.array([[1.0, 2.0, 3.0], [2.0, 1.0, 3.0], [1.0, 3.0, 2.0]]),
        pursuers=np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]),
        evaders=np.zeros((3, 2)),
    )
    assert decentralised(ASSIGNMENT_RULES["hungarian"], 1.0)(view).tolist() == [0, 1, 0]
    assert decentralised(ASSIGNMENT_RULES["hungarian"], 2.0)(view).tolist() == [0, 1, 2]
