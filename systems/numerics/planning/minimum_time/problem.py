"""One question to the solver, runs of the solver on it, and what makes a good solution better.

Intervals of equal duration cannot switch where the optimum does; that costs up to a thousandth of
the time. Optimal paths are bang arcs and few singular ones: once their order is known, a programme
with one duration per arc puts every switch in its place.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.world import World
from ..arc_words.quickest import ArcWord
from ..arc_words.shortened import end_of, is_steady
from ..arc_words.words import normalised
from ..footprint import Discs
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer
from .clearance import DistanceSpline, FacedWalls, distance_spline, faced_walls
from .programme import minimum_time_programme

# Way from one look at the walls to the next, in radii of the smallest disc, and how many looks
# there are in each interval.
LOOK, FEWEST_LOOKS, MOST_LOOKS = 0.3, 2, 6
# The sign of a control that is not held at a bound.
FREE = 0


@dataclass(frozen=True, eq=False)
class Guess:
    """A path whose intervals are grouped into arcs.

    Attributes:
        states: At the nodes, shape (n + 1, 4) [m], [m], [rad], [rad].
        controls: In the intervals, shape (n, 2) [m/s], [rad/s].
        durations: Of the arcs, each with equally many intervals, shape (k,) [s].
        signs: 1 or -1 for a control that is held at a bound, or FREE, shape (n, 2).
    """

    states: np.ndarray
    controls: np.ndarray
    durations: np.ndarray
    signs: np.ndarray


def resampled(path: TrailerPath, intervals: int, near: float | None = None) -> Guess:
    """One arc of intervals of equal duration: states interpolated, controls averaged.

    Args:
        path: The path.
        intervals: Of each arc.
        near: If given, there are three arcs, the first and the last at most this long [s]: on a
            long trip the switches lie near its ends, where the cart turns.
    """
    total = float(path.times[-1] - path.times[0])
    ends = 0.0 if near is None else min(near, total / 3)
    durations = np.array([total] if near is None else [ends, total - 2 * ends, ends])
    steps = np.repeat(np.maximum(durations / intervals, 1e-12), intervals)
    times = path.times[0] + np.append(0.0, np.cumsum(steps))
    # Averages are differences of the integral, which is piecewise linear.
    held = np.diff(path.times)[:, None]
    integral = np.vstack([np.zeros((1, 2)), np.cumsum(path.controls * held, axis=0)])
    return Guess(
        columns_at(times, path.times, path.states),
        np.diff(columns_at(times, path.times, integral), axis=0) / steps[:, None],
        durations,
        np.full((len(steps), 2), FREE),
    )


def columns_at(times: np.ndarray, known: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Interpolate each column of values, shape (m, k), known at some times, at others."""
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def nearest_goal_state(goal: Goal, state: np.ndarray) -> np.ndarray:
    """The goal's state, with whole turns added so that its angles are nearest a state's, (4,)."""
    target = np.array(goal.state, dtype=float)
    target[2:] += 2 * np.pi * np.round((state[2:] - target[2:]) / (2 * np.pi))
    return target


# IPOPT's words for what happened, in ours.
_STATUSES = {
    "Solve_Succeeded": "optimal",
    "Solved_To_Acceptable_Level": "nearly optimal",
    "Infeasible_Problem_Detected": "no path found",
    "Maximum_Iterations_Exceeded": "iteration limit",
}
# Largest violation of a constraint that still counts as none: in the units of the state, and
# relative to how far the start is from the goal, so that near it standing still is not a path.
ACCEPTED_VIOLATION = 1e-6
ACCEPTED_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class Attempt:
    """Where the solver ended.

    Attributes:
        path: Its last iterate.
        violation: Largest violation of a constraint, or miss of the goal when its controls are
            driven, in the units of the state.
        status: In words.
        iterations: Of the solver.
        accepted: Largest violation with which it counts as a path, in the units of the state.
    """

    path: TrailerPath
    violation: float
    status: str
    iterations: int
    accepted: float = ACCEPTED_VIOLATION

    @property
    def is_path(self) -> bool:
        """Whether the last iterate keeps the constraints, optimal or not."""
        return self.violation <= self.accepted

    @property
    def time(self) -> float:
        """Of travel [s]."""
        return float(self.path.times[-1])

    @property
    def rank(self) -> tuple[bool, float]:
        """Sorts optimal paths before others, then by time."""
        return self.status != "optimal", self.time


