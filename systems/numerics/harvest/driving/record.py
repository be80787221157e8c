"""A record of the routes that were driven, and how good they were."""

import math

import numpy as np

from ...planning.goal import Goal
from ...planning.lower_bound import lower_bound
from ..machines.cart import Cart
from ..routes.route import Route

# Where routes come from; the first stands for a row that is not used.
KINDS = ("", "car", "search", "optimal", "aside")
# Routes of which a record is kept, and columns of it: a number in KINDS, the time on the way, and
# a time that no path between its ends can beat [s].
ROUTES, KIND, TAKES, LEAST = 1500, 0, 1, 2
COLUMNS = 3


def note_route(record: np.ndarray, route: Route, cart: Cart) -> np.ndarray:
    """A record with one more route, as long as there is room; shape (3 ROUTES,)."""
    rows = record.reshape(-1, COLUMNS).copy()
    free = int(np.count_nonzero(rows[:, KIND]))
    if free < len(rows):
        x, y, theta, _ = route.way.states[-1].tolist()
        goal = Goal(state=(x, y, theta, 0.0), tolerance=(0.0, 0.0, 0.0, math.pi))
        least = lower_bound(cart.trailer, route.way.states[0].tolist(), goal)
        rows[free] = KINDS.index(route.way.kind), route.arrive - route.depart, least
    return rows.ravel()


def routes_noted(record: np.ndarray) -> np.ndarray:
    """The rows of a record that are used, shape (n, 3)."""
    rows = record.reshape(-1, COLUMNS)
    return rows[rows[:, KIND] > 0]
