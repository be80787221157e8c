"""Keeping a record of what should not happen, and of idle time."""

import numpy as np

from ...compiled import compiled
from ..routes.clearance import crop_under, distance_to_combine, gap_to_combines, outline_at
from ..routes.ground import pose_on_path

# Columns of a record before those of the carts' idle times.
CROSSINGS, CART_TO_COMBINE, CART_TO_CART, COMBINE_TO_COMBINE = range(4)
RECORD = 4


@compiled
def watch(record, ground, traffic, points, hitch, states, controls, alongside, emptying, period):
    """Add a step to a record, in place; see `HarvestMonitor` for what it holds."""
    now = traffic.time
    count = len(states)
    outlines = np.empty((count, len(points), 2))
    for k in range(count):
        placed = outline_at(points, hitch.length, hitch.hitch_offset, states[k])
        outlines[k] = placed
        if crop_under(ground, traffic, placed, now, 0.0) > 0:
            record[CROSSINGS] += 1.0
        gap = gap_to_combines(traffic, placed, now)
        record[CART_TO_COMBINE] = min(record[CART_TO_COMBINE], gap)
        for j in range(k):
            for a in placed:
                for b in outlines[j]:
                    gap = np.hypot(a[0] - b[0], a[1] - b[1])
                    record[CART_TO_CART] = min(record[CART_TO_CART], gap)
        busy = emptying[k] > 0.5 or controls[k, 0] > 1e-6
        for n in range(len(alongside)):
            busy = busy or alongside[n] == k
        if not busy:
            record[RECORD + k] += period
    half = traffic.size[0]
    for n in range(len(traffic.progress)):
        pose = pose_on_path(traffic, n, traffic.progress[n])
        for m in range(len(traffic.progress)):
            # They line up for the start header by header.
            if m == n or traffic.progress[n] <= 0.0 or traffic.progress[m] <= 0.0:
                continue
            other = pose_on_path(traffic, m, traffic.progress[m])
            if np.hypot(pose[0] - other[0], pose[1] - other[1]) > 6 * half + record[3]:
                continue
            # Points along the other's header, and its tail.
            c, s = np.cos(other[2]), np.sin(other[2])
            for k in range(-4, 5):
                beside = half * k / 4
                x, y = other[0] - s * beside, other[1] + c * beside
                gap = distance_to_combine(x, y, pose, traffic.size)
                record[COMBINE_TO_COMBINE] = min(record[COMBINE_TO_COMBINE], gap)
            x, y = other[0] - c * traffic.size[2], other[1] - s * traffic.size[2]
            gap = distance_to_combine(x, y, pose, traffic.size)
            record[COMBINE_TO_COMBINE] = min(record[COMBINE_TO_COMBINE], gap)
