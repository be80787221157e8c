"""Plans through passages of 1.1 cart widths between two rooms, on the default grid."""

import math
import os
import time

import numpy as np
import pytest

from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.planning.footprint import (
    covering_discs,
    deepest_overlap,
    path_overlap,
)
from sightfield.systems.numerics.planning.goal import THESIS_TOLERANCE, Goal
from sightfield.systems.numerics.planning.planners.from_table import plan_by_value_function
from sightfield.systems.numerics.planning.trailer import Trailer

pytestmark = pytest.mark.benchmarks

SEED = int(os.environ.get("SEED", "100"))
PASSAGES = int(os.environ.get("PASSAGES", "16"))
# Of the cart, of the passage, and of one that a table sees [m].
WIDTH, GAP, WIDE = 0.5, 0.55, 1.0
HEIGHT = 7.0
# Room around the cart at a start and a goal [m].
ROOM = 0.05


def question(number, gap):
    """Two rooms, their cart, where from, and the goal in the other; half of them are turned."""
    rng = np.random.default_rng(SEED + number)
    thick, left = rng.uniform(0.05, 1.0), rng.uniform(3.5, 4.5)
    low, wide = rng.uniform(1.5, 5.5), rng.uniform(8.5, 10)
    right, high = left + thick, low + gap
    ring = [(0, 0), (left, 0), (left, low), (right, low), (right, 0), (wide, 0)]
    ring += [(wide, HEIGHT), (right, HEIGHT), (right, high), (left, high), (left, HEIGHT)]
    ring += [(0, HEIGHT)]
    angle = rng.uniform(-math.pi, math.pi)
    c, s = (math.cos(angle), math.sin(angle)) if rng.integers(2) else (1.0, 0.0)
    turned = np.array([[c, -s], [s, c]])
    world = make_world(np.array(ring) @ turned.T)
    cart = Trailer(reverse=bool(rng.integers(2)))
    discs = covering_discs(cart, WIDTH)

    def clear(x_min, x_max, bend):
        while True:
            place = turned @ rng.uniform((x_min, 0.3), (x_max, HEIGHT - 0.3))
            state = np.array([*place, rng.uniform(-math.pi, math.pi), rng.uniform(-bend, bend)])
            if deepest_overlap(world, discs, state[None]) < -ROOM:
                return tuple(state.tolist())

    start = clear(0.3, left - 0.3, 1.0)
    goal = Goal(state=clear(right + 0.3, wide - 0.3, 0.0), tolerance=THESIS_TOLERANCE)
    return world, cart, discs, start, goal


def test_passages():
    solved, hopeless, seconds, deepest = 0, 0, [], 0.0
    print()
    for number in range(PASSAGES):
        world, cart, discs, start, goal = question(number, GAP)
        began = time.process_time()
        plan = plan_by_value_function(cart, start, goal, obstacles=world, discs=discs)
        seconds.append(time.process_time() - began)
        way = "reverse" if cart.reverse else "forwards"
        print(f"passage {number}, {way}: {plan.status}, {plan.time:.5g} s, {seconds[-1]:.0f} CPU s")
        if plan.converged:
            solved += 1
            deepest = max(deepest, path_overlap(world, discs, plan.path, cart))
        else:
            # Forwards, many starts and goals near walls leave no way whatever the passage.
            world, *_ = question(number, WIDE)
            other = plan_by_value_function(cart, start, goal, obstacles=world, discs=discs)
            hopeless += other.path is None
    print(
        f"{PASSAGES} passages of {GAP / WIDTH:.2g} widths: {solved} solved, {hopeless} without "
        f"a way through one of {WIDE / WIDTH:.2g} widths either; at most "
        f"{1e3 * deepest:.1g} mm in a wall; {np.median(seconds):.0f} CPU s"
    )
