"""Which carts and distances planners can compute with: others are refused before they begin.

Beyond these ranges a time step that follows the trailer is lost in rounding, or there are more of
them than fit into memory.
"""

import math
from collections.abc import Sequence

from ..errors import require
from .goal import Goal
from .trailer import Trailer

# Of the length of the trailer in turning radii, and of the hitch offset in lengths.
SHORTEST, LONGEST = 1e-3, 1e3
MOST_OFFSET = 100.0
# Turning radii from start to goal, and from either to the origin; turns of a heading [rad].
FARTHEST, FARTHEST_OUT = 1e5, 1e7
MOST_TURNED = 1e6


def require_plannable_cart(trailer: Trailer) -> None:
    """Refuse a cart whose trailer is much shorter or longer than it can turn.

    Args:
        trailer: The cart.

    Raises:
        InvalidInput: In one line that says what is out of range.
    """
    radius = trailer.speed / trailer.turn_rate
    require(0 < radius < math.inf, "speed / turn_rate", "be a turning radius", radius)
    least, most = SHORTEST * radius, LONGEST * radius
    words = f"be {SHORTEST:g} to {LONGEST:g} turning radii, {least:g} to {most:g} m"
    require(least <= trailer.length <= most, "length", words, trailer.length)
    offset = abs(trailer.hitch_offset)
    words = f"be at most {MOST_OFFSET:g} lengths of the trailer"
    require(offset <= MOST_OFFSET * trailer.length, "hitch_offset", words, trailer.hitch_offset)


def require_plannable(trailer: Trailer, start: Sequence[float], goal: Goal) -> None:
    """Refuse a question that is too far, or too far out, for rounding to leave an answer.

    Args:
        trailer: The cart.
        start: x, y, theta, beta [m], [m], [rad], [rad].
        goal: What is to be reached.

    Raises:
        InvalidInput: In one line that says what is out of range.
    """
    require_plannable_cart(trailer)
    radius = trailer.speed / trailer.turn_rate
    for name, state in (("start", start), ("goal", goal.state)):
        words = f"be within {FARTHEST_OUT:g} turning radii of the origin"
        require(max(map(abs, state[:2])) <= FARTHEST_OUT * radius, name, words, list(state[:2]))
        words = f"have angles of at most {MOST_TURNED:g} rad"
        require(max(map(abs, state[2:])) <= MOST_TURNED, name, words, list(state[2:]))
    away = math.dist(start[:2], goal.state[:2])
    words = f"be within {FARTHEST:g} turning radii of the goal"
    require(away <= FARTHEST * radius, "start", words, f"{away:g} m")
