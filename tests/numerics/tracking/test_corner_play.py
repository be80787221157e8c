"""Played out, `margin` keeps what can be kept; the thesis's field and simpler rules do not."""

import math

import numpy as np
import pytest
from numba import njit

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.corner_game import REGION_1, escape_time, margins, region
from sightfield.systems.numerics.tracking.corner_study.best_response import (
    PURSUERS,
    pursuer_direction,
    solve_best_response,
)
from sightfield.systems.numerics.tracking.corner_study.game_solution import solve_corner_game
from sightfield.systems.numerics.tracking.corner_study.moves import evader_move, pursuer_move
from sightfield.systems.numerics.tracking.corner_study.play import play_out

A = 0.5
STEP = 0.01
# Nobody here needs as long to get anywhere.
HORIZON = 6.0
CORNERS = {"right-angled": math.pi / 2, "sharp": math.pi / 3}


def random_states(alpha, count, seed=2):
    """States (phi_p, phi_e, rho) with the evader in sight, their M1 / a and T*."""
    random = np.random.default_rng(seed)
    phi_p = random.uniform(alpha - math.pi, 0, count)
    phi_e = random.uniform(alpha - math.pi, math.pi + phi_p)
    rho = random.uniform(0, 1.6, count)
    states = np.column_stack([phi_p, phi_e, rho])
    m1 = np.array([margins(1.0, p, A * r, e, alpha, A)[0] / A for p, e, r in states])
    time = np.array([escape_time(1.0, p, A * r, e, alpha, A, 1.0) for p, e, r in states])
    return states, m1, time


@pytest.fixture(scope="module", params=CORNERS)
def contest(request):
    """A function of a pursuer: when the worst of five evaders takes it out of sight.

    They play the closed form, descend on the two values of the game, and on those of the best
    response to this very pursuer.
    """
    alpha = CORNERS[request.param]
    states, m1, time = random_states(alpha, 300)
    game = solve_corner_game(alpha, 21)

    def play(pursuer):
        evaders = [play_out(pursuer, states, alpha, A, step=STEP, horizon=HORIZON)]
        for values in (game, solve_best_response(pursuer, alpha, A, 11)):
            for aim in ("lead", "time"):
                evaders.append(play_out(pursuer, states, alpha, A, values, aim, STEP, HORIZON))
        return np.min(evaders, axis=0)

    return play, m1, time


def test_no_best_response_beats_margin_where_the_game_says_the_pursuer_wins(contest):
    play, m1, _ = contest
    # Both hold their velocities for a step: a state nearer to the barrier than the evader moves in
    # one (a STEP, and M1 here is in units of a) is not told from one beyond it.
    winnable = m1 > STEP
    assert winnable.sum() > 100
    assert np.isinf(play("margin")[winnable]).all()


def test_margin_holds_sight_as_long_as_the_game_says(contest):
    play, m1, time = contest
    lost = (m1 < 0) & (time > 10 * STEP)
    assert lost.sum() > 50
    assert (play("margin")[lost] > 0.99 * time[lost] - STEP).all()


@pytest.mark.parametrize("pursuer", ["table", "to_star", "turn"])
def test_other_pursuers_lose_what_they_could_keep(contest, pursuer):
    play, m1, time = contest
    worst = play(pursuer)
    winnable = m1 > STEP
    given_away = np.isfinite(worst[winnable])
    shortened = worst[m1 < 0] < 0.9 * time[m1 < 0]
    assert given_away.any() or shortened.any()


def test_at_a_sharp_corner_the_table_gives_games_away():
    alpha = CORNERS["sharp"]
    states, m1, _ = random_states(alpha, 300)
    for pursuer in ("table", "table_up"):
        response = solve_best_response(pursuer, alpha, A, 11)
        lost = np.isfinite(play_out(pursuer, states, alpha, A, response, "time", STEP))
        assert lost[m1 > STEP].mean() > 0.01


@pytest.mark.parametrize("name", CORNERS)
def test_the_closed_form_evader_takes_the_time_the_game_says(name):
    """Against `margin`, and never more, whoever the pursuer is."""
    alpha = CORNERS[name]
    states, m1, time = random_states(alpha, 300)
    lost = (m1 < -STEP) & (time > STEP)
    for pursuer in PURSUERS:
        taken = play_out(pursuer, states[lost], alpha, A, step=0.002)
        assert (taken <= 1.01 * time[lost] + 0.004).all()
    held = play_out("margin", states[lost], alpha, A, step=0.002)
    assert held == pytest.approx(time[lost], rel=0.01, abs=0.004)


def test_nobody_escapes_a_pursuer_in_sight_of_both_edges_at_once():
    # One step short of the star region, the evader far away.
    states = np.array([[-0.5 * STEP, 0.5, 1.0]])
    assert np.isinf(play_out("to_star", states, math.pi / 2, A, step=STEP)).all()


