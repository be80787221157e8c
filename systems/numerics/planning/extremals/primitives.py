"""The thesis's path of primitives R1-S1-R2-S_g, in closed form (3.5.2.2, Algorithm 5).

Turn, straight, turn, and a straight along the goal's heading, on which beta decays into its
tolerance. The central angle of R1 fixes the slope of S1, and with it everything else; the least
travel time over it is sought among all four pairs of turns. Where start and goal are parallel and
the turns opposite, the two arcs are equal, as in the thesis. A start of any heading and beta will
do.

Along a straight beta only decays: the path reaches the goal to within a tolerance on beta, not,
as 3.5.2.2 says, exactly. x, y and theta are exact.
"""

import math
import time
from collections.abc import Sequence

import numpy as np

from ...compiled import compiled
from ..goal import Goal
from ..plan import Plan
from ..trailer import Trailer
from .arcs import NOT_SCALABLE, SHORTEST, Arc, arc_path, arc_word, goal_frame, turned_beta

_METHOD = "primitive"
_ANGLES = np.linspace(0.0, math.tau, 1441)
_WORDS = [(first, second) for first in (1.0, -1.0) for second in (1.0, -1.0)]
_NEEDS_TOLERANCE = "not applicable: beta is approached, never reached: give a tolerance"
# Columns of a family.
_FIRST, _LINE, _SECOND, _LAST, _BETA, _TIME = range(6)


@compiled
def _family(start, first_turn, second_turn, angles):
    # For each central angle of R1: durations of R1, S1, R2, S_g, beta at the end, travel time.
    x, y, theta, beta = start
    rows = np.empty((angles.size, 6))
    for i in range(angles.size):
        slope = theta + first_turn * angles[i]
        sine, cosine = math.sin(slope), math.cos(slope)
        second = (-second_turn * slope) % (2.0 * math.pi)
        # What the turns leave to the straights; they meet the goal's line at the slope.
        ahead = -x - first_turn * (sine - math.sin(theta)) + second_turn * sine
        left = -y + first_turn * (cosine - math.cos(theta)) + second_turn * (1.0 - cosine)
        line = left / sine if abs(sine) > 1e-12 else math.inf
        last = ahead - line * cosine
        if not (line >= 0.0 and last >= 0.0 and line < math.inf):
            rows[i] = math.inf
            continue
        end = turned_beta(beta, 1.0, first_turn, angles[i])[0]
        end = turned_beta(end, 1.0, 0.0, min(line, 1000.0))[0]
        end = turned_beta(end, 1.0, second_turn, second)[0]
        end = turned_beta(end, 1.0, 0.0, min(last, 1000.0))[0]
        rows[i] = (angles[i], line, second, last, end, angles[i] + line + second + last)
    return rows


def _misses(rows: np.ndarray, goal: Goal) -> np.ndarray:
    # How far beta ends from the goal's, with its sign; NaN where there is no path.
    ends = np.where(np.isfinite(rows[:, _BETA]), rows[:, _BETA], np.nan)
    return np.mod(ends - goal.state[3] + math.pi, math.tau) - math.pi


