"""Timing in pairs, and worlds and starts to time with.

Run by `make bench`; nothing here asserts a time.
"""

import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import World, make_world
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.planners.polished import plan_polished
from sightfield.systems.numerics.planning.trailer import Trailer

# What is played in another process is imported there by its name from the root.
sys.path.append(str(Path(__file__).parents[1]))

# Answers that take long and do not depend on what is timed.
CACHE = Path("build/benchmarks")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Benchmarks take as long as they take."""
    for item in items:
        if item.get_closest_marker("benchmarks"):
            item.add_marker(pytest.mark.timeout(0))


@dataclass(frozen=True)
class Pair:
    """Two timings of the same work.

    Attributes:
        ours, peer: Median wall time of a call [s].
        ratio: Median over the rounds of peer / ours.
    """

    ours: float
    peer: float
    ratio: float


@pytest.fixture(scope="session")
def time_pair() -> Callable[..., Pair]:
    """A function that calls two functions in turn, so that a drift of the machine hits both."""

    def measure(ours: Callable, peer: Callable, rounds: int = 15) -> Pair:
        ours(), peer()  # compile, fill caches
        times = np.empty((rounds, 2))
        for row in times:
            for k, function in enumerate((ours, peer)):
                began = time.perf_counter()
                function()
                row[k] = time.perf_counter() - began
        median = np.median(times, axis=0)
        return Pair(median[0], median[1], float(np.median(times[:, 1] / times[:, 0])))

    return measure


@pytest.fixture(scope="session")
def polygon_world() -> Callable[[int], World]:
    """A function of a number of edges: a 10 m square full of random convex and other polygons."""

    def make(edges: int) -> World:
        rng = np.random.default_rng(edges)
        radius = 2.6 / np.sqrt(edges / 5.0)
        placed: list[shapely.Polygon] = []
        left = edges - 4
        while left >= 3:
            count = left if left < 9 else int(rng.integers(3, 7))
            angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
            radii = radius * rng.uniform(0.5, 1.0, count)
            ring = rng.uniform(radius, 10 - radius, 2) + np.column_stack(
                [radii * np.cos(angles), radii * np.sin(angles)]
            )
            outline = shapely.Polygon(ring)
            apart = all(outline.distance(other) > 0.02 for other in placed)
            if outline.is_valid and outline.area > 0.1 * radius**2 and apart:
                placed.append(outline)
                left -= count
        boundary = [[0, 0], [10, 0], [10, 10], [0, 10]]
        return make_world(boundary, [np.array(each.exterior.coords) for each in placed])

    return make


@dataclass(frozen=True, eq=False)
class Starts:
    """Where the cart starts, and how long it takes to the goal at best.

    Attributes:
        goal: A box around (4, 4, 0, 0).
        states: x, y, theta, beta, shape (n, 4) [m], [m], [rad], [rad].
        times: The best of the local optima that CasADi finds from every Dubins word and those that
            polishing finds, shape (n,) [s]. Words to the middle of a box alone can miss a path
            that only just enters it.
    """

    goal: Goal
    states: np.ndarray
    times: np.ndarray


@pytest.fixture(scope="session")
def random_starts() -> Callable[..., Starts]:
    """A function of a seed, a number and a tolerance, by default one cell of the thesis's grid.

    Starts are in the thesis's maze, with any heading, unfolded, and not at the goal. Nothing was
    tuned on those that the benchmarks use. The times are kept in build/.
    """

    def make(seed: int, count: int, tolerance=THESIS_TOLERANCE) -> Starts:
        goal = Goal(state=(4.0, 4.0, 0.0, 0.0), tolerance=tolerance)
        widths = "_".join(f"{width:g}" for width in tolerance)
        file = CACHE / f"best_from_{seed}_{count}_within_{widths}.npz"
        if not file.exists():
            rng = np.random.default_rng(seed)
            high = (6.0, 6.0, math.pi, math.pi / 2)
            states: list[np.ndarray] = []
            while len(states) < count:
                state = rng.uniform((0.0, 0.0, -math.pi, -math.pi / 2), high)
                if any(goal.miss(state)):
                    states.append(state)
            planners = plan_by_casadi, plan_polished
            plans = [[plan(Trailer(), state, goal) for plan in planners] for state in states]
            times = [min(each.time for each in both if each.converged) for both in plans]
            file.parent.mkdir(parents=True, exist_ok=True)
            np.savez(file, states=np.array(states), times=times)
        with np.load(file) as kept:
            return Starts(goal, kept["states"], kept["times"])

    return make
