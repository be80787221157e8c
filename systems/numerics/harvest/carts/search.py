"""Safe-interval search: the earliest way through a roadmap among moving machines.

At each node a cart may stand in intervals of time between which others pass. Of each interval the
earliest arrival is kept; an edge is left at the first moment from then on at which nobody comes
near on it. The same search runs backwards in time, from the end on: then it finds the latest
departure.

Source: Phillips and Likhachev 2011 (SIPP).
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from .roadmap import Edges
from .traffic import SAMPLE, Traffic, gap_between

# Moments at which leaving an edge's beginning is tried: at first so often, then less [s].
OFTEN, SELDOM = 1.0, 4.0
TRIES = 40


class Intervals(NamedTuple):
    """When a cart may stand at nodes.

    Attributes:
        first: Number of the first interval of each node, and of all, shape (n + 1,).
        begins, ends: Of each, in order, shape (I,) [s].
    """

    first: np.ndarray
    begins: np.ndarray
    ends: np.ndarray


class Task(NamedTuple):
    """Among what a way is searched, and to where.

    Attributes:
        edges: Of the roadmap.
        banned: Edges that may not be used, shape (E,).
        intervals: Of its nodes.
        traffic: Whom to keep off.
        boxes: Of tractor and trailer, shape (2, 3) [m].
        gap: Least distance [m].
        goals: Intervals that are goals, shape (I,).
        estimates: Lower bounds of the time from each node to a goal, shape (n,) [s].
    """

    edges: Edges
    banned: np.ndarray
    intervals: Intervals
    traffic: Traffic
    boxes: np.ndarray
    gap: float
    goals: np.ndarray
    estimates: np.ndarray


def search(task: Task, start: int, time: float, *, back: bool, until: float) -> np.ndarray:
    """The earliest way from a node at a time to a goal; or, backwards in time, the latest.

    Args:
        task: Among what.
        start: Number of the node.
        time: [s].
        back: Whether it runs backwards in time.
        until: No label is later than this, or earlier where it runs backwards [s].

    Returns:
        Numbers of the edges in the order of driving, shape (k,); none where there is no way.
    """
    sign = -1.0 if back else 1.0
    leaving = task.edges.target if back else task.edges.source
    order = np.argsort(leaving, kind="stable")
    begin = np.searchsorted(leaving[order], np.arange(len(task.intervals.first)))
    chosen = _search(task, start, sign * time, sign, sign * until, order, begin)
    return chosen if back else chosen[::-1]


@compiled
def _is_met(task, e, departure):
    """Whether a cart that leaves the beginning of an edge at a moment comes near to others."""
    edges, traffic, boxes, gap = task.edges, task.traffic, task.boxes, task.gap
    x, y, radius = edges.circle[e]
    last = traffic.poses.shape[1] - 1
    lasts = edges.duration[e]
    middle_time = departure + lasts / 2
    for b in range(len(traffic.boxes)):
        box = traffic.boxes[b]
        size = math.hypot((box[1] - box[0]) / 2, box[2]) + gap
        at = min(max(round((middle_time - traffic.begin) / SAMPLE), 0), last)
        ox, oy = traffic.middles[b, at]
        far = radius + size + traffic.quickest[b] * lasts / 2
        if (ox - x) ** 2 + (oy - y) ** 2 > far * far:
            continue
        for k in range(edges.first[e], edges.first[e + 1]):
            moment = departure + edges.since[k]
            at = min(max(round((moment - traffic.begin) / SAMPLE), 0), last)
            pose = traffic.poses[b, at]
            ox, oy = traffic.middles[b, at]
            for part in range(2):
                own = edges.tractor[k] if part == 0 else edges.trailer[k]
                reach = size + math.hypot(boxes[part, 1], boxes[part, 2])
                if (ox - own[0]) ** 2 + (oy - own[1]) ** 2 > reach * reach:
                    continue
                if gap_between(boxes[part], own, box, pose) < gap:
                    return True
    return False


@compiled
def _search(task, start, time, sign, until, order, begin):
    edges, intervals = task.edges, task.intervals
    total = len(intervals.begins)
    best = np.full(total, np.inf)
    closed = np.zeros(total, dtype=np.bool_)
    by_edge = np.full(total, -1, dtype=np.int64)
    by_interval = np.full(total, -1, dtype=np.int64)
    node_of = np.zeros(total, dtype=np.int64)
    for n in range(len(intervals.first) - 1):
        node_of[intervals.first[n] : intervals.first[n + 1]] = n
    heap = [(0.0, np.int64(-1)) for _ in range(0)]
    for i in range(intervals.first[start], intervals.first[start + 1]):
        moment = sign * time
        if intervals.begins[i] - 1e-9 <= moment <= intervals.ends[i] + 1e-9:
            best[i] = time
            heapq.heappush(heap, (time + task.estimates[start], np.int64(i)))
    goal = -1
    while len(heap) > 0:
        _, i = heapq.heappop(heap)
        if closed[i]:
            continue
        closed[i] = True
        if task.goals[i]:
            goal = i
            break
        now = best[i]
        node = node_of[i]
        # In the time of the search, which may run backwards.
        leave_until = intervals.ends[i] if sign > 0 else -intervals.begins[i]
        for number in range(begin[node], begin[node + 1]):
            e = order[number]
            if task.banned[e]:
                continue
            to = edges.target[e] if sign > 0 else edges.source[e]
            lasts = edges.duration[e]
            low, high = now, leave_until
            if sign > 0:
                low = max(low, edges.opens[e])
            else:
                high = min(high, -edges.opens[e] - lasts)
            for turn in range(intervals.first[to], intervals.first[to + 1]):
                # Intervals in the order of the search.
                j = turn
                if sign < 0:
                    j = intervals.first[to] + intervals.first[to + 1] - 1 - turn
                if closed[j]:
                    continue
                arrive_from = intervals.begins[j] if sign > 0 else -intervals.ends[j]
                arrive_until = intervals.ends[j] if sign > 0 else -intervals.begins[j]
                leave = max(low, arrive_from - lasts)
                stop = min(high, min(arrive_until - lasts, until))
                tried = 0
                while leave <= stop + 1e-9 and tried < TRIES and leave + lasts < best[j]:
                    # The moment at which the edge's beginning is left.
                    if not _is_met(task, e, leave if sign > 0 else -(leave + lasts)):
                        best[j] = leave + lasts
                        by_edge[j], by_interval[j] = e, i
                        heapq.heappush(heap, (best[j] + task.estimates[to], np.int64(j)))
                        break
                    tried += 1
                    leave += OFTEN if tried < TRIES // 2 else SELDOM
    chosen = [np.int64(0) for _ in range(0)]
    i = np.int64(goal)
    while i >= 0 and by_edge[i] >= 0:
        chosen.append(by_edge[i])
        i = by_interval[i]
    return np.array(chosen)
