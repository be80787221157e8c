"""What extremals are made of: turns, merging curves and singular arcs, and paths of them.

They are computed in the normalised model (speed v = 1 or -1, trailer length 1, hitch on the axle),
seen from the goal.

With a = sin(beta/2) and b = cos(beta/2), beta' = omega - v sin(beta) is the direction of the
linear flow a' = (omega b - v a)/2, b' = (v b - omega a)/2, whose matrix squares to
(v^2 - omega^2)/4: regular primitives (omega = +-1) move (a, b) along a line, which is (3.28)
without its poles, and straights (omega = 0) give tan(beta/2) exp(-v t).

Where the switching function (3.24) vanishes along an arc, its second derivative gives
lambda_beta = -lambda_0 omega, and with lambda_beta' = v lambda_beta cos(beta)

    omega' = v omega cos(beta),    beta' = omega - v sin(beta),

so that omega = v sin(beta) +- sqrt(rho^2 - cos(beta)^2), rho constant, and beta'' =
sin(beta) cos(beta): a pendulum upside down. Straights and merging curves (3.29)-(3.31) have
rho = 1, straights omega = 0. Kept as (beta, omega) the arc passes beta' = 0 without a choice of
sign.

Source: Zhang 2014, (3.25)-(3.31).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...compiled import compiled, kernel
from ...errors import require, require_finite
from ..goal import Goal
from ..plan import TrailerPath
from ..trailer import Trailer

# Relative; rounding in speed = turn rate * length is no reason to refuse a trailer.
_ROUNDING = 1e-9


@dataclass(frozen=True)
class GoalFrame:
    """Unit of length: the trailer's; of time: one radian at the greatest turn rate.

    Attributes:
        trailer: Whose scaling reduces to the normalised model.
        goal: Lies at the origin, heading along x.
        start: x, y, theta, beta there; theta in (-pi, pi].
        theta: Heading of the start in the world, as given [rad].
    """

    trailer: Trailer
    goal: Goal
    start: tuple[float, float, float, float]
    theta: float

    def world_times(self, times: np.ndarray) -> np.ndarray:
        """Of normalised times, shape (n,) [s]."""
        return times / self.trailer.turn_rate

    def world_states(self, states: np.ndarray) -> np.ndarray:
        """Of normalised states, shape (n, 4); theta as continuous as it was."""
        x, y, heading, _ = self.goal.state
        east, north = math.cos(heading), math.sin(heading)
        length = self.trailer.length
        world = np.array(states, dtype=float)
        world[:, 0] = x + length * (east * states[:, 0] - north * states[:, 1])
        world[:, 1] = y + length * (north * states[:, 0] + east * states[:, 1])
        world[:, 2] += self.theta - self.start[2]
        return world


def goal_frame(trailer: Trailer, start, goal: Goal) -> GoalFrame | None:
    """The question in the normalised model, or None where the trailer does not scale to it.

    It does with the hitch on the axle and speed = turn rate * length.

    Raises:
        InvalidInput: The start is not four finite numbers.
    """
    require(len(start) == 4, "start", "be (x, y, theta, beta)", start)
    for value in start:
        require_finite("start", float(value))
    scales = math.isclose(trailer.speed, trailer.turn_rate * trailer.length, rel_tol=_ROUNDING)
    if trailer.hitch_offset != 0 or not scales:
        return None
    x, y, heading, _ = goal.state
    east, north = math.cos(heading), math.sin(heading)
    dx, dy = (float(start[0]) - x) / trailer.length, (float(start[1]) - y) / trailer.length
    theta = math.remainder(float(start[2]) - heading, math.tau)
    beta = math.remainder(float(start[3]), math.tau)
    local = (east * dx + north * dy, east * dy - north * dx, theta, beta)
    return GoalFrame(trailer, goal, local, float(start[2]))


NOT_SCALABLE = "not applicable: needs speed = turn rate * length and the hitch on the axle"


@kernel
def turned_beta(beta, v, omega, t):
    """Trailer angle after a constant turn rate, and how the flow contracts.

    Args:
        beta: At the start [rad].
        v: Speed, 1 or -1.
        omega: Turn rate, at most 1 in size.
        t: Duration, of any sign.

    Returns:
        beta at the end, not wrapped [rad], and the factor d(beta at the start)/d(beta at the end)
        by which the costate of beta grows.
    """
    a = math.sin(0.5 * beta)
    b = math.cos(0.5 * beta)
    rate = 0.5 * math.sqrt(max(v * v - omega * omega, 0.0))
    if rate * abs(t) > 1e-9:
        even = math.cosh(rate * t)
        odd = math.sinh(rate * t) / rate
    else:
        even = 1.0
        odd = t
    a_end = even * a + 0.5 * odd * (omega * b - v * a)
    b_end = even * b + 0.5 * odd * (v * b - omega * a)
    turned = 2.0 * math.atan2(b * a_end - a * b_end, a * a_end + b * b_end)
    return beta + turned, a_end * a_end + b_end * b_end


@kernel
def turning_arc(x, y, theta, beta, v, omega, t):
    """State after a constant turn rate: a regular primitive (3.25)-(3.28) or a straight.

    The chord of a circle of v/omega is v t sinc(omega t / 2) along the mean heading, which holds
    for straights too.

    Returns:
        x, y, theta, beta; angles not wrapped.
    """
    half = 0.5 * omega * t
    chord = v * t
    if abs(half) > 1e-9:
        chord *= math.sin(half) / half
    beta_end, _ = turned_beta(beta, v, omega, t)
    return (
        x + chord * math.cos(theta + half),
        y + chord * math.sin(theta + half),
        theta + omega * t,
        beta_end,
    )


@kernel
def merging_curve(x, y, theta, beta, v, t):
    """State after a merging curve: omega = 2 v sin(beta), and beta' = v sin(beta).

    The line has the heading theta - 2 beta and lies 2 sin(beta) to the right of the tractor; on it
    the tractor gets on by v t + 2 (cos(beta(t)) - cos(beta(0))). Printed, (3.29)-(3.31) do not say
    which way: driven forwards the curve leaves the line, in reverse it merges onto it. The bound
    on the turn rate holds while |sin(beta)| <= 1/2 (3.31).

    Returns:
        x, y, theta, beta; angles not wrapped.
    """
    a = math.sin(0.5 * beta)
    b = math.cos(0.5 * beta)
    a_end = a * math.exp(0.5 * v * t)
    b_end = b * math.exp(-0.5 * v * t)
    beta_end = beta + 2.0 * math.atan2(b * a_end - a * b_end, a * a_end + b * b_end)
    line = theta - 2.0 * beta
    along = v * t + 2.0 * (math.cos(beta_end) - math.cos(beta))
    across = 2.0 * (math.sin(beta_end) - math.sin(beta))
    return (
        x + along * math.cos(line) - across * math.sin(line),
        y + along * math.sin(line) + across * math.cos(line),
        line + 2.0 * beta_end,
        beta_end,
    )


# Terms of the series; its last ones choose the step, so that what is left out is about this much.
TERMS = 16
_TRUNCATION = 1e-13
_LONGEST_STEP = 2.0


@kernel
def singular_arc(x, y, theta, beta, omega, v, t, series):
    """State after a singular arc.

    Args:
        x: At the start [m].
        y: At the start [m].
        theta: At the start [rad].
        beta: At the start [rad].
        omega: Turn rate at the start, which chooses the arc.
        v: Speed, 1 or -1.
        t: Duration, of any sign.
        series: Scratch, shape (7, TERMS + 1).

    Returns:
        x, y, theta, beta, omega; angles not wrapped.
    """
    left = abs(t)
    sign = 1.0 if t >= 0.0 else -1.0
    while left > 0.0:
        _expand(theta, beta, omega, v, series)
        largest = 1e-300
        for row in range(7):
            for k in range(TERMS - 1, TERMS + 1):
                largest = max(largest, abs(series[row, k]))
        h = min(min(_LONGEST_STEP, (_TRUNCATION / largest) ** (1.0 / TERMS)), left)
        left -= h
        x, y, theta, beta, omega = _sum(x, y, v, sign * h, series)
    return x, y, theta, beta, omega


@kernel
def _expand(theta, beta, omega, v, series):
    # Rows: beta, its sine and cosine, omega, theta, its sine and cosine.
    series[0, 0] = beta
    series[1, 0] = math.sin(beta)
    series[2, 0] = math.cos(beta)
    series[3, 0] = omega
    series[4, 0] = theta
    series[5, 0] = math.sin(theta)
    series[6, 0] = math.cos(theta)
    for k in range(TERMS):
        over = 1.0 / (k + 1)
        series[0, k + 1] = (series[3, k] - v * series[1, k]) * over
        series[4, k + 1] = series[3, k] * over
        sine, cosine, turn, north, east = 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(k + 1):
            beta_rate = (j + 1) * series[0, j + 1]
            theta_rate = (j + 1) * series[4, j + 1]
            sine += beta_rate * series[2, k - j]
            cosine -= beta_rate * series[1, k - j]
            turn += series[3, j] * series[2, k - j]
            north += theta_rate * series[6, k - j]
            east -= theta_rate * series[5, k - j]
        series[1, k + 1] = sine * over
        series[2, k + 1] = cosine * over
        series[3, k + 1] = v * turn * over
        series[5, k + 1] = north * over
        series[6, k + 1] = east * over


@kernel
def _sum(x, y, v, h, series):
    # The state after h; x and y are integrals of the last two rows.
    ahead, left = 0.0, 0.0
    beta, omega, theta = series[0, TERMS], series[3, TERMS], series[4, TERMS]
    for k in range(TERMS - 1, -1, -1):
        ahead = ahead * h + series[6, k] / (k + 1)
        left = left * h + series[5, k] / (k + 1)
        beta = beta * h + series[0, k]
        omega = omega * h + series[3, k]
        theta = theta * h + series[4, k]
    return x + v * h * ahead, y + v * h * left, theta, beta, omega


@compiled
def singular_samples(state, omega, v, times):
    """States and turn rates along a singular arc.

    Args:
        state: x, y, theta, beta at the start, shape (4,).
        omega: Turn rate at the start.
        v: Speed, 1 or -1.
        times: Since the start, shape (n,).

    Returns:
        x, y, theta, beta and omega, shape (n, 5).
    """
    series = np.empty((7, TERMS + 1))
    samples = np.empty((times.size, 5))
    for i in range(times.size):
        samples[i] = singular_arc(
            state[0], state[1], state[2], state[3], omega, v, times[i], series
        )
    return samples


# Between samples, in units of time of the normalised model. A turn rate that changes is held from
# sample to sample, at its mean: with this step the held one ends within 1e-6 of the true one.
_TURN_STEP = 0.05
_SINGULAR_STEP = 0.003
# Shorter arcs are rounding.
SHORTEST = 1e-9


class Arc(NamedTuple):
    """One arc of a path in the normalised model, driven forwards.

    Attributes:
        omega: Its turn rate, on a singular arc at its start; in units of the bound.
        duration: In units of the normalised model.
        is_singular: Along which the switching function vanishes.
    """

    omega: float
    duration: float
    is_singular: bool = False

    @property
    def letter(self) -> str:
        """L, R, or S; a singular arc that turns is M, as merging curves are of this kind."""
        if self.is_singular:
            return "S" if abs(self.omega) < 1e-7 else "M"
        return {1.0: "L", -1.0: "R"}.get(self.omega, "S")


def arc_word(arcs: list[Arc]) -> str:
    """Letters and durations, as "L 0.52, S 2.10"."""
    return ", ".join(f"{arc.letter} {arc.duration:.4f}" for arc in arcs)


def arc_samples(start: np.ndarray, arc: Arc) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Along one arc, both ends included.

    Args:
        start: x, y, theta, beta in the normalised model, shape (4,).
        arc: The arc.

    Returns:
        Times since its start, shape (n,); states, shape (n, 4); turn rates, shape (n,).
    """
    step = _SINGULAR_STEP if arc.is_singular else _TURN_STEP
    clock = np.linspace(0.0, arc.duration, math.ceil(arc.duration / step) + 1)
    if arc.is_singular:
        samples = singular_samples(start, arc.omega, 1.0, clock)
        return clock, samples[:, :4], samples[:, 4]
    x, y, theta, beta = map(float, start)
    states = [turning_arc(x, y, theta, beta, 1.0, arc.omega, float(t)) for t in clock]
    return clock, np.array(states), np.full(clock.shape, arc.omega)


def arc_path(frame: GoalFrame, arcs: list[Arc]) -> TrailerPath:
    """The path along the arcs from the frame's start, in the world's units."""
    times, states, controls = [np.zeros(1)], [np.array([frame.start])], []
    for arc in arcs:
        if arc.duration < SHORTEST:
            continue
        clock, along, _ = arc_samples(states[-1][-1], arc)
        times.append(times[-1][-1] + clock[1:])
        states.append(along[1:])
        controls.append(np.diff(along[:, 2]) / np.diff(clock))
    trailer = frame.trailer
    turn_rates = trailer.turn_rate * np.concatenate([*controls, np.empty(0)])
    return TrailerPath(
        times=frame.world_times(np.concatenate(times)),
        states=frame.world_states(np.concatenate(states)),
        controls=np.column_stack([np.full(turn_rates.shape, trailer.speed), turn_rates]),
    )
