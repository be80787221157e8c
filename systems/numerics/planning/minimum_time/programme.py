"""The nonlinear programme: states at nodes, controls between, free durations, clear walls."""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from ..arc_words.shortened import SETTLED
from ..trailer import Trailer
from .clearance import FACED, DistanceSpline, FacedWalls

# Square of a phase below which its series is taken; the next term is lost in rounding.
_SMALL = 1e-4
# What an overlap of a turning radius costs beside walls [1 / turn rate]: more than it saves.
PENALTY = 1e3
# The solver stops when the constraints and the conditions of optimality hold this well.
TOLERANCE = 1e-9

if hasattr(ca.GlobalOptions, "setNumpyMode"):
    # CasADi 3.8 warns at NumPy's sine of a symbol, unless told that a symbol is what is wanted.
    ca.GlobalOptions.setNumpyMode(-1)


@dataclass(frozen=True, eq=False)
class Programme:
    """A compiled programme, in turning radii and 1 / turn rate.

    Its variables are the states, node by node, then the controls (v, omega), interval by interval,
    then the durations of the arcs; and beside walls last the overlap that is allowed, at a price.
    Its constraints are that each interval ends where the next begins, then the free distances at
    each place that is looked at [m]: first where the intervals begin, then at each further look
    into them, and last at the end. Its parameters are the weight of time and, with obstacles, the
    pose in the world of the frame that the states are in, or the walls that are faced at each of
    these places.

    Within an interval the controls are constant, so that its end is known in closed form: there is
    no mesh that a short trailer or a far goal would have to refine.

    Attributes:
        solver: What solves it; arguments as those of `casadi.nlpsol`.
        intervals: Number of intervals, n.
        arcs: Number of arcs, each of n / arcs intervals.
        clearances: Number of free distances at each place.
        looks: Places in each interval.
    """

    solver: ca.Function
    intervals: int
    arcs: int
    clearances: int
    looks: int

    @property
    def places(self) -> int:
        """Number of places that are looked at."""
        return self.looks * self.intervals + 1


@lru_cache(maxsize=32)
def minimum_time_programme(
    trailer: Trailer,
    intervals: int,
    max_iterations: int,
    arcs: int = 1,
    room: DistanceSpline | FacedWalls | None = None,
) -> Programme:
    """Build the programme, once per set of arguments.

    Args:
        trailer: Normalised; the bounds of its controls and angle are bounds on variables.
        intervals: Their number, a multiple of the number of arcs.
        max_iterations: Of the solver.
        arcs: How many parts of the path have a duration of their own; the intervals of each are
            equally long.
        room: The free distances around the discs that cover the vehicle, if there are obstacles.
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
    weight, looks, clearances = ca.MX.sym("weight"), 1, 0
    slack = ca.MX.sym("nothing", 0)
    if isinstance(room, DistanceSpline):
        clearances = len(room.discs)
        around = ca.MX.sym("pose", 3)
        distances = room.function().map(intervals + 1)
        constraints.append(ca.vec(distances(states, ca.repmat(around, 1, intervals + 1))))
    elif isinstance(room, FacedWalls):
        looks, clearances = room.looks, FACED * len(room.discs)
        around = ca.MX.sym("walls", 4, clearances * (looks * intervals + 1))
        between = [
            advance.map(intervals)(states[:, :-1], controls, steps * (look / looks))
            for look in range(1, looks)
        ]
        places = ca.horzcat(states[:, :-1], *between, states[:, -1])
        distances = room.function().map(looks * intervals + 1)
        slack = ca.MX.sym("slack")
        constraints.append(ca.vec(distances(places, around)) + room.radius * slack)
    else:
        around = ca.MX.sym("nothing", 0)
    options = {
        "print_time": False,
        # Splines cannot be written out in scalars.
        "expand": not isinstance(room, DistanceSpline),
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
        "x": ca.vertcat(ca.vec(states), ca.vec(controls), durations, slack),
        "p": ca.vertcat(weight, ca.vec(around)),
        "f": weight * (ca.sum1(durations) + PENALTY * ca.sum1(slack)),
        "g": ca.vertcat(*constraints),
    }
    solver = ca.nlpsol("minimum_time", "ipopt", programme, options)
    return Programme(solver, intervals, arcs, clearances, looks)


def _advanced(state, control, step, trailer: Trailer):
    """The state after an interval: `shift_of` and `half_angle_map`, for symbols."""
    x, y, theta, beta = (state[k] for k in range(4))
    v, omega = control[0], control[1]
    half = omega * step / 2
    bent = ca.fabs(half) > _SMALL
    chord = v * step * ca.if_else(bent, ca.sin(half) / ca.if_else(bent, half, 1), 1 - half**2 / 6)
    hitch = trailer.hitch_offset / trailer.length
    pull = -v / (2 * trailer.length)
    rise, fall = omega * (1 + hitch) / 2, omega * (hitch - 1) / 2
    square = (pull**2 + rise * fall) * step**2
    grows, swings = square > _SMALL, square < -_SMALL
    phase = ca.sqrt(ca.fmax(ca.fabs(square), _SMALL))
    near = 1 - square / 3 + 2 * square**2 / 15
    even = ca.if_else(swings, ca.cos(phase), 1)
    settled = ca.tanh(ca.fmin(phase, SETTLED)) / phase
    odd = ca.if_else(swings, ca.sin(phase) / phase, ca.if_else(grows, settled, near))
    odd *= step
    s, c = ca.sin(beta / 2), ca.cos(beta / 2)
    s_end = (even + pull * odd) * s + rise * odd * c
    c_end = fall * odd * s + (even - pull * odd) * c
    # The turn of the half angle, and not the angle itself, does not jump.
    swing = 2 * ca.atan2(s_end * c - c_end * s, c_end * c + s_end * s)
    return ca.vertcat(
        x + chord * ca.cos(theta + half),
        y + chord * ca.sin(theta + half),
        theta + 2 * half,
        beta + swing,
    )
