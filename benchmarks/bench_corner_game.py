"""The corner game's closed forms against its numerical solution, and its fields played out.

Slow studies rather than timings. SIGHTFIELD_CORNER_NODES=81 adds a finer grid to the first
(ten minutes a corner), SIGHTFIELD_CORNER_STATES=1000 shortens the second.
"""

import math
import os

import numpy as np
import pytest

from sightfield.systems.numerics.tracking.corner_game import escape_time, margins
from sightfield.systems.numerics.tracking.corner_study.best_response import (
    PURSUERS,
    solve_best_response,
)
from sightfield.systems.numerics.tracking.corner_study.game_solution import solve_corner_game
from sightfield.systems.numerics.tracking.corner_study.play import play_out

pytestmark = pytest.mark.benchmarks

CORNERS = {"pi/2": math.pi / 2, "pi/3": math.pi / 3}
NODES = [11, 21, 41] + [int(n) for n in os.environ.get("SIGHTFIELD_CORNER_NODES", "").split()]
STATES = int(os.environ.get("SIGHTFIELD_CORNER_STATES", "6000"))

# The evader's speed matters to none of the fields beyond e / a; `chase` alone looks at e itself.
A = 0.5
STEP = 0.005

# An evader that comes back into sight before it is this far behind the sight ray, in units of
# a r_p, has not got away, leniently judged.
SLACK = 0.02


def closed_form(states, alpha):
    """M1 / a and T* v_p / r_p of states (phi_p, phi_e, rho)."""
    m1 = [margins(1.0, p, r, e, alpha, 1.0)[0] for p, e, r in states]
    time = [escape_time(1.0, p, r, e, alpha, 1.0, 1.0) for p, e, r in states]
    return np.array(m1), np.array(time)


@pytest.mark.parametrize("corner", CORNERS)
def test_grids_converge_to_the_closed_form(corner):
    alpha = CORNERS[corner]
    print(f"\nalpha = {corner}: losing set against Region 1, time against T*")
    for nodes in NODES:
        solution = solve_corner_game(alpha, nodes)
        grid = solution.grid
        free = np.maximum(grid.phi_e, alpha - math.pi)
        phi_p, phi_e, rho = np.meshgrid(grid.phi_p, free, grid.rho, indexing="ij")
        seen = (grid.gap[:, :, None] > 0) & (phi_p < 0) & (rho > 0)
        m1, time = closed_form(np.column_stack([phi_p[seen], phi_e[seen], rho[seen]]), alpha)
        lost, area = m1 < 0, rho[seen]
        differs = (solution.lead[seen] < 0) != lost
        error = np.abs(solution.time[seen] - time)[lost]
        print(
            f"  {'x'.join(map(str, grid.shape)):12s}"
            f" symmetric difference {area[differs].sum() / area[lost].sum():.2%},"
            f" furthest {np.abs(m1[differs]).max() / grid.step:.2f} steps from the barrier;"
            f" time, mean error {error.mean() / time[lost].mean():.2%}"
        )
        assert solution.converged


@pytest.mark.parametrize("corner", CORNERS)
def test_fields_are_played_out(corner):
    alpha = CORNERS[corner]
    random = np.random.default_rng(1)
    phi_p = random.uniform(alpha - math.pi, 0, STATES)
    phi_e = random.uniform(alpha - math.pi, math.pi + phi_p)
    states = np.column_stack([phi_p, phi_e, random.uniform(0, 2, STATES)])
    m1, time = closed_form(states, alpha)
    gap = math.pi + phi_p - phi_e
    winnable = m1 >= 0
    contested = winnable & (states[:, 2] < 1.5) & (gap < math.pi / 2)
    left = contested & (phi_p < -math.pi / 2)
    timed = (m1 < 0) & (time > 10 * STEP)
    game = solve_corner_game(alpha, 21)
    print(
        f"\nalpha = {corner}: {STATES} states in sight, {winnable.sum()} winnable,"
        f" {contested.sum()} contested, {left.sum()} of them left of the corner;"
        f" worst of five evaders"
    )
    for pursuer in PURSUERS:
        response = solve_best_response(pursuer, alpha, A, 21)
        evaders = [(None, "lead")]
        evaders += [(values, aim) for values in (game, response) for aim in ("lead", "time")]
        for slack, judged in ((0.0, "strictly"), (SLACK, "leniently")):
            times = [
                play_out(pursuer, states, alpha, A, *evader, STEP, 10.0, slack)
                for evader in evaders
            ]
            worst = np.min(times, axis=0)
            kept, held = np.isinf(worst), worst[timed] / time[timed]
            sharp = f"; left {kept[left].mean():.1%}" if left.any() else ""
            print(
                f"  {pursuer:8s} {judged:9s} keeps {kept[winnable].mean():.2%}"
                f" (contested {kept[contested].mean():.2%}{sharp});"
                f" Region 1 held {held.min():.3f} T* at worst, 1st percentile"
                f" {np.quantile(held, 0.01):.3f}, {np.mean(held < 0.99):.2%} below 0.99"
            )
