"""The extremal solver and polished trajectories beside CasADi."""

import time

import numpy as np
import pytest

from sightfield.diagrams.planning.sweep import RATIOS, RISE
from sightfield.diagrams.planning.verdict import resimulate
from sightfield.systems.numerics.planning.extremals.planner import plan_by_extremals
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.planners.polished import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer

pytestmark = pytest.mark.benchmarks

# Ratios of the sweep.
COUNT = 51
# Random starts that nothing was tuned on.
SEED, STARTS = 20142, 200


@pytest.mark.parametrize("beta_width", [0.0, THESIS_TOLERANCE[3]])
def test_extremals_on_the_sweep(beta_width):
    goal = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=(0.0, 0.0, 0.0, beta_width))
    starts = [(-ratio * RISE, -RISE, 0.0, 0.0) for ratio in np.linspace(*RATIOS, COUNT)]
    plan_by_extremals(Trailer(), starts[0], goal)
    ours, peers, seconds = [], [], []
    for start in starts:
        began = time.process_time()
        plan = plan_by_extremals(Trailer(), start, goal)
        seconds.append(time.process_time() - began)
        ours.append(plan.time)
        peers.append(plan_by_casadi(Trailer(), start, goal).time)
    differences = np.array(ours) / np.array(peers) - 1
    print(
        f"\nextremals on Figure 3.10's sweep, |beta| <= {beta_width:g} at the end, {COUNT} starts: "
        f"from {differences.min():+.1e} to {differences.max():+.1e} of CasADi's time; "
        f"{np.median(seconds):.3f} CPU s, at most {max(seconds):.3f}"
    )


@pytest.mark.parametrize("tolerance", [THESIS_TOLERANCE, (0.0, 0.0, 0.0, 0.0)])
def test_polished_trajectories(tolerance, random_starts):
    starts = random_starts(SEED, STARTS, tolerance)
    # The first time round compiles, solves the table that all share, and builds programmes.
    plans = [plan_polished(Trailer(), state, starts.goal) for state in starts.states]
    seconds = []
    for state in starts.states:
        began = time.process_time()
        plan_polished(Trailer(), state, starts.goal)
        seconds.append(time.process_time() - began)
    times = np.array([plan.time for plan in plans])
    misses = [resimulate(Trailer(), plan.path, starts.goal).violation for plan in plans]
    losses = times / np.minimum(times, starts.times) - 1
    print(
        f"\npolished trajectories, goal within {tolerance}, {STARTS} starts: within 1e-3 of the "
        f"best known time from {np.mean(losses <= 1e-3):.1%}, quicker than CasADi from "
        f"{np.mean(times < starts.times * (1 - 1e-5)):.1%}; {np.median(seconds):.3f} CPU s, "
        f"at most 0.1 for {np.mean(np.array(seconds) <= 0.1):.1%}, at most {max(seconds):.3f}; "
        f"driven, they end within {max(misses):.1e} of the goal"
    )
