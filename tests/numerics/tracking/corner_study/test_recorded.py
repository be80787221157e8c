"""The corner game, as it is solved on grids and played out, is as it was recorded."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.corner_study.best_response import (
    PURSUERS,
    pursuer_direction,
    response_value,
    solve_best_response,
)
from sightfield.systems.numerics.tracking.corner_study.game_solution import solve_corner_game
from sightfield.systems.numerics.tracking.corner_study.moves import (
    corner_grid,
    edge_distance,
    evader_move,
    growth,
    look_up,
    pursuer_move,
    round_corner,
)
from sightfield.systems.numerics.tracking.corner_study.play import play_out

ALPHA, RATIO = 1.1, 0.43


@pytest.fixture(scope="module")
def game():
    """The values of the game on a coarse grid."""
    return solve_corner_game(ALPHA, nodes=9, directions=20)


def test_a_solution_is_as_recorded(game, as_recorded):
    as_recorded(game, relative=1e-5)
    as_recorded(solve_corner_game(2.3, nodes=5, directions=7, tolerance=0.02), "few", relative=1e-5)
    as_recorded([game.grid.shape, game.grid.gap], "grid")


@pytest.mark.parametrize("pursuer", PURSUERS)
def test_a_best_response_is_as_recorded(pursuer, as_recorded):
    values = solve_best_response(pursuer, ALPHA, RATIO, nodes=7, directions=14)
    as_recorded(values, relative=1e-5)


def test_moves_and_values_after_them_are_as_recorded(game, as_recorded):
    rng, found = np.random.default_rng(1), {}
    for _ in range(300):
        alpha = rng.uniform(0.4, 2.7)
        phi_p, phi_e = rng.uniform(alpha - np.pi, -0.01), rng.uniform(alpha - np.pi, np.pi)
        rho, step = rng.uniform(0.02, 1.9), rng.uniform(0.05, 0.7)
        turn, away = rng.uniform(-np.pi, np.pi, 2)
        u, w = (np.array([np.cos(angle), np.sin(angle)]) for angle in (turn, away))
        phi, psi = rng.uniform(ALPHA - np.pi, -0.02), rng.uniform(ALPHA - np.pi, np.pi)
        state = phi, psi, rho, *u, int(rng.integers(-2, 20)), 20, step, ALPHA
        spacing = game.grid.phi_p[1] - game.grid.phi_p[0]
        for name, value in {
            "pursuer": pursuer_move(phi_p, *u, step, alpha),
            "evader": evader_move(phi_e, rho, *w, step, alpha),
            "round": round_corner(phi_e, rho, step),
            "edge": edge_distance(phi_e, rho),
            "growth": growth(rng.normal(), 1.4),
            "look up": look_up(game.lead, phi, psi, 1.3 * rho, spacing, game.grid.rho[1]),
            "directions": [
                pursuer_direction(kind, 1.0, phi_p, RATIO * rho, phi_e, alpha, RATIO)
                for kind in PURSUERS.values()
            ],
            "lead": response_value(game.lead, *state, game.grid.rho[1], False),
            "time": response_value(game.time, *state, game.grid.rho[1], True),
        }.items():
            found.setdefault(name, []).append(np.ravel(value))
    as_recorded({name: np.array(values) for name, values in found.items()}, relative=1e-5)


@pytest.mark.parametrize("pursuer", ["margin", "table", "chase"])
def test_what_is_played_out_is_as_recorded(pursuer, game, as_recorded):
    rng = np.random.default_rng(2)
    phi_p = rng.uniform(ALPHA - np.pi, -0.05, 60)
    phi_e = rng.uniform(ALPHA - np.pi, np.pi + phi_p)
    states = np.column_stack([phi_p, phi_e, rng.uniform(0.05, 1.5, 60)])
    played = {
        "plain": play_out(pursuer, states, ALPHA, RATIO, step=0.03, horizon=2.0),
        "deep": play_out(pursuer, states, ALPHA, RATIO, step=0.03, horizon=2.0, slack=0.07),
    }
    for aim in ("lead", "time"):
        played[aim] = play_out(pursuer, states, ALPHA, RATIO, game, aim, 0.03, 2.0)
    as_recorded(played, relative=1e-4)


@pytest.mark.parametrize("alpha", [0.0, np.pi, -0.1, 3.2])
def test_a_wedge_is_sharper_than_a_wall(alpha):
    for solve in (
        lambda: corner_grid(alpha, 5),
        lambda: play_out("margin", np.array([[-1.0, 0.0, 1.0]]), alpha, 0.5),
    ):
        with pytest.raises(InvalidInput, match="`alpha` must lie in"):
            solve()


@pytest.mark.parametrize("nodes", [3, 4, 6])
def test_nodes_are_odd_and_at_least_five(nodes):
    with pytest.raises(InvalidInput, match="`nodes` must be odd and at least 5"):
        corner_grid(1.0, nodes)
    assert corner_grid(1.0, 5).shape[0] == 5


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"a": 0.0}, r"`a` must lie in \(0, 1\)"),
        ({"a": 1.0}, r"`a` must lie in \(0, 1\)"),
        ({"step": 0.0}, r"`step` must lie in \(0, 1\)"),
        ({"step": 1.0}, r"`step` must lie in \(0, 1\)"),
        ({"slack": -0.1}, "`slack` must be zero or positive"),
        ({"aim": "both"}, "`aim` must be one of lead, time"),
        ({"pursuer": "none"}, "`pursuer` must be one of"),
        ({"states": np.array([[-1.0, 0.0, 1.0], [0.0, 0.0, 1.0]])}, "`states` must have phi_p < 0"),
    ],
)
def test_a_play_that_cannot_be_is_refused(options, message):
    usual = {"pursuer": "margin", "states": np.array([[-1.0, 0.0, 1.0]]), "alpha": 1.0, "a": 0.5}
    with pytest.raises(InvalidInput, match=message):
        play_out(**usual | options)


@pytest.mark.parametrize("a", [0.0, 1.0])
def test_an_evader_that_stands_or_keeps_up_has_no_best_response(a):
    with pytest.raises(InvalidInput, match=r"`a` must lie in \(0, 1\)"):
        solve_best_response("margin", 1.0, a, 5, 4)