@dataclass(frozen=True, eq=False)
class Problem:
    """From where to where, with which vehicle, among which obstacles.

    Attributes:
        trailer: The vehicle and its bounds.
        start: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        goal: What is to be reached.
        max_iterations: Of the solver in one run.
        obstacles: The world whose walls count, or None.
        discs: What the vehicle covers; with obstacles only.
    """

    trailer: Trailer
    start: np.ndarray
    goal: Goal
    max_iterations: int
    obstacles: World | None = None
    discs: Discs | None = None

    def solve(self, guess: Guess) -> Attempt:
        """Run the solver from a guess; among walls by the spline, which is smooth but not exact.

        Args:
            guess: Where to begin; it may lead through walls.
        """
        if self.obstacles is None or self.discs is None:
            return self._solved(guess, None, np.zeros(0), np.zeros((1, 1)))
        room = distance_spline(self.obstacles, self.discs, self.trailer.radius)
        return self._solved(guess, room, np.array(self.goal.state[:3]), np.zeros((1, 1)))

    def solve_beside_walls(self, guess: Guess, margins: np.ndarray, reach: float) -> Attempt:
        """Run the solver with the exact distances from the walls that a guess faces.

        Args:
            guess: One arc, nearly clear of walls.
            margins: To keep off walls in each interval, shape (n,) [m].
            reach: How far a state may be from that of the guess [m]; in its angles, by so much that
                the trailer swings as far.
        """
        world, discs = self.obstacles, self.discs
        assert world is not None
        assert discs is not None
        n = len(guess.controls)
        step = float(guess.durations[0]) / n
        way = self.trailer.speed * step / (LOOK * min(discs.radii))
        looks = int(np.clip(math.ceil(way), FEWEST_LOOKS, MOST_LOOKS))
        nodes = np.arange(n + 1)
        begins = nodes[:-1] + np.arange(looks)[:, None] / looks
        states = columns_at(np.append(begins.ravel(), n), nodes, guess.states)
        walls = faced_walls(world, discs, states)
        ends = np.zeros((*walls.shape[:-1], 2, 4))
        ends[..., :2] = walls.reshape(*walls.shape[:-1], 2, 2)
        local = self.goal.to_frame(ends)[..., :2] / self.trailer.radius
        # At a node, the larger margin of the intervals on its sides.
        least = np.tile(margins, (looks, 1))
        least[0, 1:] = np.maximum(margins[1:], margins[:-1])
        # Where it starts is not for the solver to choose.
        least[0, 0] = -np.inf
        floors = np.append(least.ravel(), margins[-1])[:, None]
        room = FacedWalls(discs, self.trailer.radius, looks)
        turn = reach / (discs.length + abs(discs.hitch_offset))
        near = np.array([reach, reach, turn, turn])
        return self._solved(guess, room, local.ravel(), floors, near)

    def _solved(
        self,
        guess: Guess,
        room: DistanceSpline | FacedWalls | None,
        around: np.ndarray,
        floors: np.ndarray,
        near: np.ndarray | None = None,
    ) -> Attempt:
        """Run the solver; free distances at each place are at least its floor, shape (m, 1) [m].

        If given, states stay so near to those of the guess, shape (4,) [m], [m], [rad], [rad].

        It works in the goal's own frame, where the box bounds each entry by itself, with lengths
        in turning radii, so that far goals and slow carts are as well scaled as others.
        """
        rate, radius = self.trailer.turn_rate, self.trailer.radius
        units, bounds = np.array([radius, radius, 1.0, 1.0]), [self.trailer.speed, rate]
        guess = replace(guess, states=self.goal.to_frame(guess.states))
        n, arcs = len(guess.controls), len(guess.durations)
        cart = replace(normalised(self.trailer), reverse=False, jackknife=math.pi)
        programme = minimum_time_programme(cart, n, self.max_iterations, arcs, room)
        low, high = self._state_bounds(guess)
        if near is not None:
            low[1:] = np.minimum(np.maximum(low[1:], guess.states[1:] - near), high[1:])
            high[1:] = np.maximum(np.minimum(high[1:], guess.states[1:] + near), low[1:])
        slowest, fastest = self._control_bounds(guess)

        # Beside walls an overlap is allowed at a price: then the solver has no need to restore it.
        spare = 1 if isinstance(room, FacedWalls) else 0

        def joined(states, controls, durations, overlap):
            scaled = (states / units).ravel(), (controls / bounds).ravel(), durations * rate
            return np.concatenate([*scaled, np.full(spare, overlap / radius)])

        lbx = joined(low, slowest, np.zeros(arcs), 0.0)
        ubx = joined(high, fastest, np.full(arcs, np.inf), np.inf)
        # On long trips the time weighs less: else the solver's first step shortens a guess that
        # almost arrives until it ends far from the goal.
        weight = 1.0 / max(1.0, float(guess.durations.sum()) * rate)
        defects = 4 * n
        least = np.broadcast_to(floors, (programme.places, programme.clearances)).ravel()
        first = joined(guess.states, guess.controls, guess.durations, ACCEPTED_SHARE * radius)
        answer = programme.solver(
            x0=np.clip(first, lbx, ubx),
            lbx=lbx,
            ubx=ubx,
            p=np.append(weight, around),
            lbg=np.append(np.zeros(defects), least),
            ubg=np.append(np.zeros(defects), np.full(len(least), np.inf)),
        )
        values, constraints = np.array(answer["x"]).ravel(), np.array(answer["g"]).ravel()
        parts = np.cumsum([4 * n + 4, 2 * n, arcs])
        states, controls, durations, overlap = np.split(values, parts)
        rooms = constraints[defects:] - radius * overlap.sum()
        controls = controls.reshape(-1, 2) * bounds
        steps = np.repeat(np.maximum(durations, 0.0) / rate * arcs / n, n // arcs)
        driven = ArcWord(controls, steps)
        end = end_of(self.trailer, self.start, driven)
        steady = np.isfinite(end).all() and is_steady(self.trailer, self.start, driven, self.goal)
        violation = max(
            float((np.abs(constraints[:defects].reshape(-1, 4)) * units).max()),
            float((least - rooms).max(initial=0.0)),
            float(np.maximum(lbx - values, values - ubx).max()) * max(1.0, *bounds, radius),
            max(self.goal.miss(end)) if steady else math.inf,
        )
        path = TrailerPath(
            np.append(0.0, np.cumsum(steps)),
            self.goal.from_frame(states.reshape(-1, 4) * units),
            controls,
        )
        # Exactly where it was told to start, without rounding.
        path.states[0] = self.start
        stats = programme.solver.stats()
        words = str(stats["return_status"])
        status = _STATUSES.get(words, words.replace("_", " ").lower())
        accepted = min(ACCEPTED_VIOLATION, ACCEPTED_SHARE * max(self.goal.miss(self.start)))
        return Attempt(path, violation, status, int(stats["iter_count"]), accepted)

    def _state_bounds(self, guess: Guess) -> tuple[np.ndarray, np.ndarray]:
        low, high = np.full(guess.states.shape, -np.inf), np.full(guess.states.shape, np.inf)
        if self.trailer.jackknife < math.pi:
            low[:, 3], high[:, 3] = -self.trailer.jackknife, self.trailer.jackknife
        low[0] = high[0] = self.goal.to_frame(self.start)
        target = nearest_goal_state(self.goal.centred, guess.states[-1])
        if self.trailer.jackknife < math.pi:
            # Within a limit the angle cannot wind, wherever the guess ends.
            target[3] = math.remainder(target[3], math.tau)
        width = self.goal.tolerance
        low[-1] = np.maximum(low[-1], target - width)
        high[-1] = np.minimum(high[-1], target + width)
        return low, high

    def _control_bounds(self, guess: Guess) -> tuple[np.ndarray, np.ndarray]:
        high = np.tile([self.trailer.speed, self.trailer.turn_rate], (len(guess.controls), 1))
        low = -high
        if not self.trailer.reverse:
            low[:, 0] = self.trailer.speed
        return (
            np.where(guess.signs > FREE, high, low),
            np.where(guess.signs < FREE, low, high),
        )


# Relative distance from a bound within which a control is at it.
_AT_BOUND = 1e-3


def split_into_arcs(path: TrailerPath, trailer: Trailer, intervals_per_arc: int) -> Guess:
    """Group a solution of the programme of one arc by the bounds that its controls are at.

    A single free interval between two arcs is where a switch falls: it is shared between them.

    Args:
        path: The solution.
        trailer: Whose bounds.
        intervals_per_arc: How finely each arc is divided anew.
    """
    bounds = np.array([trailer.speed, trailer.turn_rate])
    at_bound = np.abs(path.controls) >= (1 - _AT_BOUND) * bounds
    signs = np.where(at_bound, np.sign(path.controls), FREE).astype(int)
    ends = np.flatnonzero((signs[1:] != signs[:-1]).any(axis=1)) + 1
    starts = np.concatenate([[0], ends])
    ends = np.concatenate([ends, [len(signs)]])
    switches = path.times[starts].copy()
    kept = np.ones(len(starts), dtype=bool)
    for k in range(1, len(starts) - 1):
        if ends[k] - starts[k] == 1 and not at_bound[starts[k]].all():
            kept[k] = False
            switches[k + 1] = path.times[starts[k] : ends[k] + 1].mean()
    kinds, switches = signs[starts[kept]], np.append(switches[kept], path.times[-1])
    # Two arcs of one kind on either side of an interval that was no switch are one.
    same = np.concatenate([[False], (kinds[1:] == kinds[:-1]).all(axis=1)])
    kinds, switches = kinds[~same], switches[np.append(~same, True)]
    durations = np.diff(switches)
    m = intervals_per_arc
    times = np.append(
        (switches[:-1, None] + durations[:, None] * np.arange(m) / m).ravel(), switches[-1]
    )
    middles = 0.5 * (times[1:] + times[:-1])
    held = path.controls[np.searchsorted(path.times, middles, side="right") - 1]
    signs = np.repeat(kinds, m, axis=0)
    controls = np.where(signs == FREE, held, signs * bounds)
    return Guess(columns_at(times, path.times, path.states), controls, durations, signs)


# Intervals of each arc when switches are placed; paths of more arcs than this are left as they are.
INTERVALS_PER_ARC = 15
MOST_ARCS = 10
# Solutions that take at most this many times the least time get their switches placed: equal
# intervals cost up to a hundredth of the time, so that the second best may be the best.
NEAR_BEST = 1.01


def near_best(found: list[Attempt]) -> list[Attempt]:
    """Attempts within NEAR_BEST of the least time, one of each path, the quickest first."""
    least = min(each.time for each in found)
    # The same time to five decimals means the same path.
    unlike: dict[float, Attempt] = {}
    for each in sorted(found, key=lambda each: each.time):
        if each.time <= NEAR_BEST * least:
            unlike.setdefault(round(each.time / least, 5), each)
    return list(unlike.values())


def with_placed_switches(problem: Problem, found: list[Attempt]) -> list[Attempt]:
    """Solve again from the best attempts, with one duration for each of their arcs."""
    better = []
    for each in near_best(found):
        guess = split_into_arcs(each.path, problem.trailer, INTERVALS_PER_ARC)
        freedom = len(guess.durations) + int((guess.signs == FREE).sum())
        exact_goals = problem.goal.tolerance.count(0)
        # Few arcs may leave nothing to choose: then every switch is where it must be.
        if len(guess.durations) <= MOST_ARCS and freedom >= exact_goals:
            better.append(problem.solve(guess))
    return better