def test_the_evader_rounds_the_corner_in_the_time_it_is_away():
    states = np.array([[-1.0, 0.3, 0.2]])
    assert play_out("stand", states, math.pi / 2, A, step=0.05) == pytest.approx([0.2])


def test_a_glimpse_behind_the_sight_ray_counts_only_without_slack():
    # Grazing at a r_p, the evader runs across the ray; a turning pursuer cannot but trail it.
    states = np.array([[-0.5, math.pi - 0.5, 0.9]])
    alpha = math.pi / 2
    strict = play_out("turn", states, alpha, A, step=STEP)
    assert strict < 0.02
    assert play_out("turn", states, alpha, A, step=STEP, slack=0.5) == math.inf
    # Out of sight for good is out of sight, and since when does not change.
    alone = [play_out("stand", states, alpha, A, step=STEP, slack=slack) for slack in (0, 0.3)]
    assert alone[0] == alone[1]


@njit(cache=True)
def closest_call(kind, state, alpha, a, plan, stride, step):
    """Smallest distance from the evader to the sight ray, its directions being those of a plan."""
    phi_p, phi_e, rho = state
    time, scale, closest = 0.0, 1.0, math.inf
    while scale > 1e-3 and time < 4.0:
        ux, uy = pursuer_direction(kind, 1.0, phi_p, a * rho, phi_e, alpha, a)
        # Relative to the way across the sight ray.
        heading = math.pi + phi_p + 0.5 * math.pi + plan[min(int(time / stride), len(plan) - 1)]
        phi, r, _ = pursuer_move(phi_p, ux, uy, step, alpha)
        psi, q = evader_move(phi_e, rho, math.cos(heading), math.sin(heading), step, alpha)
        if phi == 0.0:
            break
        time += scale * step
        scale *= r
        phi_p, phi_e, rho = phi, psi, q / r
        gap = math.pi + phi_p - phi_e
        closest = min(closest, scale * rho * (math.sin(gap) if gap < 0.5 * math.pi else 1.0))
    return closest


def searched_plan(pursuer, state, alpha, seed):
    """The closest call of the best of many plans, by the cross-entropy method."""
    random = np.random.default_rng(seed)
    middle, spread, closest = np.zeros(8), np.full(8, 1.5), math.inf
    for _ in range(8):
        plans = middle + spread * random.standard_normal((48, 8))
        calls = [closest_call(PURSUERS[pursuer], state, alpha, A, p, 0.15, STEP) for p in plans]
        best = plans[np.argsort(calls)[:6]]
        middle, spread = best.mean(axis=0), best.std(axis=0) + 0.05
        closest = min(closest, *calls)
    return closest


def narrow_wins(alpha, count):
    """States that the pursuer only just wins, half of them near w = 0: the hardest to keep."""
    found = []
    random = np.random.default_rng(4)
    while len(found) < count:
        phi_p, rho = random.uniform(alpha - math.pi, 0), random.uniform(0.3, 1.25)
        gap = random.uniform(0, 0.15 if len(found) % 2 else 2.0)
        phi_e = math.pi + phi_p - gap
        if phi_e > alpha - math.pi:
            m1 = margins(1.0, phi_p, A * rho, phi_e, alpha, A)[0] / A
            if STEP < m1 < 0.15:
                found.append((phi_p, phi_e, rho))
    return found


@pytest.mark.parametrize("name", CORNERS)
def test_no_plan_that_a_search_finds_beats_margin(name):
    alpha = CORNERS[name]
    for seed, state in enumerate(narrow_wins(alpha, 20)):
        assert searched_plan("margin", state, alpha, seed) > 0


def test_the_search_finds_plans_that_beat_the_table():
    alpha = CORNERS["sharp"]
    calls = [searched_plan("table", s, alpha, i) for i, s in enumerate(narrow_wins(alpha, 20))]
    assert min(calls) < -0.05


def test_region_1_is_what_the_states_of_these_tests_call_lost():
    alpha = CORNERS["sharp"]
    states, m1, _ = random_states(alpha, 50)
    for (phi_p, phi_e, rho), margin in zip(states, m1, strict=True):
        assert (region(1.0, phi_p, A * rho, phi_e, alpha, A) == REGION_1) == (margin < 0)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"pursuer": "nobody"}, "pursuer"),
        ({"states": np.array([[0.0, 0.5, 1.0]])}, "states"),
        ({"alpha": 4.0}, "alpha"),
        ({"a": 1.0}, "a"),
        ({"aim": "soon"}, "aim"),
        ({"step": 0.0}, "step"),
        ({"slack": -1.0}, "slack"),
    ],
)
def test_a_play_that_cannot_be_is_refused(change, name):
    arguments = {
        "pursuer": "margin",
        "states": np.array([[-1.0, 0.5, 1.0]]),
        "alpha": 1.0,
        "a": 0.5,
        **change,
    }
    with pytest.raises(InvalidInput, match=f"`{name}` must"):
        play_out(**arguments)
