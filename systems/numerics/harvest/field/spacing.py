"""How the distance between combines on adjacent rows shrinks (Zhang 2014, 3.4.1).

Each side of an inner ring is two header widths l shorter than the same side of the next ring
outwards, so that with every side, which is an iteration, the follower comes 2 l nearer:
d_i = d_init - 2 l (i - 1), i = 1, 2, ... On a rectangle that is 8 l a lap.
"""

import math

from ...errors import require, require_non_negative, require_positive

# Of a number of sides, so that rounding loses none.
ROUNDING = 1e-9


def gap_on_side(initial_gap: float, header_width: float, side: int) -> float:
    """Distance d_i by which the leader is ahead on a side [m].

    Args:
        initial_gap: On the first side, d_init [m].
        header_width: l [m].
        side: Number i of the side, from 1 on, over all laps.

    Raises:
        InvalidInput: A number is out of its range.
    """
    require_non_negative("initial_gap", initial_gap)
    require_positive("header_width", header_width)
    require(side >= 1, "side", "be 1 or more", side)
    return initial_gap - 2.0 * header_width * (side - 1)


def least_initial_gap(least_gap: float, header_width: float, sides: int) -> float:
    """Smallest d_init with which the gap is d_min or more on all sides: d_min + 2 l (I - 1) [m].

    Args:
        least_gap: d_min [m].
        header_width: l [m].
        sides: Number I of sides driven.

    Raises:
        InvalidInput: A number is out of its range.
    """
    require_non_negative("least_gap", least_gap)
    require_positive("header_width", header_width)
    require(sides >= 1, "sides", "be 1 or more", sides)
    return least_gap + 2.0 * header_width * (sides - 1)


def most_sides(initial_gap: float, least_gap: float, header_width: float) -> int:
    """Number of sides that can be driven before the gap falls below d_min; 0 if none.

    Args:
        initial_gap: d_init [m].
        least_gap: d_min [m].
        header_width: l [m].

    Raises:
        InvalidInput: A number is out of its range.
    """
    require_non_negative("initial_gap", initial_gap)
    require_non_negative("least_gap", least_gap)
    require_positive("header_width", header_width)
    spare = (initial_gap - least_gap) / (2.0 * header_width)
    return max(0, math.floor(spare + ROUNDING) + 1)
