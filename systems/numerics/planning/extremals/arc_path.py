"""A path put together from arcs."""

import math
from typing import NamedTuple

import numpy as np

from ..plan import TrailerPath
from .arcs import turning_arc
from .frame import GoalFrame
from .singular import singular_samples

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
