"""Verdicts that are put together by hand: no planner has to be asked."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from sightfield.diagrams.planning.methods import PlanningQuestion
from sightfield.diagrams.planning.verdict import PlanningVerdict, Row, resimulate
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.goal import Goal
from sightfield.systems.numerics.planning.plan import Plan, TrailerPath, driven_path
from sightfield.systems.numerics.planning.trailer import Trailer
from sightfield.systems.numerics.planning.value_function.grid import StateGrid
from sightfield.systems.numerics.planning.value_function.value_function import ValueFunction

CART = Trailer(speed=1.3, turn_rate=0.9, length=1.1, hitch_offset=0.15)
START = (0.3, 0.2, 0.4, -0.3)
# What each planner drives; 0: it is there already, none: it has no path.
PIECES = {
    "casadi": [(1.3, 0.7, 0.9), (1.3, 0.0, 1.4), (1.3, -0.9, 0.8)],
    "extremal": [],
    "value-function": [(1.3, 0.2, 2.9), (1.3, -0.4, 0.7)],
    "polished": 0,
    "primitive": [(1.3, -0.5, 0.6), (1.3, 0.9, 2.3)],
}


def table_of(grid: StateGrid, goal: Goal) -> ValueFunction:
    """A table that falls towards the goal's frame, and is unreachable in a corner."""
    x, y, theta, beta = grid.axes()
    far = np.hypot(x - 0.2, y[:, None] + 0.1)
    far = np.where((x > 2.0) & (y[:, None] > 1.4), np.inf, far)
    turned = 1 + 0.3 * np.cos(theta)[:, None] + 0.2 * np.sin(beta)
    table = (turned[:, :, None, None] + far).astype(np.float32)
    return ValueFunction(
        table=table,
        grid=grid,
        trailer=CART,
        goal=goal,
        scheme="cubic",
        sweeps=9,
        residual=0.01,
        converged=True,
    )


@pytest.fixture(scope="session")
def by_hand() -> Callable[..., PlanningVerdict]:
    """A function of methods, a goal's half-widths, walls or none: what these planners say."""
    grid = StateGrid(
        x_min=-3.0, y_min=-2.5, step=0.5, x_count=13, y_count=11, theta_count=12, beta_count=10
    )

    def put_together(
        *methods: str,
        tolerance: tuple[float, float, float, float] = (0.3, 0.2, 0.4, 0.5),
        walled: bool = False,
        tabled: bool = True,
    ) -> PlanningVerdict:
        goal = Goal(state=(3.0, 2.5, 0.5, 0.2), tolerance=tolerance)
        world = None
        if walled:
            pillar = [(2.4, 0.2), (3.4, 0.1), (3.1, 0.9)]
            world = make_world([(-1.5, -2.0), (6.0, -1.8), (5.6, 4.4), (-1.2, 4.1)], [pillar])
        question = PlanningQuestion(start=START, goal=goal, trailer=CART, world=world)
        centred = Goal(state=(0.0, 0.0, 0.0, 0.2), tolerance=(0.5, 0.5, 0.6, 0.7))
        value = table_of(grid, centred).moved(*goal.state[:3])
        rows = []
        for method in methods:
            pieces, path = PIECES[method], None
            if pieces:
                path = driven_path(CART, START, pieces, 0.4)
            elif pieces == 0:
                path = TrailerPath(np.zeros(1), np.array([goal.state]), np.zeros((0, 2)))
            notes: dict[str, object] = {}
            if method == "value-function" and tabled:
                notes = {"value_function": value, "time_to_go": 3.125, "warnings": ["a [wide] box"]}
            if method == "primitive":
                clock = np.linspace(0.0, 2.9, 8)
                notes = {"switching_times": clock, "switching_function": np.cos(2 * clock)}
            plan = Plan(
                method=method,
                goal=goal,
                status="no path found" if path is None else "optimal",
                converged=path is not None,
                time=math.inf if path is None else float(path.times[-1]),
                path=path,
                wall_time=0.125,
                notes=notes,
            )
            driven = resimulate(CART, path, goal) if pieces else None
            rows.append(Row(method, plan, driven))
        return PlanningVerdict(question, 2.75, tuple(rows))

    return put_together
