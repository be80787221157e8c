"""The modified pursuit: the pursuit field, and a pull towards the evader that keeps it near.

Source: Zhang 2014, 2.2.5, (2.7) and Figure 2.14. The thesis's robots may come arbitrarily near
their evaders; here their speed of approach is limited nearby, because robots have bodies.
"""

import math

import numpy as np

from ..compiled import compiled

# An evader nearer than this has no direction: the pursuer waits [m].
SAME_SPOT = 1e-9


@compiled
def modified_velocities(
    weight: float,
    speed: float,
    stand_off: float,
    fade: float,
    pursuers: np.ndarray,
    evaders: np.ndarray,
    assignment: np.ndarray,
    field: np.ndarray,
) -> np.ndarray:
    """v = w v_o + (1 - w) v' for each pursuer (2.7).

    v' has the length `speed` and points to the pursuer's own evader. The component of v towards
    the evader is then limited to speed * (distance - stand_off) / fade, from -speed to speed, so
    that at the stand-off distance the pursuer comes no nearer, and nearer than that it backs off.

    Args:
        weight: w, from 0 (the pull alone) to 1 (the field alone).
        speed: Top speed [m/s].
        stand_off: Distance from the evader to keep [m].
        fade: Distance beyond the stand-off over which the limit grows to `speed` [m].
        pursuers, evaders: Positions, shapes (2 n,), (2 m,) [m].
        assignment: Each pursuer's evader, -1 for none, shape (n,).
        field: Velocities v_o of the pursuit field, shape (2 n,) [m/s].

    Returns:
        Shape (2 n,) [m/s]; zero for pursuers without an evader.
    """
    velocities = np.zeros(len(pursuers))
    for i in range(len(assignment)):
        j = int(assignment[i])
        if j < 0:
            continue
        x = evaders[2 * j] - pursuers[2 * i]
        y = evaders[2 * j + 1] - pursuers[2 * i + 1]
        distance = math.hypot(x, y)
        if distance < SAME_SPOT:
            continue
        x, y = x / distance, y / distance
        vx = weight * field[2 * i] + (1.0 - weight) * speed * x
        vy = weight * field[2 * i + 1] + (1.0 - weight) * speed * y
        limit = speed * min(max((distance - stand_off) / fade, -1.0), 1.0)
        excess = max(vx * x + vy * y - limit, 0.0)
        vx, vy = vx - excess * x, vy - excess * y
        # Backing off and running along the field at once may be too fast.
        scale = min(speed / max(math.hypot(vx, vy), SAME_SPOT * speed), 1.0)
        velocities[2 * i], velocities[2 * i + 1] = scale * vx, scale * vy
    return velocities
