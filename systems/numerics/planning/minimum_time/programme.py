"""The nonlinear programme: states at nodes, controls between, free durations, clear walls."""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from ...geometry.world import World
from ..arc_words.shortened import SETTLED
from ..footprint import Discs, signed_distance
from ..trailer import Trailer

# Nodes of the spline along the longer side of the world.
SPLINE_NODES = 120


@dataclass(frozen=True, eq=False)
class ClearanceField:
    """Signed distance to the nearest obstacle or boundary, minus each disc's radius.

    A cubic spline through exact distances at the nodes of a grid: smooth, and exact along straight
    walls; where two walls are equally near it is off by a fraction of the grid's spacing, so paths
    are checked against the polygons themselves afterwards.

    Attributes:
        discs: What covers the vehicle.
        spline: Function from (x, y) [m] to signed distance, positive in free space [m].
        spacing: Of its grid [m].
    """

    discs: Discs
    spline: ca.Function
    spacing: float

    def function(self) -> ca.Function:
        """From a state to the free distance around each disc, negative: an overlap [m].

        The state is in a frame whose pose in the world is the second argument.
        """
        state, pose = ca.MX.sym("state", 4), ca.MX.sym("pose", 3)
        places = [self._place(k)(state, pose) for k in range(len(self.discs))]
        free = [
            self.spline(place) - radius
            for place, radius in zip(places, self.discs.radii, strict=True)
        ]
        return ca.Function("free", [state, pose], [ca.vertcat(*free)])

    def _place(self, k: int) -> ca.Function:
        """From a state and a pose to the centre of a disc in the world [m].

        In scalars, which are quicker to evaluate than the matrices that the spline needs.
        """
        state, pose = ca.SX.sym("state", 4), ca.SX.sym("pose", 3)
        c, s = ca.cos(pose[2]), ca.sin(pose[2])
        x, y = self.discs.centre(k, state, ca.cos, ca.sin)
        place = ca.vertcat(pose[0] + c * x - s * y, pose[1] + s * x + c * y)
        return ca.Function("place", [state, pose], [place])


@lru_cache(maxsize=8)
def clearance_field(world: World, discs: Discs) -> ClearanceField:
    """Sample the distance to a world's polygons on a grid that reaches beyond the boundary."""
    low, high = world.bounds[:2], world.bounds[2:]
    spacing = float((high - low).max()) / SPLINE_NODES
    # A seed may leave the world; a spline must not be asked beyond its grid.
    margin = 0.25 * float((high - low).max())
    x, y = (
        np.arange(a - margin, b + margin + spacing, spacing) for a, b in zip(low, high, strict=True)
    )
    points = np.stack([each.ravel() for each in np.meshgrid(x, y)], axis=1)
    distance = signed_distance(world, points)
    spline = ca.interpolant("distance", "bspline", [x.tolist(), y.tolist()], distance.tolist())
    return ClearanceField(discs, spline, spacing)


# Square of a phase below which its series is taken; the next term is lost in rounding.
_SMALL = 1e-4
# The solver stops when the constraints and the conditions of optimality hold this well.
TOLERANCE = 1e-9

if hasattr(ca.GlobalOptions, "setNumpyMode"):
    # CasADi 3.8 warns at NumPy's sine of a symbol, unless told that a symbol is what is wanted.
    ca.GlobalOptions.setNumpyMode(-1)


@dataclass(frozen=True, eq=False)
class Programme:
    """A compiled programme, in turning radii and 1 / turn rate.

    Its variables are the states, node by node, then the controls (v, omega), interval by interval,
    then the durations of the arcs. Its constraints are that each interval ends where the next
    begins, then the free distance around each disc at each node [m]. Its parameters are the weight
    of time and, with obstacles, the pose in the world of the frame that the states are in.

    Within an interval the controls are constant, so that its end is known in closed form: there is
    no mesh that a short trailer or a far goal would have to refine.

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
    radius: float = 1.0,
) -> Programme:
    """Build the programme, once per set of arguments.

    Args:
        trailer: Normalised; the bounds of its controls and angle are bounds on variables.
        intervals: Their number, a multiple of the number of arcs.
        max_iterations: Of the solver.
        arcs: How many parts of the path have a duration of their own; the intervals of each are
            equally long.
        field: The free distance around the discs that cover the vehicle, if there are obstacles.
        radius: Of its tightest turn, where the obstacles are [m].
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
    weight, pose = ca.MX.sym("weight"), ca.MX.sym("pose", 0 if field is None else 3)
    if field is not None:
        distances = field.function().map(intervals + 1)
        metres = ca.diag(ca.DM([radius, radius, 1.0, 1.0])) @ states
        constraints.append(ca.vec(distances(metres, ca.repmat(pose, 1, intervals + 1))))
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
        "p": ca.vertcat(weight, pose),
        "f": weight * ca.sum1(durations),
        "g": ca.vertcat(*constraints),
    }
    solver = ca.nlpsol("minimum_time", "ipopt", programme, options)
    return Programme(solver, intervals, arcs, 0 if field is None else len(field.discs))


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
