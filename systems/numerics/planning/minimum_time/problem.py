"""One question to the solver, and one run of the solver on it."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ...geometry.world import World
from ..arc_words.held_controls import normalised
from ..arc_words.quickest import ArcWord
from ..arc_words.shortened import end_of, is_steady
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer
from ..vehicle.footprint import Discs
from .clearance import clearance_field
from .guess import FREE, Guess, nearest_goal_state
from .programme import Programme, minimum_time_programme

# IPOPT's words for what happened, in ours.
_STATUSES = {
    "Solve_Succeeded": "optimal",
    "Solved_To_Acceptable_Level": "nearly optimal",
    "Infeasible_Problem_Detected": "no path found",
    "Maximum_Iterations_Exceeded": "iteration limit",
}
# Largest violation of a constraint that still counts as none, in the units of the state, and
# relative to how far the start is from the goal: beside it, to stay would be no path.
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
        accepted: Violation up to which it is a path, in the units of the state.
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

    def programme(self, intervals: int, arcs: int) -> Programme:
        """The programme of this kind of problem; from the cache, if there was one before.

        Args:
            intervals: Of each arc.
            arcs: How many.
        """
        field = None
        if self.obstacles is not None and self.discs is not None:
            field = clearance_field(self.obstacles, self.discs)
        cart = replace(normalised(self.trailer), reverse=False, jackknife=math.pi)
        radius = self.trailer.speed / self.trailer.turn_rate if field else 1.0
        return minimum_time_programme(cart, intervals, self.max_iterations, arcs, field, radius)

    def solve(self, guess: Guess, margin: float = 0.0) -> Attempt:
        """Run the solver from a guess, keeping a margin from walls at the nodes [m].

        It works in the goal's own frame, where the box bounds each entry by itself, with lengths
        in turning radii, so that far goals and slow carts are as well scaled as others.
        """
        rate, radius = self.trailer.turn_rate, self.trailer.speed / self.trailer.turn_rate
        units, bounds = np.array([radius, radius, 1.0, 1.0]), [self.trailer.speed, rate]
        guess = replace(guess, states=self.goal.to_frame(guess.states))
        n, arcs = len(guess.controls), len(guess.durations)
        programme = self.programme(n, arcs)
        low, high = self._state_bounds(guess)
        slowest, fastest = self._control_bounds(guess)

        def joined(states, controls, durations):
            scaled = (states / units).ravel(), (controls / bounds).ravel(), durations * rate
            return np.concatenate(scaled)

        lbx = joined(low, slowest, np.zeros(arcs))
        ubx = joined(high, fastest, np.full(arcs, np.inf))
        defects, clearances = 4 * n, programme.discs * (n + 1)
        first = joined(guess.states, guess.controls, guess.durations)
        answer = programme.solver(
            x0=np.clip(first, lbx, ubx),
            lbx=lbx,
            ubx=ubx,
            p=self.goal.state[:3] if programme.discs else [],
            lbg=np.append(np.zeros(defects), np.full(clearances, margin)),
            ubg=np.append(np.zeros(defects), np.full(clearances, np.inf)),
        )
        values, constraints = np.array(answer["x"]).ravel(), np.array(answer["g"]).ravel()
        states, controls, durations = np.split(values, [4 * n + 4, 6 * n + 4])
        controls = controls.reshape(-1, 2) * bounds
        steps = np.repeat(np.maximum(durations, 0.0) / rate * arcs / n, n // arcs)
        driven = ArcWord(controls, steps)
        end = end_of(self.trailer, self.start, driven)
        steady = np.isfinite(end).all() and is_steady(self.trailer, self.start, driven, self.goal)
        violation = max(
            float((np.abs(constraints[:defects].reshape(-1, 4)) * units).max()),
            float((margin - constraints[defects:]).max(initial=0.0)),
            float(np.maximum(lbx - values, values - ubx).max()) * max(1.0, *bounds, radius),
            max(self.goal.miss(end)) if steady else math.inf,
        )
        path = TrailerPath(
            np.append(0.0, np.cumsum(steps)),
            self.goal.from_frame(states.reshape(-1, 4) * units),
            controls,
        )
        # Not but for rounding where it was told to start.
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
