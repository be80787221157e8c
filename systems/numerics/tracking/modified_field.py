"""The modified pursuit: the pursuit field, and a pull towards the evader that keeps it near.

Source: Zhang 2014, 2.2.5, (2.7) and Figure 2.14. The thesis's pull does not end; here it fades
out at a stand-off distance, since the robots have bodies.
"""

import math

import numpy as np

from ..compiled import compiled


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

    v' is as long as the speed and points at the pursuer's own evader; over the last stretch before
    the stand-off distance it falls to zero.

    Args:
        weight: w, from 0 (the pull alone) to 1 (the field alone).
        speed: Top speed [m/s].
        stand_off: Distance from the evader at which the pull is zero [m].
        fade: Length of the stretch over which it falls to zero [m].
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
        pull = speed * min(max((distance - stand_off) / fade, 0.0), 1.0)
        scale = pull / distance if distance > 0.0 else 0.0
        velocities[2 * i] = weight * field[2 * i] + (1.0 - weight) * scale * x
        velocities[2 * i + 1] = weight * field[2 * i + 1] + (1.0 - weight) * scale * y
    return velocities
