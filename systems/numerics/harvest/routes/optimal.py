"""Time-optimal ways of tractor and trailer, from the planning story."""

import math

import numpy as np

from ...planning.extremals.planner import plan_by_extremals
from ...planning.goal import Goal
from ..machines.cart import Cart
from .way import STEP, Way, way_of_poses

# With which trailer angle such a way ends at most [rad].
STRAIGHT = 0.1
# By how much longer than a car's path it may be, since it brings the trailer straight [s].
LONGER = 4.0


def optimal_way(cart: Cart, state: np.ndarray, goal: np.ndarray, car: Way) -> Way | None:
    """The quickest extremal that ends with the trailer straight, if there is one.

    Args:
        cart: The cart.
        state: x, y, theta, beta, shape (4,).
        goal: x, y, theta of the tractor, shape (3,).
        car: The way of a car between the same poses.
    """
    target = Goal(state=(*goal.tolist(), 0.0), tolerance=(0.0, 0.0, 0.0, STRAIGHT))
    plan = plan_by_extremals(cart.trailer, state.tolist(), target)
    if plan.path is None or not plan.converged:
        return None
    if plan.time > car.length / cart.speed + LONGER:
        return None
    count = max(2, math.ceil(plan.time * cart.speed / STEP) + 1)
    at = np.linspace(0.0, plan.path.times[-1], count)
    poses = np.stack([np.interp(at, plan.path.times, c) for c in plan.path.states[:, :3].T], 1)
    return way_of_poses(poses, float(state[3]), cart, "optimal")