def _best_of_word(start, turns, goal: Goal) -> np.ndarray | None:
    # Least time over the central angle: inside a feasible stretch, or at its edge.
    tolerance = goal.tolerance[3]

    first, second = turns

    def row_at(angle: float) -> np.ndarray:
        return _family(start, first, second, np.array([angle]))[0]

    def miss_at(angle: float) -> float:
        return _misses(row_at(angle)[None], goal)[0]

    rows = _family(start, first, second, _ANGLES)
    misses = _misses(rows, goal)
    inside = np.abs(misses) <= tolerance
    candidates = []
    for i in np.flatnonzero(inside[1:] != inside[:-1]):
        good, bad = (_ANGLES[i + 1], _ANGLES[i]) if inside[i + 1] else (_ANGLES[i], _ANGLES[i + 1])
        candidates.append(_bisected(good, bad, lambda angle: abs(miss_at(angle)) <= tolerance))
    crossing = (misses[1:] * misses[:-1] < 0) & (np.abs(misses[1:] - misses[:-1]) < 1)
    for i in np.flatnonzero(crossing & ~inside[1:] & ~inside[:-1]):
        sign = misses[i]
        candidates.append(
            _bisected(_ANGLES[i], _ANGLES[i + 1], lambda angle, s=sign: miss_at(angle) * s > 0)
        )
    times = np.where(inside, rows[:, _TIME], math.inf)
    hollow = inside[1:-1] & (times[1:-1] <= times[:-2]) & (times[1:-1] <= times[2:])
    for i in np.flatnonzero(hollow) + 1:
        candidates.append(_lowest(_ANGLES[i - 1], _ANGLES[i + 1], lambda a: row_at(a)[_TIME]))
    candidates.extend(_ANGLES[inside][:1])
    found = [
        row for row in map(row_at, candidates) if abs(_misses(row[None], goal)[0]) <= tolerance
    ]
    return min(found, key=lambda row: row[_TIME], default=None)


def _bisected(good: float, bad: float, holds) -> float:
    # Between two angles, the last at which a condition holds.
    for _ in range(60):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if holds(middle) else (good, middle)
    return good


def _lowest(low: float, high: float, cost) -> float:
    # Golden section.
    ratio = 0.5 * (math.sqrt(5) - 1)
    for _ in range(40):
        width = ratio * (high - low)
        if cost(high - width) < cost(low + width):
            high = low + width
        else:
            low = high - width
    return 0.5 * (low + high)


def plan_by_primitives(trailer: Trailer, start: Sequence[float], goal: Goal) -> Plan:
    """The quickest R1-S1-R2-S_g.

    Args:
        trailer: With the hitch on the axle and speed = turn rate * length; others are refused in
            the plan's status. Drives forwards even where it may reverse.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: Its tolerance on beta is used; x, y and theta are met exactly.

    Returns:
        A plan; "not applicable" or "unreachable" in its status where there is none.
    """
    began = time.perf_counter()

    def failure(status: str) -> Plan:
        wall_time = time.perf_counter() - began
        return Plan(method=_METHOD, goal=goal, status=status, converged=False, wall_time=wall_time)

    frame = goal_frame(trailer, start, goal)
    if frame is None:
        return failure(NOT_SCALABLE)
    local = np.array(frame.start)
    exact = goal.tolerance[3] == 0
    found = []
    for turns in () if exact else _WORDS:
        row = _best_of_word(local, turns, goal)
        if row is not None:
            found.append((row[_TIME], turns, row))
    if abs(local[1]) < SHORTEST and abs(local[2]) < SHORTEST and local[0] <= 0:
        way = abs(local[0])
        end = turned_beta(local[3], 1.0, 0.0, way)[0]
        row = np.array([0.0, 0.0, 0.0, way, end, way])
        if abs(_misses(row[None], goal)[0]) <= goal.tolerance[3]:
            found.append((row[_TIME], (1.0, 1.0), row))
    if not found:
        return failure(_NEEDS_TOLERANCE if exact else "unreachable: no such path found")
    duration, (first, second), row = min(found, key=lambda each: each[0])
    arcs = [
        Arc(first, float(row[_FIRST])),
        Arc(0.0, float(row[_LINE])),
        Arc(second, float(row[_SECOND])),
        Arc(0.0, float(row[_LAST])),
    ]
    path = arc_path(frame, arcs)
    if np.max(np.abs(path.states[:, 3])) > trailer.jackknife:
        return failure("unreachable: the trailer would jackknife")
    return Plan(
        method=_METHOD,
        goal=goal,
        status="found, forwards only" if trailer.reverse else "found",
        converged=True,
        time=float(duration) / trailer.turn_rate,
        path=path,
        residual=max(goal.miss(path.states[-1])),
        wall_time=time.perf_counter() - began,
        notes={
            "arcs": arc_word(arcs),
            "central_angles": (arcs[0].duration, arcs[2].duration),
            "beta_final": float(path.states[-1, 3]),
        },
    )
