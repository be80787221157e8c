"""Region of attraction of the sampled stand-off loop, with delay, limit and filter.

Near rest a motion is decided by a certificate. With the linear loop x+ = M x, P of the Lyapunov
equation M'PM - P = -I, |x|^2 = x'Px, and the miss s d - a d^2 of a deviation d of the oldest
distance, which pushes the state along g,

    |x+| <= sqrt(1 - 1 / max eig P) |x| + |g| |a| d^2,   d^2 <= (P^-1)_dd |x|^2,

so that |x| falls in every ball where the second term is less than the decrease by the first, as
long as the command stays within its limit there. Far away a motion is lost for good once it is
beyond the other equilibrium, has not come nearer for as long as the delay, and neither integral nor
derivative pulls it back: then every later command drives it farther.

Source: ours.
"""

import math
import warnings
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgWarning, solve_discrete_lyapunov

from ..compiled import compiled
from .attraction import RegionOfAttraction
from .loop import StandoffLoop, other_equilibrium, span, wanted_equilibrium
from .sampled_loop import SampledPid, sampled_loop

# Starts that `sampled_region` tries: nearest and farthest from rest, in units of `span`; their
# number on each side; then, to refine the end of the region, their number in each round, and the
# number of rounds.
_NEAREST, _FARTHEST, _TRIED, _FINER, _ROUNDS = 1e-4, 1e4, 160, 8, 10
# The same `_FARTHEST` for a loop with a speed limit, which takes long over large distances.
_FARTHEST_LIMITED = 30.0
# How many times the slowest pole's time a motion is followed, and how many samples at most.
_TIMES, _MOST = 25.0, 40_000
# A motion is lost at this many times the larger of `span` and the farthest start.
_LOST = 1e6


@dataclass(frozen=True, eq=False)
class CertifiedBall:
    """States around rest certified to be attracted: |x| < radius, |x|^2 = x' matrix x.

    Attributes:
        matrix: P, shape (n, n).
        radius: Radius in the norm of P; zero for an unstable or hardly stable loop [1].
        parts: Which entries of the state of `SampledLoop.matrix` belong to x, shape (d + 3,).
    """

    matrix: np.ndarray
    radius: float
    parts: np.ndarray


class _Motion(NamedTuple):
    """What the compiled loop reads: error and reference, gains, clock, and where motions end."""

    a: float
    b: float
    c: float
    reference: float
    kp: float
    ki: float
    kd: float
    beta: float
    period: float
    limit: float
    rest: float
    other: float
    bound: float
    radius_squared: float


