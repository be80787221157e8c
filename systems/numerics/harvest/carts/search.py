"""Safe-interval search: the earliest way through a roadmap among moving machines.

At each node a cart may stand during certain intervals of time, between which other machines pass.
For each interval the earliest arrival is kept. From then on, the cart sets out along an edge at the
first moment at which no machine comes near to it on the edge. Run backwards in time from the
arrival, the same search finds the latest departure.

Source: Phillips and Likhachev 2011 (SIPP).
"""

import heapq
import math
from typing import NamedTuple

import numpy as np

from ...compiled import compiled
from .roadmap import Edges
from .traffic import SAMPLE, Traffic, gap_between

# Time between departures that are tried on an edge: in the first half of the TRIES, and then [s].
OFTEN, SELDOM = 1.0, 4.0
TRIES = 40


class Intervals(NamedTuple):
    """When a cart may stand at nodes.

    Attributes:
        first: Number of the first interval of each node, and their total number, shape (n + 1,).
        begins, ends: Of each interval, in order, shape (I,) [s].
    """

    first: np.ndarray
    begins: np.ndarray
    ends: np.ndarray


class Task(NamedTuple):
    """A search problem: the edges, when nodes are free, the other machines and the goals.

    Attributes:
        edges: Of the roadmap.
        banned: Whether each edge may not be used, shape (E,).
        intervals: When its nodes are free.
        traffic: The machines to keep clear of.
        boxes: Of tractor and trailer, shape (2, 3) [m].
        gap: Least distance [m].
        goals: Whether each interval is a goal, shape (I,).
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
    """Find the earliest way from a node to a goal; or, backwards in time, the latest way to a node.

    Args:
        task: The search problem.
        start: Number of the node.
        time: When the cart is at the node [s].
        back: Whether the search runs backwards in time.
        until: No edge is left later than this; backwards, none is reached earlier [s].

    Returns:
        Numbers of the edges in the order of driving, shape (k,); empty if there is no way.
    """
    sign = -1.0 if back else 1.0
    leaving = task.edges.target if back else task.edges.source
    order = np.argsort(leaving, kind="stable")
    begin = np.searchsorted(leaving[order], np.arange(len(task.intervals.first)))
    chosen = _search(task, start, sign * time, sign, sign * until, order, begin)
    return chosen if back else chosen[::-1]


@compiled
def _is_met(task, e, departure):
    """Whether a cart that sets out along an edge at `departure` comes too near to others."""
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
