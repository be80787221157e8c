"""How common agents walk about: straight on until something is near, then turn, and on.

Source: Zhang 2014, 2.3.4.3: "we let them move forward in every time instant till obstacle is met",
"estimate the relative location of the obstacle ... and let common agent turn before collision".
How far they turn is ours: by a random angle, and farther until the way is free.
"""

import math
from dataclasses import dataclass

import numpy as np

from ...errors import require, require_positive
from .infrared import InfraredRing


@dataclass(frozen=True, kw_only=True)
class WanderingLaw:
    """What an agent does about what it feels.

    Attributes:
        speed: Straight on [m/s].
        turn_rate: On the spot [rad/s].
        turn_range: A range ahead at which it stops and turns [m].
        least_turn, greatest_turn: Between which the angle of a turn is drawn [rad].
        centring: Curvature of its way per difference of the outer ranges [rad/m^2].

    Raises:
        InvalidInput: A number is out of its range.
    """

    speed: float = 0.1
    turn_rate: float = 1.0
    turn_range: float = 0.1
    least_turn: float = math.radians(40)
    greatest_turn: float = math.radians(150)
    centring: float = 20.0

    def __post_init__(self) -> None:
        for name in ("speed", "turn_rate", "turn_range", "least_turn", "centring"):
            require_positive(name, getattr(self, name))
        require(
            self.greatest_turn >= self.least_turn,
            "greatest_turn",
            f"be at least least_turn, {self.least_turn:g} rad",
            self.greatest_turn,
        )


def wander(
    law: WanderingLaw,
    ring: InfraredRing,
    turns: np.ndarray,
    ranges: np.ndarray,
    draws: np.ndarray,
    period: float,
) -> tuple[np.ndarray, np.ndarray]:
    """One period of every agent.

    Args:
        law: Parameters.
        ring: The sensors.
        turns: How far each still has to turn, left positive, shape (n,) [rad]; 0: straight on.
        ranges: Shape (n, sensors) [m].
        draws: A random number from [0, 1) for each, shape (n,).
        period: For how long commands are held [s].

    Returns:
        What is left to turn after the period, shape (n,) [rad], and speed and turn rate for the
        period, shape (n, 2) [m/s], [rad/s].
    """
    bearings = np.array(ring.bearings)
    ahead = ranges[:, np.abs(bearings) < math.radians(45)].min(axis=1, initial=ring.reach)
    left = ranges[:, bearings > 0].sum(axis=1)
    right = ranges[:, bearings < 0].sum(axis=1)
    blocked = ahead < law.turn_range
    # Where both sides are alike the draw decides, too.
    side = np.where(
        left > right, 1.0, np.where(left < right, -1.0, np.where(draws < 0.5, -1.0, 1.0))
    )
    drawn = law.least_turn + draws * (law.greatest_turn - law.least_turn)
    # A turn that has begun goes on the same way; one that ends at a wall is prolonged.
    turns = np.where(blocked & (turns == 0.0), side * drawn, turns)
    step = law.turn_rate * period
    rates = np.clip(turns, -step, step) / period
    rest = turns - rates * period
    rest = np.where((rest == 0.0) & (turns != 0.0) & blocked, np.sign(turns) * step, rest)
    moving = turns == 0.0
    outer = law.speed * law.centring * (ranges[:, 0] - ranges[:, -1])
    rates = np.where(moving, np.clip(outer, -law.turn_rate, law.turn_rate), rates)
    return rest, np.column_stack([np.where(moving, law.speed, 0.0), rates])
