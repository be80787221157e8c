"""Moving tractors with their trailers, step by step."""

from ...compiled import compiled
from ...planning.trailer import trailer_rates

rates = compiled(trailer_rates)


@compiled
def drive_team(states, control, top_speed, top_turn_rate, hitch, period, count):
    """States of carts after controls held for a period, by Runge-Kutta steps of order 4.

    The equations are those of `planning.trailer`. Controls beyond the bounds are clipped.

    Args:
        states: x, y, theta, beta of each cart, one after the other, shape (4 K,) [m], [m], [rad],
            [rad].
        control: Speed and turn rate of each tractor, likewise, shape (2 K,) [m/s], [rad/s].
        top_speed: Largest, forwards and backwards [m/s].
        top_turn_rate: Largest, to both sides [rad/s].
        hitch: Of the carts.
        period: [s].
        count: Number of steps.

    Returns:
        Shape (4 K,).
    """
    step = period / count
    moved = states.copy()
    for k in range(len(states) // 4):
        v = min(max(control[2 * k], -top_speed), top_speed)
        omega = min(max(control[2 * k + 1], -top_turn_rate), top_turn_rate)
        if v == 0.0 and omega == 0.0:
            continue
        x, y, theta, beta = states[4 * k : 4 * k + 4]
        for _ in range(count):
            a = rates(theta, beta, v, omega, hitch)
            b = rates(theta + step / 2 * a[2], beta + step / 2 * a[3], v, omega, hitch)
            c = rates(theta + step / 2 * b[2], beta + step / 2 * b[3], v, omega, hitch)
            d = rates(theta + step * c[2], beta + step * c[3], v, omega, hitch)
            x += step / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
            y += step / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
            theta += step / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2])
            beta += step / 6 * (a[3] + 2 * b[3] + 2 * c[3] + d[3])
        moved[4 * k], moved[4 * k + 1] = x, y
        moved[4 * k + 2], moved[4 * k + 3] = theta, beta
    return moved
