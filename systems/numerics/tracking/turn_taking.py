"""Which robot goes first, where teammates hold each other up.

A robot that moves much slower than it wishes is waiting. In a group of teammates close to one
another, the one that has waited longest gets a turn, if that is long enough; of several, the one
nearest to the other team. The others make room for it, see `collision_avoidance`. A turn has a
fixed length: otherwise it would end with the first step that it allows. Then it is the next
robot's turn.
"""

import math

import numpy as np

from ..compiled import compiled

# A robot's waiting time grows below the first part of its desired speed, and is reset above the
# second.
WAITING, GOING = 0.1, 0.5

# After waiting this long a robot may have a turn [s].
PATIENCE = 0.6

# Length of a turn [s]: a wheeled robot turns about in one second, and then leaves.
TURN_LENGTH = 1.5

# Teammates with a smaller gap hold each other up, in parts of the distance at which they touch.
HOLDS_UP = 0.15


@compiled
def still_waiting(
    waiting: np.ndarray,
    before: np.ndarray,
    positions: np.ndarray,
    velocities: np.ndarray,
    period: float,
) -> np.ndarray:
    """For how long each robot has been kept from moving as desired.

    Args:
        waiting: Waiting times at the last sample, shape (n,) [s].
        before, positions: Positions at the last sample and now, shape (2 n,) [m].
        velocities: Desired, shape (2 n,) [m/s].
        period: Between samples [s].

    Returns:
        Shape (n,) [s]; zero for a robot that makes progress, or has a desired speed of zero.
    """
    longer = np.zeros(len(waiting))
    for i in range(len(waiting)):
        dx, dy = positions[2 * i] - before[2 * i], positions[2 * i + 1] - before[2 * i + 1]
        moved = math.sqrt(dx * dx + dy * dy) / period
        wish = math.sqrt(velocities[2 * i] ** 2 + velocities[2 * i + 1] ** 2)
        if moved < WAITING * wish:
            longer[i] = waiting[i] + period
        elif moved < GOING * wish:
            longer[i] = waiting[i]
    return longer


@compiled
def take_turns(
    turns: np.ndarray,
    waiting: np.ndarray,
    positions: np.ndarray,
    radii: np.ndarray,
    others: np.ndarray,
    period: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Whose turn it is among teammates that hold each other up.

    Args:
        turns: Time left of each robot's turn at the last sample, shape (n,) [s].
        waiting: For how long each has waited, from `still_waiting`, shape (n,) [s].
        positions: Of the team, shape (2 n,) [m].
        radii: Of the team, shape (n,) [m].
        others: Positions of the robots of the other team, shape (2 m,) [m].
        period: Between samples [s].

    Returns:
        The turns now, one in each group of teammates at a time, and the waiting times, zero for
        those whose turn it is; shapes (n,) [s].
    """
    count = len(turns)
    left, waited = np.maximum(turns - period, 0.0), waiting.copy()
    # A remainder of less than half a period is a rounding error.
    left[left < 0.5 * period] = 0.0
    if waited.max() >= PATIENCE:
        group, nearest = _groups(positions, radii), _nearness(positions, others)
        going = left > 0.0
        for i in range(count):
            first = waited[i] >= PATIENCE
            for j in range(count):
                if j != i and group[j] == group[i]:
                    before = waiting[j] > waiting[i] or (
                        waiting[j] == waiting[i]
                        and (nearest[j] < nearest[i] or (nearest[j] == nearest[i] and j < i))
                    )
                    first = first and not going[j] and not before
            if first and not going[i]:
                left[i] = TURN_LENGTH
    waited[left > 0.0] = 0.0
    return left, waited


@compiled
def _groups(positions: np.ndarray, radii: np.ndarray) -> np.ndarray:
    """A label for each robot, equal for robots connected by a chain of small gaps, shape (n,)."""
    count = len(radii)
    group = np.arange(count)
    for i in range(count):
        for j in range(i):
            dx = positions[2 * i] - positions[2 * j]
            dy = positions[2 * i + 1] - positions[2 * j + 1]
            reach = (1.0 + HOLDS_UP) * (radii[i] + radii[j])
            if dx * dx + dy * dy < reach * reach:
                joined, label = group[i], group[j]
                for k in range(count):
                    if group[k] == joined:
                        group[k] = label
    return group


@compiled
def _nearness(positions: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Squared distance of each robot from the nearest of the other team, shape (n,) [m^2]."""
    count = len(positions) // 2
    nearest = np.full(count, np.inf)
    # Without another team, the robot farthest from the middle of its team goes first.
    if len(others) == 0:
        for i in range(count):
            dx = positions[2 * i] - positions[::2].mean()
            dy = positions[2 * i + 1] - positions[1::2].mean()
            nearest[i] = -(dx * dx + dy * dy)
    for i in range(count):
        for j in range(len(others) // 2):
            dx = positions[2 * i] - others[2 * j]
            dy = positions[2 * i + 1] - others[2 * j + 1]
            nearest[i] = min(nearest[i], dx * dx + dy * dy)
    return nearest
