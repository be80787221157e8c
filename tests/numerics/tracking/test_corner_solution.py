"""The corner game solved on a grid agrees with its closed form, as far as the grid allows."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.tracking.corner_game import escape_time, margins
from sightfield.systems.numerics.tracking.corner_study.best_response import solve_best_response
from sightfield.systems.numerics.tracking.corner_study.game_solution import solve_corner_game
from sightfield.systems.numerics.tracking.corner_study.moves import corner_grid

CORNERS = {"right-angled": math.pi / 2, "sharp": math.pi / 3}


class ClosedForm:
    """M1, T* and |e + a p| at the nodes where the evader is in sight, with a = 1."""

    def __init__(self, grid):
        free = np.maximum(grid.phi_e, grid.alpha - math.pi)
        phi_p, phi_e, rho = np.meshgrid(grid.phi_p, free, grid.rho, indexing="ij")
        seen = np.broadcast_to(grid.gap[:, :, None] > 0, grid.shape) & (phi_p < 0) & (rho > 0)
        self.seen, self.area = seen, rho[seen]
        nodes = np.column_stack([phi_p[seen], rho[seen], phi_e[seen]])
        self.m1 = np.array([margins(1.0, p, r, e, grid.alpha, 1.0)[0] for p, r, e in nodes])
        self.time = np.array([escape_time(1.0, *node, grid.alpha, 1.0, 1.0) for node in nodes])
        p, r, e = nodes.T
        self.w = np.hypot(r * np.cos(e) + np.cos(p), r * np.sin(e) + np.sin(p))
        self.lost = self.m1 < 0


@pytest.fixture(scope="module", params=CORNERS)
def corner(request):
    """A solution of the game, the closed form on its grid, and a coarser solution with its own."""
    alpha = CORNERS[request.param]
    fine, coarse = solve_corner_game(alpha, 21), solve_corner_game(alpha, 11)
    return fine, ClosedForm(fine.grid), coarse, ClosedForm(coarse.grid)


def misjudged(solution, exact):
    """Nodes whose winner differs from the closed form's."""
    return (solution.lead[exact.seen] < 0) != exact.lost


def difference(solution, exact):
    """Area of the misjudged nodes over that of Region 1."""
    return exact.area[misjudged(solution, exact)].sum() / exact.area[exact.lost].sum()


def time_error(solution, exact):
    """|time - T*| over Region 1, [r_p / v_p]."""
    return np.abs(solution.time[exact.seen] - exact.time)[exact.lost]


def test_the_iteration_converges(corner):
    fine, _, coarse, _ = corner
    for solution in (fine, coarse):
        assert solution.converged
        assert solution.residual < 1e-3


def test_the_evader_wins_in_region_1_and_nowhere_else(corner):
    solution, exact, *_ = corner
    assert difference(solution, exact) < 0.03
    # One step of a player, which is one spacing of the grid, is as near to the barrier as the
    # grid can tell.
    assert np.abs(exact.m1[misjudged(solution, exact)]).max() < solution.grid.step


def test_sight_holds_as_long_as_the_closed_form_says(corner):
    solution, exact, *_ = corner
    error = time_error(solution, exact)
    assert error.mean() < 0.012 * exact.time[exact.lost].mean()
    # T* has no limit at w = 0; elsewhere it is right to a step.
    regular = exact.w[exact.lost] > 0.3
    assert error[regular].max() < solution.grid.step


def test_the_errors_shrink_with_the_grid(corner):
    fine, fine_exact, coarse, coarse_exact = corner
    assert difference(fine, fine_exact) < 0.6 * difference(coarse, coarse_exact)
    errors = [time_error(*pair).mean() for pair in ((fine, fine_exact), (coarse, coarse_exact))]
    assert errors[0] < 0.75 * errors[1]


@pytest.mark.parametrize("alpha", [1.0, 2 * math.pi / 3])
def test_angles_that_do_not_divide_the_grid_are_solved_too(alpha):
    solution = solve_corner_game(alpha, 11)
    exact = ClosedForm(solution.grid)
    assert np.abs(exact.m1[misjudged(solution, exact)]).max() < solution.grid.step
    assert time_error(solution, exact).mean() < 0.02 * exact.time[exact.lost].mean()


@pytest.fixture(scope="module")
def response():
    """A function of a pursuer and a corner: the best response to it, and the closed form."""
    solved = {}

    def solve(pursuer, corner):
        if (pursuer, corner) not in solved:
            solution = solve_best_response(pursuer, CORNERS[corner], nodes=15)
            solved[pursuer, corner] = solution, ClosedForm(solution.grid)
        return solved[pursuer, corner]

    return solve


@pytest.mark.parametrize("corner", CORNERS)
def test_no_evader_at_all_beats_margin_where_the_game_says_the_pursuer_wins(response, corner):
    solution, exact = response("margin", corner)
    assert solution.converged
    beaten = (solution.lead[exact.seen] < 0) & ~exact.lost
    # Only where a cell holds both: near w = 0 winning and losing states meet at grazing sight.
    assert exact.w[beaten].max() < 0.5
    assert exact.area[beaten].sum() < 0.02 * exact.area[exact.lost].sum()


def test_no_evader_at_all_escapes_margin_sooner_than_the_game_says(response):
    solution, exact = response("margin", "right-angled")
    early = exact.time - solution.time[exact.seen]
    assert early[exact.lost & (exact.w > 0.3)].max() < solution.grid.step


@pytest.mark.parametrize("pursuer", ["table", "table_up", "to_star", "turn"])
def test_other_pursuers_are_beaten_where_they_need_not_be(response, pursuer):
    solution, exact = response(pursuer, "sharp")
    beaten = (solution.lead[exact.seen] < 0) & ~exact.lost
    assert exact.area[beaten].sum() > 0.05 * exact.area[exact.lost].sum()
    assert exact.m1[beaten & (exact.w > 0.5)].max() > 3 * solution.grid.step


def test_nobody_keeps_sight_standing_still(response):
    solution, exact = response("stand", "sharp")
    assert (solution.lead[exact.seen] < 0).all()


def test_every_sight_ray_passes_through_nodes():
    for alpha in (0.4, math.pi / 2, 2.5):
        grid = corner_grid(alpha, 11)
        exact = math.pi + grid.phi_p[:, None] - grid.phi_e
        assert grid.gap == pytest.approx(exact, abs=1e-12)
        assert (np.count_nonzero(grid.gap == 0, axis=1) == 1).all()
        assert np.abs(grid.rho - 1).min() == pytest.approx(grid.rho[1] / 2)


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ({"alpha": 0.0}, "alpha"),
        ({"alpha": math.pi}, "alpha"),
        ({"alpha": 1.0, "nodes": 10}, "nodes"),
        ({"alpha": 1.0, "nodes": 3}, "nodes"),
    ],
)
def test_a_grid_that_cannot_be_is_refused(arguments, name):
    with pytest.raises(InvalidInput, match=f"`{name}` must"):
        solve_corner_game(**arguments)


@pytest.mark.parametrize(
    ("arguments", "name"), [(("nobody", 1.0), "pursuer"), (("margin", 1.0, 1.0), "a")]
)
def test_a_response_to_nobody_is_refused(arguments, name):
    with pytest.raises(InvalidInput, match=f"`{name}` must"):
        solve_best_response(*arguments)
