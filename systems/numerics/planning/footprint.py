"""What a tractor and a trailer cover: discs that move with them, and keep off walls or do not."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..errors import InvalidInput, require, require_finite, require_positive
from ..geometry.world import World
from .goal import Goal
from .plan import TrailerPath, refined_path
from .trailer import Trailer

TRACTOR = 0
TRAILER = 1
# What its two bodies are called, where discs are written out.
BODIES = ("tractor", "trailer")
# More discs than a cart needs, each of which is followed along every way.
MOST_DISCS = 64
# A disc is not farther from the axle of its body, nor larger, than so many times the cart.
LARGEST = 100.0


@dataclass(frozen=True)
class Discs:
    """Discs on the centre lines of tractor and trailer.

    Attributes:
        bodies: TRACTOR or TRAILER, for each disc.
        offsets: Of its centre ahead of the tractor's rear axle, or of the trailer's axle [m].
        radii: Of each [m].
        length: From the hitch to the trailer's axle [m].
        hitch_offset: From the tractor's rear axle back to the hitch [m].
    """

    bodies: tuple[int, ...]
    offsets: tuple[float, ...]
    radii: tuple[float, ...]
    length: float
    hitch_offset: float

    def __len__(self) -> int:
        return len(self.bodies)

    def centre(self, k: int, state, cos=np.cos, sin=np.sin):
        """(x, y) of the centre of disc k [m]; `state` has its entries along the first axis.

        Args:
            k: Number of the disc.
            state: x, y, theta, beta [m], [m], [rad], [rad].
            cos, sin: Of the kind of numbers that the state has.
        """
        x, y, theta, beta = state[0], state[1], state[2], state[3]
        if self.bodies[k] == TRACTOR:
            return x + self.offsets[k] * cos(theta), y + self.offsets[k] * sin(theta)
        behind = self.offsets[k] - self.length
        heading = theta - beta
        return (
            x - self.hitch_offset * cos(theta) + behind * cos(heading),
            y - self.hitch_offset * sin(theta) + behind * sin(heading),
        )


def covering_discs(trailer: Trailer, width: float | None = None) -> Discs:
    """Discs of one width, in a row from the front of the tractor to the axle of the trailer.

    The tractor reaches from the hitch to half a trailer's length ahead of its rear axle. Centres
    are at most half a width apart, so that the discs cover 0.86 of the width everywhere.

    Args:
        trailer: For its length and hitch.
        width: Of the vehicle [m]; by default half of the trailer's length.

    Raises:
        InvalidInput: The width is not positive.
    """
    width = trailer.length / 2 if width is None else width
    require_positive("width", width)
    tractor = _row(min(-trailer.hitch_offset, 0.0), trailer.length / 2, width / 2)
    towed = _row(0.0, trailer.length, width / 2)[:-1]
    return Discs(
        bodies=(TRACTOR,) * len(tractor) + (TRAILER,) * len(towed),
        offsets=(*tractor, *towed),
        radii=(width / 2,) * (len(tractor) + len(towed)),
        length=trailer.length,
        hitch_offset=trailer.hitch_offset,
    )


def discs_from_text(trailer: Trailer, text: str) -> Discs:
    """Discs as they are written out: "tractor 0 0.4, tractor 0.5 0.4, trailer 0.3 0.5".

    Each has its body, how far its centre is ahead of the axle of that body, and its radius [m].

    Args:
        trailer: For its length and hitch.
        text: At least one disc, with commas between them.

    Raises:
        InvalidInput: It is not written so, or a number is out of its range.
    """
    bodies, offsets, radii = [], [], []
    most = LARGEST * (trailer.length + abs(trailer.hitch_offset))
    for part in text.split(","):
        words = part.split()
        try:
            name, offset, radius = words[0].lower(), *map(float, words[1:])
            bodies.append(BODIES.index(name))
        except (ValueError, IndexError):
            what = "be discs such as tractor 0.5 0.4, trailer 0 0.4"
            raise InvalidInput(f"`discs` must {what}; got {part.strip() or 'nothing'}") from None
        require_finite("discs", offset)
        require_positive("discs", radius)
        largest = max(abs(offset), radius)
        require(largest <= most, "discs", f"be within {most:g} m of their axles", largest)
        offsets.append(offset)
        radii.append(radius)
    require(len(radii) <= MOST_DISCS, "discs", f"be at most {MOST_DISCS}", len(radii))
    return Discs(
        bodies=tuple(bodies),
        offsets=tuple(offsets),
        radii=tuple(radii),
        length=trailer.length,
        hitch_offset=trailer.hitch_offset,
    )


def _row(start: float, end: float, spacing: float) -> list[float]:
    """Evenly from start to end, both included, at most `spacing` apart."""
    return np.linspace(start, end, 1 + math.ceil((end - start) / spacing)).tolist()


def signed_distance(world: World, points: np.ndarray) -> np.ndarray:
    """From points, shape (n, 2), to the nearest wall, shape (n,); positive in free space [m]."""
    shapely.prepare(world.polygon)
    inside = shapely.covers(world.polygon, shapely.points(points))
    distance = shapely.distance(world.polygon.boundary, shapely.points(points))
    return np.where(inside, 1.0, -1.0) * distance


def deepest_overlap(world: World, discs: Discs, states: np.ndarray) -> float:
    """Largest depth of a disc in a wall at some poses; negative: the least free distance [m].

    Args:
        world: The walls.
        discs: What the vehicle covers.
        states: x, y, theta, beta, shape (n, 4) [m], [m], [rad], [rad].
    """
    return float(_depths(world, discs, states).max())


def _depths(world: World, discs: Discs, states: np.ndarray) -> np.ndarray:
    """Depth of the deepest disc in a wall at each pose, shape (n,) [m]."""
    poses = np.asarray(states, dtype=float).T
    depths = [
        discs.radii[k] - signed_distance(world, np.stack(discs.centre(k, poses), axis=1))
        for k in range(len(discs))
    ]
    return np.max(depths, axis=0)


# Longest way from one look at a path to the next, in turning radii and in radii of the smallest
# disc. Past a corner the least distance lies between two looks; it is less than both by an eighth
# of the way's square, over the disc's radius.
_LOOK_OF_TURN, _LOOK_OF_DISC = 0.01, 0.05


def overlaps_along(
    world: World, discs: Discs, path: TrailerPath, trailer: Trailer
) -> tuple[np.ndarray, np.ndarray]:
    """Depths of the deepest disc in a wall along a path; negative: the least free distance.

    It is looked at along the arcs that are driven: a chord of a turn leaves out what the turn
    sweeps on its outer side.

    Args:
        world: The walls.
        discs: What the vehicle covers.
        path: Its samples may be far apart.
        trailer: That drives it.

    Returns:
        Times, among them those of the path, and depths, shape (m,) [s], [m].
    """
    turning = _LOOK_OF_TURN / trailer.turn_rate
    passing = _LOOK_OF_DISC * min(discs.radii) / trailer.speed
    fine = refined_path(path, trailer, min(turning, passing))
    return fine.times, _depths(world, discs, fine.states)


def path_overlap(world: World, discs: Discs, path: TrailerPath, trailer: Trailer) -> float:
    """Largest depth of a disc in a wall along a path; negative: the least free distance [m].

    Args:
        world, discs, path, trailer: As for `overlaps_along`.
    """
    return float(overlaps_along(world, discs, path, trailer)[1].max())


def require_clear_ends(world: World, discs: Discs, start: Sequence[float], goal: Goal) -> None:
    """Refuse ends that overlap a wall; a goal box may reach into one, if its middle does not.

    Raises:
        InvalidInput: The cart overlaps a wall at the start, or in the middle of the goal.
    """
    for name, state in (("start", start), ("goal", goal.state)):
        overlap = deepest_overlap(world, discs, np.array([state], dtype=float))
        require(overlap <= 0, name, "keep the vehicle clear of walls", list(map(float, state)))


def walls_part(world: World, discs: Discs, start: Sequence[float], goal: Goal) -> bool:
    """Whether not even the disc around the tractor's axle can get from a start to a goal.

    Then there is no path at all. That it can get there promises nothing: the cart is longer than
    that disc, and cannot turn on the spot.
    """
    radii = [
        radius
        for body, offset, radius in zip(discs.bodies, discs.offsets, discs.radii, strict=True)
        if body == TRACTOR and offset == 0.0
    ]
    free = world.polygon.buffer(-max(radii, default=0.0))
    # A buffer is a polygon with many corners: they must not leave an end outside.
    near = 1e-3 * max(radii, default=0.0) + world.tolerance
    x, y = float(start[0]), float(start[1])
    wide, high = (min(width, 2 * world.size) + near for width in goal.tolerance[:2])
    box = shapely.Polygon(replace(goal, tolerance=(wide, high, 0.0, 0.0)).corners())
    place = shapely.Point(x, y).buffer(near)
    return not any(
        part.intersects(place) and part.intersects(box) for part in shapely.get_parts(free)
    )
