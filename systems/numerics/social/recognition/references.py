"""What to look for: the landmarks and the marker, as features of stored pictures."""

from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from ..landmarks.landmark_pictures import landmark_picture, marker_picture
from ..landmarks.maze import Maze
from .features import FeatureFinder

# The number of the evader's marker among landmarks.
MARKER = -1

# References are seen small and from the side too: each is described at these sizes [px] and,
# because walls and cameras stand upright, narrowed to these shares (ASIFT, Morel and Yu 2009).
# Fewer for ORB, whose features are many and which is to be fast.
_SIZES = {"sift": (224, 112, 56), "orb": (160, 96, 56), "surf": (224, 112, 56)}
_NARROWED = {"sift": (1.0, 0.6, 0.38), "orb": (1.0, 0.55), "surf": (1.0, 0.6, 0.38)}
# White around a reference: a wall is never as dark as its frame.
_BORDER = 0.06
_WALL = 170


@dataclass(frozen=True, eq=False)
class References:
    """Features of every subject, in one table.

    Attributes:
        finder: Which found them, and is to be used on pictures.
        subjects: Numbers of the landmarks, and MARKER, in the order of the table.
        starts: Row at which each subject's features start, shape (s,).
        points: Where on the subject's square, from (0, 0), top left, to (1, 1); shape (n, 2).
        descriptors: Shape (n, d).
        pictures: Grey picture of each subject, 0 to 255, shape (height, width), float32.
    """

    finder: FeatureFinder
    subjects: tuple[int, ...]
    starts: np.ndarray
    points: np.ndarray
    descriptors: np.ndarray
    pictures: Mapping[int, np.ndarray]


def maze_references(maze: Maze, method: str = "sift") -> References:
    """Describe the maze's landmarks and its evader's marker.

    Raises:
        InvalidInput: No such method, or not in this build of OpenCV.
    """
    pictures = {each.number: landmark_picture(each.number) for each in maze.landmarks}
    return make_references({**pictures, MARKER: marker_picture()}, method)


def make_references(pictures: Mapping[int, np.ndarray], method: str = "sift") -> References:
    """Describe pictures.

    Args:
        pictures: Square ones by number: red, green, blue, shape (n, n, 3), uint8.
        method: One of METHODS.
    """
    finder = FeatureFinder(method)
    points, descriptors, starts, total = [], [], [], 0
    grey = {
        subject: cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY) for subject, picture in pictures.items()
    }
    for picture in grey.values():
        starts.append(total)
        for size in _SIZES[method]:
            for share in _NARROWED[method]:
                where, what = _describe(finder, picture, size, share)
                points.append(where)
                descriptors.append(what)
                total += len(where)
    return References(
        finder=finder,
        subjects=tuple(grey),
        starts=np.array(starts),
        points=np.vstack(points),
        descriptors=np.vstack(descriptors),
        pictures={subject: picture.astype(np.float32) for subject, picture in grey.items()},
    )


def _describe(
    finder: FeatureFinder, picture: np.ndarray, size: int, share: float
) -> tuple[np.ndarray, np.ndarray]:
    """Points on the unit square, shape (n, 2), and descriptors of one view."""
    shape = np.array([round(size * share), size])
    small = cv2.resize(picture, tuple(shape.tolist()), interpolation=cv2.INTER_AREA)
    border = round(_BORDER * size)
    framed = cv2.copyMakeBorder(
        small, border, border, border, border, cv2.BORDER_CONSTANT, value=_WALL
    )
    found = finder.find(framed)
    # The unit square's edge is the edge of the outermost pixels.
    places = (found.points - border + 0.5) / shape
    inside = np.all((places >= 0) & (places <= 1), axis=1)
    return places[inside], found.descriptors[inside]
