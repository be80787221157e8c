"""Links: how a combine gets from one loop to another without driving over crop."""

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...planning.car_path import CarPath, Words, least_lengths, paths_by_length
from ...planning.dubins import dubins_paths
from ...planning.reeds_shepp import reeds_shepp_words
from .stubble import Stubble
from .track import Track, car_track, forward_track, join_tracks

# Spacing of the points that are checked [m], and number of those looked at first.
CHECK = 0.5
FIRST_LOOK = 12

# What may be touched [m]: lines run along the edges of where they may.
TOUCH = 0.05

# Words with backing up that are tried for each pair of poses, and ends tried for each start.
MOST_WORDS = 10
MOST_ENDS = 200


class Passable:
    """Where a combine may drive on its way to a loop.

    It stays on the ground, keeps out of what is taboo to it, and does not back up over crop.
    Forwards it may enter the edge of the crop that it is about to cut: the header is down.

    Attributes:
        ground: Where its middle has to stay.
        taboo: Where it may not drive.
        stubble: What has been cut.
    """

    def __init__(self, ground: BaseGeometry, taboo: BaseGeometry, stubble: Stubble) -> None:
        self.ground = ground.buffer(TOUCH)
        self.taboo = taboo.buffer(-TOUCH)
        self.stubble = stubble
        shapely.prepare([self.ground, self.taboo])

    def admits(self, path: CarPath) -> bool:
        """Whether a path is clear, checked at points: a few first, which most do not pass."""
        count = max(2, int(np.ceil(path.length / CHECK)) + 1)
        return self._admits(path, min(count, FIRST_LOOK)) and self._admits(path, count)

    def stays_clear(self, points: np.ndarray) -> np.ndarray:
        """Which points are on the ground and not taboo, shape (n, 2 or more) -> (n,)."""
        x, y = points[:, 0], points[:, 1]
        return shapely.contains_xy(self.ground, x, y) & ~shapely.contains_xy(self.taboo, x, y)

    def _admits(self, path: CarPath, count: int) -> bool:
        distances = np.linspace(0.0, path.length, count)
        poses = path.poses(distances)
        if not self.stays_clear(poses).all():
            return False
        ends = np.cumsum(np.abs(path.lengths))
        piece = np.minimum(np.searchsorted(ends, distances), len(ends) - 1)
        back = np.array(path.lengths)[piece] < 0
        return not self.stubble.stands_behind(poses[back]).any()


def shortest_link(
    start: Sequence[float],
    ends: np.ndarray,
    radius: float,
    passable: Passable,
    costs: np.ndarray | None = None,
    most: float = np.inf,
) -> tuple[int, Track] | None:
    """The shortest clear Reeds-Shepp path from a pose to one of several.

    Args:
        start: x, y, theta.
        ends: The same, shape (n, 3).
        radius: Of the arcs [m].
        passable: Where it may run.
        costs: What each end costs beside the way to it, shape (n,) [m]; none: nothing.
        most: What way and end may cost [m].

    Returns:
        Number of the end and the way to it; None if there is none among those tried.
    """
    if not passable.stays_clear(np.array([start], dtype=float)).all():
        return None
    costs = np.zeros(len(ends)) if costs is None else costs
    straight = np.hypot(*(ends[:, :2] - np.array(start[:2])).T)
    some = np.flatnonzero((straight + costs < most) & passable.stays_clear(ends))
    if not len(some):
        return None
    words = reeds_shepp_words(start, ends[some], radius)
    bounds = least_lengths(words, radius) + costs[some]
    least, best = most, None
    for index in np.argsort(bounds)[:MOST_ENDS].tolist():
        if bounds[index] >= least:
            break
        end = some[index]
        for path in _paths(words, start, ends[end], index, radius):
            if path.length + costs[end] >= least:
                break
            if passable.admits(path):
                least, best = path.length + costs[end], (int(end), path)
                break
    if best is None:
        return None
    return best[0], car_track(best[1], radius / 16)


def _paths(
    words: Words, start: Sequence[float], end: np.ndarray, index: int, radius: float
) -> list[CarPath]:
    """Ways to one of the ends, shortest first; those without backing up are all among them."""
    forward = dubins_paths(start, end.tolist(), radius)
    either = paths_by_length(words, start, radius, index)[:MOST_WORDS]
    return sorted(forward + either, key=lambda path: path.length)


def link_along(
    start: Sequence[float],
    ends: np.ndarray,
    lines: Sequence[tuple[np.ndarray, np.ndarray]],
    radius: float,
    passable: Passable,
    costs: np.ndarray | None = None,
) -> tuple[int, Track] | None:
    """A clear way by a line that has been driven before: onto it, along it, and off it.

    Args:
        start: x, y, theta.
        ends: The same, shape (n, 3).
        lines: Closed lines with their headings, shapes (m, 2) and (m,); all are tried.
        radius: Of the arcs [m].
        passable: Where it may run.
        costs: What each end costs beside the way to it, shape (n,) [m]; none: nothing.

    Returns:
        As `shortest_link`.
    """
    costs = np.zeros(len(ends)) if costs is None else costs
    least, best = np.inf, None
    for points, headings in lines:
        step = max(1, len(points) // 48)
        places = np.arange(0, len(points), step)
        poses = np.column_stack([points[places], headings[places]])
        onto = shortest_link(start, poses, radius, passable)
        if onto is None:
            continue
        near = np.linalg.norm(poses[:, None, :2] - ends[None, :, :2], axis=2).min(axis=1)
        for place in np.argsort(near)[:12].tolist():
            off = shortest_link(poses[place].tolist(), ends, radius, passable, costs)
            if off is None:
                continue
            along = _along(points, headings, int(places[onto[0]]), int(places[place]))
            track = join_tracks([onto[1], *along, off[1]])
            if track.length + costs[off[0]] < least:
                least, best = track.length + costs[off[0]], (off[0], track)
            break
    return best


def link_off(
    line: tuple[np.ndarray, np.ndarray],
    first: int,
    leaves: Sequence[int],
    ends: np.ndarray,
    radius: float,
    passable: Passable,
    costs: np.ndarray,
) -> tuple[int, Track] | None:
    """A clear way on along a closed line, and off it at one of some points.

    Args:
        line: Its points and headings, shapes (m, 2) [m] and (m,) [rad].
        first: Number of the point that it begins at.
        leaves: How many points farther on it may leave the line, the likeliest first.
        ends: x, y, theta, shape (n, 3).
        radius: Of the arcs [m].
        passable: Where it may run.
        costs: What each end costs beside the way to it, shape (n,) [m].

    Returns:
        As `shortest_link`.
    """
    points, headings = line
    count = len(points)
    step = float(np.hypot(*(points[1] - points[0])))
    least, best = np.inf, None
    for on in leaves:
        last = (first + on) % count
        if not passable.stays_clear(points[(first + np.arange(on + 1)) % count]).all():
            continue
        pose = [*points[last].tolist(), float(headings[last])]
        off = shortest_link(pose, ends, radius, passable, costs, least - on * step)
        if off is not None:
            track = join_tracks([*_along(points, headings, first, last), off[1]])
            least, best = on * step + off[1].length + costs[off[0]], (off[0], track)
    return best


def _along(points: np.ndarray, headings: np.ndarray, first: int, last: int) -> list[Track]:
    """A closed line from one of its points on to another."""
    if first == last:
        return []
    count = len(points)
    order = (first + np.arange((last - first) % count + 1)) % count
    return [forward_track(points[order], headings[order])]
