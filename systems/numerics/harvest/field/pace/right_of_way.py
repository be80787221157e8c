"""Who has the right of way where combines meet: between loops, and at corners."""

from collections.abc import Sequence

import numpy as np

from ....compiled import compiled
from ..combine_path import CombinePath
from .holds import Holds
from .timeline import Timeline

# Spacing of the places looked at, and what is to be between two combines' headers, as lines [m].
STEP, CLEAR = 2.0, 6.0
# Combines that are at two places within so much of the clock may meet there [m].
SOON = 60.0


def find_crossings(
    paths: Sequence[CombinePath], timeline: Timeline, header: float, length: float
) -> tuple[Holds, ...]:
    """What each combine waits for so that nobody runs into another.

    Where two would meet, the one whose loop is begun first has the right of way, and of two on
    their way to park the one with the lower number. The other waits until it is past, or done with
    its loop; so there is always one that can go on.

    Args:
        paths: Of the combines.
        timeline: When they are where; places at which they are at very different times count not.
        header: Width of the header [m].
        length: Of a combine behind its header [m].
    """
    places = [np.arange(0.0, path.length + STEP, STEP).clip(max=path.length) for path in paths]
    poses = [path.pose_at(at) for path, at in zip(paths, places, strict=True)]
    turns = [path.turn_at(at) for path, at in zip(paths, places, strict=True)]
    # When they come to and leave the way between the places beside.
    clocks = [
        np.stack([timeline.clock_at(n, at - STEP), timeline.clock_at(n, at + STEP)], axis=1)
        for n, at in enumerate(places)
    ]
    found = []
    for n, at in enumerate(places):
        for m, path in enumerate(paths):
            if m == n:
                continue
            last = _last_meeting(
                (poses[n], turns[n], clocks[n]),
                (poses[m], turns[m], clocks[m]),
                m < n,
                header / 2,
                length,
            )
            met = last >= 0
            if met.any():
                passed = places[m][last[met]]
                needs = np.minimum(passed + STEP, path.end_of_turn(passed))
                # Not before the end of its last loop, for which others may wait.
                begins = at[np.searchsorted(turns[n], turns[n][met])]
                stations = np.maximum(at[met] - STEP, begins)
                found.append(Holds(n, m, False, stations, passed, np.maximum.accumulate(needs)))
    return tuple(found)


@compiled
def _last_meeting(one, other, tie, half, length):
    """Of each place of a combine the last one of another, with the right of way, that it meets."""
    poses, turns, clocks = one
    others, their_turns, their_clocks = other
    last = np.full(len(poses), -1)
    reach = 2.0 * (half + length) + CLEAR
    for k in range(len(poses)):
        from_here = np.searchsorted(their_clocks[:, 1], clocks[k, 0] - SOON)
        to_here = np.searchsorted(their_clocks[:, 0], clocks[k, 1] + SOON, side="right")
        for j in range(to_here - 1, from_here - 1, -1):
            first = their_turns[j] < turns[k] or (tie and their_turns[j] == turns[k])
            if not first:
                continue
            dx, dy = others[j, 0] - poses[k, 0], others[j, 1] - poses[k, 1]
            if dx * dx + dy * dy > reach * reach:
                continue
            if _near(poses[k], others[j], half, length) or _near(others[j], poses[k], half, length):
                last[k] = j
                break
    return last


@compiled
def _near(a, b, half, length):
    """Whether a point on the header of a, or on its axis, is near to the header or axis of b."""
    c, s = np.cos(a[2]), np.sin(a[2])
    u, v = np.cos(b[2]), np.sin(b[2])
    count = int(np.ceil(2.0 * half / STEP))
    behind = int(np.ceil(length / STEP))
    for k in range(count + behind + 1):
        side = half * (2.0 * k / count - 1.0) if k <= count else 0.0
        back = 0.0 if k <= count else length * (k - count) / behind
        dx = a[0] - c * back - s * side - b[0]
        dy = a[1] - s * back + c * side - b[1]
        ahead, left = u * dx + v * dy, abs(u * dy - v * dx)
        to_header = np.hypot(max(left - half, 0.0), ahead)
        to_axis = np.hypot(left, max(max(ahead, -length - ahead), 0.0))
        if min(to_header, to_axis) < CLEAR:
            return True
    return False
