"""Arcs of constant turn rate and merging curves, in closed form.

In the normalised model (speed v = 1 or -1, trailer length 1, hitch on the axle).

With a = sin(beta/2) and b = cos(beta/2), beta' = omega - v sin(beta) is the direction of the
linear flow a' = (omega b - v a)/2, b' = (v b - omega a)/2, whose matrix squares to
(v^2 - omega^2)/4: regular primitives (omega = +-1) move (a, b) along a line, which is (3.28)
without its poles, and straights (omega = 0) give tan(beta/2) exp(-v t).

Source: Zhang 2014, (3.25)-(3.31).
"""

import math

from ...compiled import kernel


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
