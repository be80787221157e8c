"""Whether robots can have driven to their measured poses, and whether robots may be there.

A robot is taken to be at its last believed pose until a pose comes that it can have driven to from
there. The way that it can have driven grows with time for half a second only: a robot whose pose is
not believed is stopped.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely

from ..checked import Checked, NonNegative, Positive
from ..geometry.world import World
from .supervision import Reason

# How fast a robot may really be, as a multiple of its top speed.
_OVERSHOOT = 1.2
# For how long a robot whose pose is not believed may have driven on [s].
_BRAKED_AFTER = 0.5


@dataclass(frozen=True, kw_only=True)
class PoseLimits(Checked):
    """What a robot can do.

    Attributes:
        top_speed: Of the fastest robot [m/s].
        top_turn_rate: Of the fastest robot [rad/s].
        bounds: Of the world, x_min, y_min, x_max, y_max [m].
        margin: By which a pose may lie beyond them [m].
        jump: Distance beyond what speed allows that counts as a jump [m].
        flip: Turn beyond what the turn rate allows that counts as a flip [rad].

    Raises:
        InvalidInput: A number is out of its range.
    """

    top_speed: Positive
    top_turn_rate: Positive
    bounds: tuple[float, float, float, float]
    margin: NonNegative = 0.3
    jump: Positive = 0.06
    flip: Positive = 0.5


class PoseMemory(NamedTuple):
    """What is known of N robots.

    Attributes:
        poses: Last believed, shape (N, 3) [m], [m], [rad].
        stamps: When those were seen, shape (N,) [s]; minus infinity: any pose is believed next.
        looked: When the last pose was seen, believed or not, shape (N,) [s].
        excess: Way beyond what top speed allows, added up, shape (N,) [m].
        verdicts: Of the last pose, numbers of Reason, shape (N,).
    """

    poses: np.ndarray
    stamps: np.ndarray
    looked: np.ndarray
    excess: np.ndarray
    verdicts: np.ndarray


def no_poses(starts: np.ndarray) -> PoseMemory:
    """Nothing seen yet.

    Args:
        starts: Poses to go on with until then, shape (N, 3) [m], [m], [rad].
    """
    count = len(starts)
    never = np.full(count, -np.inf)
    return PoseMemory(starts.copy(), never, never.copy(), np.zeros(count), np.zeros(count))


def angle_between(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Turn from the second heading to the first, in (-pi, pi].

    Args:
        first, second: Headings, shape (N,) [rad].
    """
    turn = np.remainder(first - second, 2 * np.pi)
    return np.where(turn > np.pi, turn - 2 * np.pi, turn)


def check_poses(
    limits: PoseLimits,
    memory: PoseMemory,
    poses: np.ndarray,
    stamps: np.ndarray,
    valid: np.ndarray,
) -> PoseMemory:
    """Believe what can be believed; a pose that is not new, or not valid, changes nothing.

    Args:
        limits: What a robot can do.
        memory: What was known.
        poses: As measured, shape (N, 3) [m], [m], [rad].
        stamps: When, shape (N,) [s].
        valid: Which of them are valid, shape (N,).
    """
    new = valid & (stamps > memory.looked)
    first = np.isneginf(memory.stamps)
    # A pose may hold any numbers, or NaN; it is not believed then.
    with np.errstate(invalid="ignore", over="ignore"):
        since = np.where(first, 0.0, stamps - memory.stamps)
        driven = np.minimum(since, _BRAKED_AFTER)
        moved = np.hypot(*(poses[:, :2] - memory.poses[:, :2]).T)
        turned = np.abs(angle_between(poses[:, 2], memory.poses[:, 2]))
        possible = _OVERSHOOT * limits.top_speed * driven
        low, high = np.array(limits.bounds[:2]), np.array(limits.bounds[2:])
        inside = (poses[:, :2] >= low - limits.margin) & (poses[:, :2] <= high + limits.margin)
        outside = ~(inside.all(axis=1) & np.isfinite(poses[:, 2]))
        far = ~first & ~(moved <= possible + limits.jump)
        turn = _OVERSHOOT * limits.top_turn_rate * driven + limits.flip
        flipped = ~first & ~(turned <= turn)
        excess = np.maximum(memory.excess + moved - possible, 0.0)
    excess = np.where(first, 0.0, excess)
    verdicts = np.select(
        [outside, far, flipped, excess > limits.jump],
        [Reason.OUTSIDE, Reason.JUMP, Reason.FLIP, Reason.TOO_FAST],
        Reason.NONE,
    )
    good = new & (verdicts == Reason.NONE)
    return PoseMemory(
        poses=np.where(good[:, np.newaxis], poses, memory.poses),
        stamps=np.where(good, stamps, memory.stamps),
        looked=np.where(new, stamps, memory.looked),
        excess=np.where(good, excess, np.where(new, 0.0, memory.excess)),
        verdicts=np.where(new, verdicts, memory.verdicts).astype(float),
    )


class FloorWatch:
    """The floor of a world, for robots with radii.

    Args:
        world: The free region.
        radii: Of the robots, shape (N,) [m].
        slack: By how much a robot may be nearer to a wall, or to another, than its radius [m].
    """

    def __init__(self, world: World, radii: np.ndarray, slack: float) -> None:
        self._radii, self._slack = np.asarray(radii, dtype=float), slack
        self._free = [world.polygon.buffer(slack - radius) for radius in self._radii]
        for each in self._free:
            shapely.prepare(each)

    def breaches(self, places: np.ndarray) -> np.ndarray:
        """FENCE, SPACING or NONE of each robot, as numbers of Reason, shape (N,).

        Args:
            places: Of the centres, shape (N, 2) [m].
        """
        pairs = zip(self._free, places, strict=True)
        out = np.array([not shapely.intersects_xy(free, *place) for free, place in pairs])
        apart = np.hypot(*(places[:, np.newaxis] - places).transpose(2, 0, 1))
        gaps = apart - self._radii[:, np.newaxis] - self._radii
        np.fill_diagonal(gaps, np.inf)
        near = (gaps < -self._slack).any(axis=1)
        faults = np.where(out, Reason.FENCE, np.where(near, Reason.SPACING, Reason.NONE))
        return faults.astype(float)
