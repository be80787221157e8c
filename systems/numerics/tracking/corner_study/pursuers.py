"""The pursuers that are put to the test: the fields, and simpler rules to compare them with."""

import math

from numba import njit

from ..corner_fields import (
    FIELDS,
    MARGIN,
    TABLE,
    TABLE_UP,
    margin_field,
    table_field,
    table_field_up,
)

TO_STAR = 3
TURN = 4
CHASE = 5
STAND = 6

# What the pursuers are called: the fields, always towards the star region, always turning the
# sight ray, straight at the evader, standing still.
PURSUERS = {**FIELDS, "to_star": TO_STAR, "turn": TURN, "chase": CHASE, "stand": STAND}


@njit(cache=True)
def pursuer_direction(
    kind: int, r_p: float, phi_p: float, r_e: float, phi_e: float, alpha: float, a: float
) -> tuple[float, float]:
    """Velocity of a pursuer short of the star region, in the corner's frame, at most one long.

    Args:
        kind: A code out of PURSUERS.
        r_p, phi_p, r_e, phi_e, alpha, a: As in `margin_field`; phi_p < 0.
    """
    if kind == MARGIN:
        ux, uy, _ = margin_field(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    if kind == TABLE:
        ux, uy, _ = table_field(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    if kind == TABLE_UP:
        ux, uy, _ = table_field_up(r_p, phi_p, r_e, phi_e, alpha, a)
        return ux, uy
    cosine = math.cos(phi_p)
    sine = math.sin(phi_p)
    if kind == TURN:
        return -sine, cosine
    if kind == TO_STAR:
        return (0.0, 1.0) if cosine >= 0.0 else (-cosine, -sine)
    if kind == CHASE:
        x = r_e * math.cos(phi_e) - r_p * cosine
        y = r_e * math.sin(phi_e) - r_p * sine
        length = math.hypot(x, y)
        return x / length, y / length
    return 0.0, 0.0
