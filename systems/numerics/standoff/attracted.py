"""Which states of a stand-off loop with an integral part are attracted, many at once.

For pictures: the border is known to the step of the integration, not exactly (see `separatrix`).
"""

import numpy as np

from .energy import edge, energy
from .equilibria import other_equilibrium, root_slope, wanted_equilibrium
from .loop import StandoffLoop

_STEPS = 4000
_STEP = 0.02


def attracted_states(loop: StandoffLoop, y: np.ndarray, integral: np.ndarray) -> np.ndarray:
    """Follow motions until the energy certifies them, or they pass the edge for good.

    Motions beyond the singularity count as not attracted, and so do those that are undecided at
    the end, beside the border.

    Args:
        loop: With an integral part.
        y: Distances, any shape [m].
        integral: Of f, same shape [m s].

    Returns:
        Whether each state ends at the wanted equilibrium, same shape.
    """
    if loop.error.a == 0:
        # The energy grows without bound.
        return np.ones(y.shape, dtype=bool)
    side = 1.0 if loop.error.a > 0 else -1.0
    rest, border, other = wanted_equilibrium(loop).y, edge(loop), other_equilibrium(loop).y
    span, level = abs(border - rest), float(energy(loop, border, 0.0))
    speed = loop.kp * root_slope(loop) * span
    shape = y.shape
    states = np.stack([np.ravel(y), np.ravel(integral)]).astype(float)
    found = np.zeros(states.shape[1], dtype=bool)
    alive = np.arange(states.shape[1])

    def field(state):
        """The smooth equations, at a pace of at most one `span` in the unit of time."""
        inertia = loop.inertia(state[0])
        rates = np.stack(
            [loop.kp * loop.miss(state[0]) + loop.ki * state[1], loop.miss(state[0]) * inertia]
        )
        return rates * span / (speed + np.hypot(rates[0], rates[1]))

    for _ in range(_STEPS):
        now = states[:, alive]
        inside = (side * (border - now[0]) > 0) & (energy(loop, now[0], now[1]) < level)
        found[alive[inside]] = True
        # Beyond the other equilibrium, with an integral that drives it on.
        gone = (side * (now[0] - other) >= 0) & (side * now[1] >= 0)
        gone |= loop.inertia(now[0]) <= 0
        alive = alive[~(inside | gone)]
        if alive.size == 0:
            break
        now = states[:, alive]
        half = field(now + _STEP / 2 * field(now))
        states[:, alive] = now + _STEP * half
    return found.reshape(shape)
