"""Solves one value function in a process of its own, as its peer does.

The job is JSON from standard input: `step` of the grid [turning radii], `goal`, `tolerance`,
`states`. The answer has the `times` of the states and what is `interpolated` there (null:
unreachable), the CPU time of the solution without compilation, that of looking one time up, the CPU
times of its passes [s], the peak memory of the process and what of it there was before the solution
[MB], and the numbers of nodes, controls and passes.
"""

import json
import math
import resource
import sys
import time

import numpy as np

from sightfield.systems.numerics.planning.arc_words.words import control_set
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid, is_mirrored
from sightfield.systems.numerics.planning.value_function.solve import POLISH, solve_value_function
from sightfield.systems.numerics.planning.value_function.sweeps import step_multiples


def peak() -> float:
    """Of this process so far [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def without_infinity(times: np.ndarray) -> list[float | None]:
    """JSON has no infinity."""
    return [each if math.isfinite(each) else None for each in times.tolist()]


def main() -> None:
    """Read, compile, solve, answer."""
    job = json.load(sys.stdin)
    goal = Goal(state=tuple(job["goal"]), tolerance=tuple(job["tolerance"]))
    grid = StateGrid.of_step(job["step"], goal.state[:2])
    states = np.array(job["states"])
    # Compiles, or loads what was compiled before.
    solve_value_function(Trailer(), goal, StateGrid.of_step(1.0, goal.state[:2])).time_to_go(states)
    before = peak()
    passes = []
    began = time.process_time()
    value = solve_value_function(
        Trailer(), goal, grid, progress=lambda *_: passes.append(time.process_time())
    )
    ended = time.process_time()
    times = value.time_to_go(states)
    looked_up = time.process_time()
    theta_count = grid.theta_count
    rows = theta_count // 2 + 1 if is_mirrored(grid, goal) else theta_count
    json.dump(
        {
            "times": without_infinity(times),
            "interpolated": without_infinity(value.interpolated(states)),
            "cpu_seconds": ended - began,
            "look_up_seconds": (looked_up - ended) / len(states),
            "pass_seconds": np.diff(passes).tolist(),
            "peak_megabytes": peak(),
            "megabytes_before": before,
            "nodes": math.prod(grid.shape),
            "computed_nodes": math.prod(grid.shape) // theta_count * rows,
            "controls": len(control_set(Trailer())) * len(step_multiples(grid, cubic=POLISH > 0)),
            "polish": POLISH,
            "warnings": list(value.warnings),
        },
        sys.stdout,
    )


main()
