"""The nonlinear programme: states at nodes, controls between them, and free durations."""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from ..trailer import Trailer, trailer_rates
from .clearance import ClearanceField

# Steps of the classical Runge-Kutta rule from one node to the next.
RUNGE_KUTTA_STEPS = 3
# The solver stops when the constraints and the conditions of optimality hold this well.
TOLERANCE = 1e-9

if hasattr(ca.GlobalOptions, "setNumpyMode"):
    # CasADi 3.8 warns at NumPy's sine of a symbol, unless told that a symbol is what is wanted.
    ca.GlobalOptions.setNumpyMode(-1)


@dataclass(frozen=True, eq=False)
class Programme:
    """A compiled programme.

    Its variables are the states, node by node, then the controls (v, omega), interval by interval,
    then the durations of the arcs. Its constraints are that each interval ends where the next
    begins, then the free distance around each disc at each node. With obstacles its parameter is
    the pose, in the world, of the frame that the states are in.

    Attributes:
        solver: What solves it; arguments as those of `casadi.nlpsol`.
        intervals: Number of intervals, n.
        arcs: Number of arcs, each of n / arcs intervals.
        discs: Number of discs.
    """

    solver: ca.Function
    intervals: int
    arcs: int
    discs: int


@lru_cache(maxsize=32)
def minimum_time_programme(
    trailer: Trailer,
    intervals: int,
    max_iterations: int,
    arcs: int = 1,
    field: ClearanceField | None = None,
) -> Programme:
    """Build the programme, once per set of arguments.

    Args:
        trailer: Its length and hitch offset matter; the other parameters are bounds on variables.
        intervals: Their number, a multiple of the number of arcs.
        max_iterations: Of the solver.
        arcs: How many parts of the path have a duration of their own; the intervals of each are
            equally long.
        field: The free distance around the discs that cover the vehicle, if there are obstacles.
    """
    state, control = ca.SX.sym("state", 4), ca.SX.sym("control", 2)
    step = ca.SX.sym("step")
    advance = ca.Function(
        "advance", [state, control, step], [_advanced(state, control, step, trailer)]
    )
    # Small functions, called for every interval at once, keep this quick to build.
    states, controls = ca.MX.sym("states", 4, intervals + 1), ca.MX.sym("controls", 2, intervals)
    durations = ca.MX.sym("durations", arcs)
    each = intervals // arcs
    steps = ca.vec(ca.repmat(durations.T / each, each, 1)).T
    ends = advance.map(intervals)(states[:, :-1], controls, steps)
    constraints = [ca.vec(states[:, 1:] - ends)]
    pose = ca.MX.sym("pose", 0 if field is None else 3)
    if field is not None:
        distances = field.function().map(intervals + 1)
        constraints.append(ca.vec(distances(states, ca.repmat(pose, 1, intervals + 1))))
    options = {
        "print_time": False,
        # Splines cannot be written out in scalars.
        "expand": field is None,
        "ipopt": {
            "print_level": 0,
            "sb": "yes",
            "tol": TOLERANCE,
            "max_iter": max_iterations,
            # A bound is a promise: no turn rate beyond it, not even by a rounding.
            "bound_relax_factor": 0.0,
        },
    }
    programme = {
        "x": ca.vertcat(ca.vec(states), ca.vec(controls), durations),
        "p": pose,
        "f": ca.sum1(durations),
        "g": ca.vertcat(*constraints),
    }
    solver = ca.nlpsol("minimum_time", "ipopt", programme, options)
    return Programme(solver, intervals, arcs, 0 if field is None else len(field.discs))


def _advanced(state, control, step, trailer: Trailer):
    """The state after an interval, by the classical Runge-Kutta rule."""

    def rates(at):
        return ca.vertcat(*trailer_rates(at[2], at[3], control[0], control[1], trailer))

    h = step / RUNGE_KUTTA_STEPS
    for _ in range(RUNGE_KUTTA_STEPS):
        k1 = rates(state)
        k2 = rates(state + h / 2 * k1)
        k3 = rates(state + h / 2 * k2)
        k4 = rates(state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return state
