"""Plans with reverse in rooms drawn at random, beside the programme from seeds drawn at random."""

import math
import os
import time

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.arc_words.quickest import ArcWord, word_path
from sightfield.systems.numerics.planning.arc_words.words import control_set
from sightfield.systems.numerics.planning.footprint import covering_discs, deepest_overlap
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.minimum_time.planner import plan_by_casadi
from sightfield.systems.numerics.planning.planners.from_table import plan_by_value_function
from sightfield.systems.numerics.planning.trailer import Trailer

pytestmark = pytest.mark.benchmarks

SEED = int(os.environ.get("SEED", "40000"))
ROOMS = int(os.environ.get("ROOMS", "20"))
SEEDS = int(os.environ.get("SEEDS", "100"))
CART = Trailer(reverse=True)
DISCS = covering_discs(CART)
# Room around the cart at a start and a goal [m].
ROOM = 0.05
# How much longer than the best counts as longer.
ABOVE = 5e-3


def question(number):
    """A room of 5 to 9 m with up to three obstacles; where from, and the goal."""
    rng = np.random.default_rng(SEED + number)
    size = rng.uniform(5, 9, 2)
    inner = shapely.box(0.2, 0.2, *(size - 0.2))
    holes = []
    for _ in range(rng.integers(1, 4)):
        middle, radius = rng.uniform(1, size - 1), rng.uniform(0.3, 0.9)
        angles = np.sort(rng.uniform(0, math.tau, rng.integers(3, 6)))
        ring = middle + radius * np.column_stack([np.cos(angles), np.sin(angles)])
        outline = shapely.Polygon(ring)
        apart = all(outline.distance(shapely.Polygon(each)) > 0.02 for each in holes)
        if outline.is_valid and outline.area > 0.1 and inner.contains(outline) and apart:
            holes.append(ring)
    world = make_world([(0, 0), (size[0], 0), tuple(size), (0, size[1])], holes)

    def clear(bend):
        while True:
            low, high = (0.3, 0.3, -math.pi, -bend), (*(size - 0.3), math.pi, bend)
            state = rng.uniform(low, high)
            if deepest_overlap(world, DISCS, state[None]) < -ROOM:
                return tuple(state.tolist())

    start, end = clear(1.2), clear(0.0)
    return world, start, Goal(state=end, tolerance=THESIS_TOLERANCE)


def random_seeds(start, number):
    """Words of three to six arcs."""
    rng = np.random.default_rng(number)
    pairs = control_set(CART) * [CART.speed, CART.turn_rate]
    for _ in range(SEEDS):
        controls = pairs[rng.integers(0, len(pairs), rng.integers(3, 7))]
        yield word_path(CART, start, ArcWord(controls, rng.exponential(1.0, len(controls))))


def test_rooms():
    losses, unsolved, seconds = [], 0, []
    print()
    for number in range(ROOMS):
        world, start, goal = question(number)
        began = time.process_time()
        plan = plan_by_value_function(CART, start, goal, obstacles=world)
        seconds.append(time.process_time() - began)
        seeds = list(random_seeds(start, number))
        other = plan_by_casadi(CART, start, goal, seeds=seeds, obstacles=world)
        best = other.time if other.converged else math.inf
        if plan.path is None:
            unsolved += 1
            print(f"room {number}: {plan.status}; of random seeds {best:.5g} s")
            continue
        losses.append(plan.time / min(plan.time, best) - 1)
        print(f"room {number}: {plan.time:.5g} s, {plan.notes['way']}; {best:.5g} s")
    losses = np.array(losses)
    print(
        f"{ROOMS} random rooms with reverse: {unsolved} unsolved, {np.sum(losses > ABOVE)} more "
        f"than 0.5% above the best of {SEEDS} random seeds, {losses.max(initial=0.0):.2%} at most; "
        f"{np.median(seconds):.1f} CPU s"
    )