def certified_ball(
    loop: StandoffLoop, sampled: SampledPid, delay_samples: int = 0
) -> CertifiedBall:
    """A ball of states around rest whose attraction a Lyapunov inequality certifies.

    Args:
        loop: Gains, reference and error.
        sampled: Sample time, filter and limit.
        delay_samples: How many samples late the estimate comes.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    linear = sampled_loop(loop, sampled, delay_samples)
    parts = linear.parts()
    step = linear.matrix()[np.ix_(parts, parts)]
    # Nearer to one, the equation for P is lost in rounding.
    if np.abs(np.linalg.eigvals(step)).max() >= 1 - 1e-7:
        return CertifiedBall(np.eye(len(step)), 0.0, parts)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", LinAlgWarning)
            lyapunov = solve_discrete_lyapunov(step.T, np.eye(len(step)))
    except LinAlgWarning:
        return CertifiedBall(np.eye(len(step)), 0.0, parts)
    inverse = np.linalg.inv(lyapunov)
    lost = -math.expm1(0.5 * math.log1p(-1 / np.linalg.eigvalsh(lyapunov)[-1]))
    gain = linear.kp + linear.kd * linear.beta / linear.period
    push = np.zeros(len(parts))
    push[0], push[-2], push[-1] = -linear.period * gain, linear.period, linear.beta
    push = push[parts]
    oldest = inverse[delay_samples, delay_samples]
    bend = abs(loop.error.a)
    worst = math.sqrt(push @ lyapunov @ push) * bend * oldest
    radius = 0.99 * lost / worst if worst else math.inf
    # The command is -(x+ - x) / h in the first entry, the parabola's part added.
    row = (np.eye(len(step))[0] - step[0]) / linear.period
    strength = math.sqrt(row @ inverse @ row)
    bow = gain * bend * oldest
    if not math.isinf(sampled.limit):
        # The root of strength R + bow R^2 = limit, without a difference of equal numbers.
        root = math.sqrt(strength**2 + 4 * bow * sampled.limit)
        radius = min(radius, 0.99 * 2 * sampled.limit / (strength + root))
    return CertifiedBall(lyapunov, radius, parts)


def attracted_by_sampled(
    loop: StandoffLoop,
    sampled: SampledPid,
    y: np.ndarray,
    integral: np.ndarray | float = 0.0,
    *,
    delay_samples: int = 0,
) -> np.ndarray:
    """Simulate motions behind an evader at rest until it is decided whether they settle.

    Motions that are undecided at the end, on the border or in a cycle, count as not attracted.

    Args:
        loop: Gains, reference and error.
        sampled: Sample time, filter and limit.
        y: Distances at the start, any shape [m].
        integral: Of the estimated miss at the start, same shape or a number [m s].
        delay_samples: How many samples late the estimate comes; at first it is that of the start.

    Returns:
        Whether each state ends at the wanted equilibrium, same shape as `y`.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    rest, length = wanted_equilibrium(loop).y, span(loop)
    ball = certified_ball(loop, sampled, delay_samples)
    y = np.asarray(y, dtype=float)
    found = np.zeros(y.size, dtype=np.bool_)
    if ball.radius == 0:
        return found.reshape(y.shape)
    starts = y.ravel()
    # P for the full state: entries that do not belong to x have weight zero.
    matrix = np.zeros((delay_samples + 3, delay_samples + 3))
    matrix[np.ix_(ball.parts, ball.parts)] = ball.matrix
    linear = sampled_loop(loop, sampled, delay_samples)
    motion = _Motion(
        a=loop.error.a,
        b=loop.error.b,
        c=loop.error.c,
        reference=loop.reference,
        kp=linear.kp,
        ki=linear.ki,
        kd=linear.kd,
        beta=linear.beta,
        period=sampled.period,
        limit=sampled.limit,
        rest=rest,
        other=other_equilibrium(loop).y if loop.error.a else math.inf,
        bound=_LOST * max(length, float(np.abs(starts - rest).max(initial=0.0))),
        radius_squared=ball.radius**2,
    )
    integrals = np.broadcast_to(np.asarray(integral, dtype=float), y.shape).ravel().copy()
    count = _samples(loop, sampled, delay_samples, starts)
    _follow(motion, matrix, starts, integrals, delay_samples, count, found)
    return found.reshape(y.shape)


@compiled
def _follow(motion, matrix, starts, integrals, delay_samples, count, found):
    """Write into `found` which states reach the ball."""
    # The state of `SampledLoop.matrix`, and distances in a ring: the newest lies at `head`.
    state = np.empty(delay_samples + 3)
    ring = np.empty(delay_samples + 1)
    side = 1.0 if motion.a > 0 else -1.0
    for n in range(len(starts)):
        ring[:] = starts[n]
        head, rising, total = 0, 0, integrals[n]
        filtered = _miss(motion, starts[n])
        for k in range(count):
            oldest = ring[(head + 1) % (delay_samples + 1)]
            miss = _miss(motion, oldest)
            if k % 4 == 0 and (ring[0] - motion.rest) ** 2 < motion.radius_squared:
                # As P is at least the identity, |x| can only now be less than the radius.
                for j in range(delay_samples + 1):
                    state[j] = ring[(head - j) % (delay_samples + 1)] - motion.rest
                state[-2], state[-1] = total, filtered
                if np.dot(state, np.dot(matrix, state)) < motion.radius_squared:
                    found[n] = True
                    break
            # Lost: beyond the other equilibrium, and every term drives the motion farther.
            if (
                rising >= delay_samples
                and side * (oldest - motion.other) > 0
                and (motion.ki == 0 or side * total <= 0)
                and (motion.kd == 0 or side * (miss - filtered) <= 0)
            ):
                break
            rate = motion.beta * (miss - filtered) / motion.period
            wanted = motion.kp * miss + motion.ki * total + motion.kd * rate
            command = min(max(wanted, -motion.limit), motion.limit)
            total += motion.period * (miss + (command - wanted) / motion.kp)
            filtered += motion.period * rate
            now = ring[head] - motion.period * command
            rising = rising + 1 if side * command <= 0 else 0
            head = (head + 1) % (delay_samples + 1)
            ring[head] = now
            if not abs(now - motion.rest) < motion.bound:
                break


