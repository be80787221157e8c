"""The path that the policy of a table drives when nothing disturbs it."""

import math
from dataclasses import dataclass

import numpy as np

from ..arc_words.held_controls import hold_beta, shift_of
from ..arc_words.quickest import word_path
from ..plan import TrailerPath
from ..trailer import Trailer
from .policy import best_word
from .value_function import ValueFunction

# A path that takes this many times the promised time, and half a radian's turn more, shows that the
# table is not to be believed there.
LATE = 1.3
_LATE_TURN = 0.5


@dataclass(frozen=True, eq=False)
class Rollout:
    """A path driven down a value function.

    Attributes:
        path: Into the goal box; the start alone where the table knows no way.
        arrived: Whether its end is inside the goal box of the table.
        promised: Time to go at the start by the table; infinite: unreachable [s].
    """

    path: TrailerPath
    arrived: bool
    promised: float


def roll_out(value: ValueFunction, start) -> Rollout:
    """Drive the way that `best_word` takes.

    Args:
        value: Whose trailer drives.
        start: x, y, theta, beta [m], [m], [rad], [rad].
    """
    state = np.array(start, dtype=float)
    promised = float(value.time_to_go(state))
    word = best_word(value, state)
    if word is None or not len(word.durations):
        path = TrailerPath(np.zeros(1), state[None], np.zeros((0, 2)))
    else:
        path = word_path(value.trailer, state, word)
    return Rollout(path, word is not None, promised)


def inside(value: ValueFunction, states) -> np.ndarray:
    """Whether states are in the table's goal box, shape (..., 4) -> (...,)."""
    return value.goal.contains(value.to_table(states))


def is_late(value: ValueFunction, promised: float, time: float) -> bool:
    """Whether a path took so much longer than promised that the promise is not to be believed.

    Args:
        value: The table.
        promised: Time to go at the start [s].
        time: Of the path [s].
    """
    return time > LATE * promised + _LATE_TURN / value.trailer.turn_rate


def drive(trailer: Trailer, state, v: float, omega: float, duration: float) -> np.ndarray:
    """The state after a held control, shape (4,).

    Args:
        trailer: Which drives.
        state: x, y, theta, beta [m], [m], [rad], [rad].
        v, omega: The control [m/s], [rad/s].
        duration: For how long it is held [s].
    """
    x, y, theta, beta = (float(value) for value in state)
    dx, dy = shift_of(theta, v, omega, duration)
    steps = max(1, math.ceil(20 * duration * (trailer.turn_rate + trailer.speed / trailer.length)))
    beta = hold_beta(beta, v, omega, duration, steps, trailer)[-1]
    return np.array([x + dx, y + dy, theta + omega * duration, beta])
