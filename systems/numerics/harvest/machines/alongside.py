"""Whether a cart is where an auger can reach it."""

import numpy as np

from ...compiled import compiled

# How far the middle of the trailer's box may be from where it should, along the combine and
# across [m], and how much it may be turned against it [rad].
ALONG, ACROSS, TURNED = 2.5, 1.2, 0.2
# A combine that stands swings its auger, or turns: a cart is in reach within so many times the
# usual distance, however it stands. Otherwise one that gets full in a turn would wait for ever.
STANDING = 2.0
# From the trailer's axle ahead to the middle of its box, in trailer lengths.
MIDDLE = 0.15


@compiled
def box_middle(state, length, hitch_offset):
    """Middle of a trailer's box and its heading, from x, y, theta, beta; x, y, theta.

    Args:
        state: x, y, theta, beta, shape (4,) [m], [m], [rad], [rad].
        length, hitch_offset: Of the trailer [m].
    """
    heading = state[2] - state[3]
    behind = length * (1.0 - MIDDLE)
    x = state[0] - hitch_offset * np.cos(state[2]) - behind * np.cos(heading)
    y = state[1] - hitch_offset * np.sin(state[2]) - behind * np.sin(heading)
    return x, y, heading


@compiled
def is_alongside(pose, state, length, hitch_offset, reach, stands):
    """Whether a combine's auger pours into a cart's trailer.

    Args:
        pose: x, y, theta of the combine.
        state: x, y, theta, beta of the cart.
        length: Of the trailer [m].
        hitch_offset: [m].
        reach: Where the box should be, to the left of the combine's middle [m].
        stands: Whether the combine stands.
    """
    x, y, heading = box_middle(state, length, hitch_offset)
    dx, dy = x - pose[0], y - pose[1]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    if stands and np.hypot(dx, dy) <= STANDING * reach:
        return True
    turned = (heading - pose[2] + np.pi) % (2 * np.pi) - np.pi
    return (
        abs(c * dx + s * dy) <= ALONG
        and abs(c * dy - s * dx - reach) <= ACROSS
        and abs(turned) <= TURNED
    )


@compiled
def pair_up(poses, states, wanted, stands, length, hitch_offset, reach):
    """Which cart each combine unloads into.

    Args:
        poses: Of the combines, shape (N, 3).
        states: Of the carts, shape (K, 4).
        wanted: Combine that each cart is to empty now, or -1, shape (K,).
        stands: Whether each combine stands, shape (N,).
        length: Of a trailer [m].
        hitch_offset: [m].
        reach: See `is_alongside` [m].

    Returns:
        Number of the cart, or -1, shape (N,).
    """
    carts = np.full(len(poses), -1.0)
    for k in range(len(states)):
        n = int(wanted[k])
        if (
            0 <= n < len(poses)
            and carts[n] < 0
            and is_alongside(poses[n], states[k], length, hitch_offset, reach, stands[n])
        ):
            carts[n] = k
    return carts
