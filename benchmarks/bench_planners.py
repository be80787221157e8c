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

# One that is backed up for fifty turning radii; a long one, seventeen times as far away as a table
# reaches; and one that swings in where no car does. Where from, where to, the box's half width [m],
# and the best of the minimum-time programme from 60 or 100 seeds drawn at random [s]. The tests ask
# others, which take less time.
HARD = [
    (
        Trailer(speed=0.515, turn_rate=0.282, length=5.94, hitch_offset=0.886, reverse=True),
        ((-80.7, -46.4, 3.05, -0.685), (5.6, -4.24, -1.98, 0.0), 0.365),
        185.875,
    ),
    (
        Trailer(speed=0.331, turn_rate=0.47, length=2.44, hitch_offset=0.365),
        ((93.8, 18.4, 0.883, -1.39), (6.58, -8.43, 0.319, 0.0), 0.141),
        310.576,
    ),
    (
        Trailer(speed=0.62532, turn_rate=0.56967, length=2.2549, hitch_offset=0.50804),
        ((-18.978, -10.193, -2.4343, -0.99893), (-0.43168, 5.8289, 2.5823, 0.0), 0.21954),
        47.5955,
    ),
]


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


def test_polished_trajectories_where_words_are_drawn():
    """Beside the best of many seeds drawn at random."""
    losses, seconds = [], []
    for cart, (start, place, width), best in HARD:
        goal = Goal(state=place, tolerance=(width, width, 0.251, 0.251))
        began = time.process_time()
        plan = plan_polished(cart, start, goal)
        seconds.append(time.process_time() - began)
        losses.append(plan.time / best - 1 if plan.converged else np.inf)
    print(
        f"\npolished trajectories of {len(HARD)} hard questions, relative to the best of random "
        f"seeds: {', '.join(f'{loss:+.1e}' for loss in losses)}; "
        f"{', '.join(f'{each:.0f}' for each in seconds)} CPU s"
    )
