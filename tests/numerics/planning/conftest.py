"""Fields with walls that several tests drive in, and value functions, solved once."""

import hashlib
import math
import pickle
from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import covering_discs
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.plan import driven_path
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.solve import solve_value_function
from sightfield.systems.numerics.planning.value_function.value_function import ValueFunction

CART = Trailer()


@pytest.fixture(scope="session")
def headland():
    """The end of a field, five wide: the cart turns in it and drives back beside its track."""
    world = make_world([(0, 0), (12, 0), (12, 5), (0, 5)])
    goal = Goal(state=(9.0, 3.5, math.pi, 0.0), tolerance=THESIS_TOLERANCE)
    return world, (10.0, 1.5, 0.0, 0.0), goal


@pytest.fixture(scope="session")
def free_wall():
    """A wall that stands between the start and the goal, to be driven round."""
    wall = [(1.3, 1.5), (1.7, 1.5), (1.7, 7), (1.3, 7)]
    world = make_world([(-4, -2), (8.5, -2), (8.5, 8.5), (-4, 8.5)], [wall])
    goal = Goal(state=(6.0, 3.0, 0.0, 0.0), tolerance=THESIS_TOLERANCE)
    return world, (-2.0, 3.0, 0.0, 0.0), goal


@pytest.fixture(scope="session")
def standing_rows():
    """A wall of standing crop from one end of a field, between the start and the goal."""
    crop = [(0, 3.8), (8.5, 3.8), (8.5, 4.2), (0, 4.2)]
    world = make_world([(0, 0), (12, 0), (12, 8), (0, 8)], [crop])
    goal = Goal(state=(6.0, 5.4, math.pi, 0.0), tolerance=THESIS_TOLERANCE)
    return world, (6.0, 2.6, 0.0, 0.0), goal


@pytest.fixture(scope="session")
def gap_world():
    """Two rooms and a gap of 0.55 between them, 0.4 long; a cart is half a metre wide."""
    return make_world(
        [
            *[(0, 0), (4, 0), (4, 3), (4.4, 3), (4.4, 0), (9, 0)],
            *[(9, 7), (4.4, 7), (4.4, 3.55), (4, 3.55), (4, 7), (0, 7)],
        ]
    )


@pytest.fixture(scope="session")
def depth_in_walls():
    """How deep the discs of a cart reach out of a world, anywhere on a path driven from its start.

    The path is integrated afresh from its controls, and sampled every hundredth of a second.
    """

    def depth(world, path, trailer=CART):
        discs = covering_discs(trailer)
        pieces = [
            (*control, held)
            for control, held in zip(path.controls, np.diff(path.times), strict=True)
        ]
        states = driven_path(trailer, path.states[0], pieces, 0.01).states
        edge = world.polygon.boundary
        deepest = -math.inf
        for k in range(len(discs)):
            points = shapely.points(np.stack(discs.centre(k, states.T), axis=1))
            room = np.where(shapely.covers(world.polygon, points), 1, -1)
            room = room * shapely.distance(edge, points)
            deepest = max(deepest, float(discs.radii[k] - room.min()))
        return deepest

    return depth


# A box that a grid of twice the thesis's step resolves.
WIDE = (0.4, 0.4, 0.55, 0.55)


@pytest.fixture(scope="session")
def solved(made_once) -> Callable[..., ValueFunction]:
    """Solve for a box around the origin, by default of one thesis cell; once for all processes."""

    @cache
    def solve(
        step: float = 0.2,
        *,
        wide: bool = False,
        beta_width: float | None = None,
        reverse: bool = False,
        polish: int | None = 24,
    ) -> ValueFunction:
        box = WIDE if wide else THESIS_TOLERANCE
        box = (*box[:3], box[3] if beta_width is None else beta_width)
        goal, grid = Goal(state=(0.0, 0.0, 0.0, 0.0), tolerance=box), StateGrid.of_step(step)
        trailer = Trailer(reverse=reverse)

        def fill(folder):
            value = solve_value_function(trailer, goal, grid, polish=polish)
            (folder / "value.pickle").write_bytes(pickle.dumps(value))

        asked = repr((trailer, goal, grid, polish))
        folder = made_once(f"table-{hashlib.sha1(asked.encode()).hexdigest()[:12]}", fill)
        return pickle.loads((folder / "value.pickle").read_bytes())

    return solve
