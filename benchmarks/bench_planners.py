"""The extremal solver beside CasADi, on the sweep of the thesis's Figure 3.10."""

import time

import numpy as np
import pytest

from sightfield.diagrams.planning.sweep import RATIOS, RISE
from sightfield.systems.numerics.planning.extremals.planner import plan_by_extremals
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.trailer import Trailer

pytestmark = pytest.mark.benchmarks

COUNT = 51


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