@compiled
def _miss(motion, y):
    return y - (motion.a * y * y + motion.b * y + motion.c) - motion.reference


def _samples(
    loop: StandoffLoop, sampled: SampledPid, delay_samples: int, starts: np.ndarray
) -> int:
    """Number of samples to simulate: enough for the slowest pole and for the speed limit."""
    count = _settling(loop, sampled, delay_samples)
    if not math.isinf(sampled.limit):
        rest = wanted_equilibrium(loop).y
        way = float(np.abs(starts - rest).max(initial=0.0))
        count += 3 * way / (sampled.limit * sampled.period)
    return math.ceil(min(count, _MOST))


def _settling(loop: StandoffLoop, sampled: SampledPid, delay_samples: int) -> float:
    """How many samples the slowest pole needs."""
    slowest = float(np.abs(sampled_loop(loop, sampled, delay_samples).poles()[0]))
    return _TIMES / max(1 - slowest, 1e-12)


def sampled_region(
    loop: StandoffLoop, sampled: SampledPid, delay_samples: int = 0
) -> RegionOfAttraction | None:
    """Interval of starts around rest that settle, with zero integral and an evader at rest.

    Unlike the continuous loop's, the set of such starts may have gaps; this is the interval around
    rest up to the first start, of some hundreds that are tried, that does not settle. Its ends are
    bisected. An end beyond 10,000 times the distance between the equilibria is infinite, with a
    limit beyond 30 times.

    Args:
        loop: Gains, reference and error.
        sampled: Sample time, filter and limit.
        delay_samples: How many samples late the estimate comes.

    Returns:
        None if the loop is not stable, or so slow for its sample time that its motions take more
        than 40,000 samples: use `region_of_attraction` then.

    Raises:
        InvalidInput: There is no equilibrium.
    """
    unstable = certified_ball(loop, sampled, delay_samples).radius == 0
    if unstable or _settling(loop, sampled, delay_samples) > _MOST:
        return None
    rest, length = wanted_equilibrium(loop).y, span(loop)

    def held(way: np.ndarray) -> np.ndarray:
        return attracted_by_sampled(loop, sampled, rest + way, delay_samples=delay_samples)

    farthest = _FARTHEST if math.isinf(sampled.limit) else _FARTHEST_LIMITED
    tried = length * np.geomspace(_NEAREST, farthest, _TRIED)
    settles = held(np.concatenate([tried, -tried]))
    ends = []
    for sign, half in ((-1.0, settles[_TRIED:]), (1.0, settles[:_TRIED])):
        if half.all():
            ends.append(sign * math.inf)
            continue
        first = int(np.argmin(half))
        inside, outside = (0.0 if first == 0 else tried[first - 1]), tried[first]
        for _ in range(_ROUNDS):
            between = np.linspace(inside, outside, _FINER + 2)
            good = held(sign * between[1:-1])
            last = int(np.argmin(good)) if not good.all() else _FINER
            inside, outside = between[last], between[last + 1]
        ends.append(rest + sign * inside)
    return RegionOfAttraction(ends[0], ends[1])
