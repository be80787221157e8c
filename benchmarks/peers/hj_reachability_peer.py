"""Times to reach a box by hj_reachability, on one core; runs in an environment of its own.

The job is JSON: `low`, `high`, `shape` of the grid in x, y, theta, beta (angles periodic, `high`
left out there), `goal`, `tolerance` (half-widths of the box), `states`, and `horizon` [s]. The
answer has the time at which the backward reachable tube first holds each state (null: not within
the horizon), the CPU time of the solution and that of its compilation [s], and the peak memory of
the process [MB].

The tube is V(t, q) <= 0, with V(0, q) the signed distance from the box in the largest norm, and
V falls in time, solved at accuracy "very_high" (WENO5, third-order Runge-Kutta). The time is looked
for every few of the solver's own steps, and interpolated in between.
"""

import json
import os
import resource
import sys
import time

# One core and no other threads, before JAX starts any.
os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
os.environ["JAX_PLATFORMS"] = "cpu"

import hj_reachability as hj  # noqa: E402  (reads the flags)
import jax  # noqa: E402  (reads the flags)
import jax.numpy as jnp  # noqa: E402  (reads the flags)
import numpy as np  # noqa: E402  (starts threads, as BLAS does)

# Steps of the solver between two looks at the states.
STEPS = 3


class TractorTrailer(hj.ControlAndDisturbanceAffineDynamics):
    """x' = cos(theta), y' = sin(theta), theta' = omega, beta' = omega - sin(beta), |omega| <= 1."""

    def __init__(self):
        super().__init__(
            "min",
            "max",
            hj.sets.Box(jnp.array([-1.0]), jnp.array([1.0])),
            hj.sets.Box(jnp.zeros(1), jnp.zeros(1)),
        )

    def open_loop_dynamics(self, state, time):
        """Rates without turning."""
        _, _, theta, beta = state
        return jnp.array([jnp.cos(theta), jnp.sin(theta), 0.0, -jnp.sin(beta)])

    def control_jacobian(self, state, time):
        """What omega adds."""
        return jnp.array([[0.0], [0.0], [1.0], [1.0]])

    def disturbance_jacobian(self, state, time):
        """Nothing disturbs."""
        return jnp.zeros((4, 1))


def distance(grid, goal, tolerance):
    """From the box, in the largest norm; negative inside."""
    gaps = jnp.abs(grid.states - jnp.array(goal))
    gaps = gaps.at[..., 2:].set(jnp.abs(jnp.mod(gaps[..., 2:] + np.pi, 2 * np.pi) - np.pi))
    return jnp.max(gaps - jnp.array(tolerance), -1)


def main() -> None:
    """Read, compile, solve, answer."""
    job = json.load(sys.stdin)
    grid = hj.Grid.from_lattice_parameters_and_boundary_conditions(
        hj.sets.Box(np.array(job["low"]), np.array(job["high"])),
        tuple(job["shape"]),
        periodic_dims=(2, 3),
    )
    settings = hj.SolverSettings.with_accuracy(
        "very_high", hamiltonian_postprocessor=hj.solver.backwards_reachable_tube
    )
    # The solver's own step, by its rule, so that looking does not cut it short.
    dynamics = TractorTrailer()
    fastest = jnp.abs(jnp.cos(grid.states[..., 2])) + jnp.abs(jnp.sin(grid.states[..., 2]))
    rate = jnp.max(
        fastest / grid.spacings[0]
        + 1 / grid.spacings[2]
        + (1 + jnp.abs(jnp.sin(grid.states[..., 3]))) / grid.spacings[3]
    )
    span = float(0.999 * STEPS * settings.CFL_number / rate)
    values = distance(grid, job["goal"], job["tolerance"])
    states = jnp.array(job["states"])

    def look(values):
        return jax.vmap(lambda state: grid.interpolate(values, state))(states)

    before = time.process_time()
    step = hj.solver.step.lower(
        settings, dynamics, grid, 0.0, values, -span, progress_bar=False
    ).compile()
    look = jax.jit(look).lower(values).compile()
    began = time.process_time()
    seen, now = np.asarray(look(values)), 0.0
    times = np.where(seen <= 0, 0.0, np.inf)
    while now < job["horizon"]:
        values = step(settings, grid, -now, values, -(now + span))
        last, seen = seen, np.asarray(look(values))
        entered = np.isinf(times) & (seen <= 0)
        times[entered] = now + span * last[entered] / (last - seen)[entered]
        now += span
    ended = time.process_time()
    json.dump(
        {
            "times": [each if np.isfinite(each) else None for each in times.tolist()],
            "cpu_seconds": ended - began,
            "compile_seconds": began - before,
            "peak_megabytes": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        },
        sys.stdout,
    )


main()
