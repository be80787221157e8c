"""References for recognition: the landmarks and the marker, as features of stored pictures.

Features are points of a picture that can be found again in another, each with a descriptor.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from ...errors import InvalidInput, require_one_of
from ..landmarks.landmark_pictures import landmark_picture, marker_picture
from ..landmarks.maze import Maze

METHODS = ("sift", "orb", "surf")

# Faint corners count too: walls in shadow are dark.
_SIFT_CONTRAST = 0.02
_ORB_POINTS, _ORB_LEVELS, _ORB_FAST = 1500, 8, 10
_SURF_HESSIAN = 100.0


@dataclass(frozen=True, eq=False)
class Features:
    """Points and what they look like.

    Attributes:
        points: Column and row, shape (n, 2) [px].
        descriptors: Of length 1, so that alike means a large product; shape (n, d), float32.
    """

    points: np.ndarray
    descriptors: np.ndarray

    def __len__(self) -> int:
        return len(self.points)


class FeatureFinder:
    """Finds and describes points.

    sift: Lowe (2004), described by square roots (Arandjelovic and Zisserman 2012). orb: Rublee et
    al. (2011), twice as fast, but it recognises less. surf: Bay et al. (2008), used in the thesis,
    but left out of most builds of OpenCV because it was patented.

    Args:
        method: One of METHODS.

    Raises:
        InvalidInput: No such method, or SURF where OpenCV is built without it.
    """

    def __init__(self, method: str = "sift") -> None:
        require_one_of("method", method, METHODS)
        self.method = method
        if method == "sift":
            self._finder = cv2.SIFT.create(contrastThreshold=_SIFT_CONTRAST)
        elif method == "orb":
            self._finder = cv2.ORB.create(
                nfeatures=_ORB_POINTS, nlevels=_ORB_LEVELS, fastThreshold=_ORB_FAST
            )
        else:
            self._finder = _make_surf()

    def find(self, grey: np.ndarray) -> Features:
        """Features of a picture.

        Args:
            grey: Shape (height, width), uint8.
        """
        keypoints, raw = self._finder.detectAndCompute(grey, None)
        if raw is None or len(keypoints) == 0:
            width = {"sift": 128, "orb": 256, "surf": 64}[self.method]
            return Features(np.zeros((0, 2)), np.zeros((0, width), np.float32))
        points = np.array(cv2.KeyPoint.convert(keypoints), dtype=float)
        return Features(points, self._normalised(raw))

    def _normalised(self, raw: np.ndarray) -> np.ndarray:
        if self.method == "orb":
            signs = 2.0 * np.unpackbits(raw, axis=1).astype(np.float32) - 1
            return signs / np.float32(math.sqrt(signs.shape[1]))
        if self.method == "sift":
            total = np.maximum(raw.sum(axis=1, keepdims=True), 1e-6)
            return np.sqrt(raw / total).astype(np.float32)
        length = np.maximum(np.linalg.norm(raw, axis=1, keepdims=True), 1e-6)
        return (raw / length).astype(np.float32)


def _make_surf():
    """OpenCV's SURF, or an error that says why there is none."""
    extra = getattr(cv2, "xfeatures2d", None)
    refusal = InvalidInput(
        f"`method` must be one that this OpenCV has, sift or orb; got surf, and OpenCV "
        f"{cv2.__version__} is built without its non-free modules"
    )
    if extra is None or not hasattr(extra, "SURF_create"):
        raise refusal
    try:
        return extra.SURF_create(_SURF_HESSIAN)
    except cv2.error:
        raise refusal from None


# The number of the evader's marker among landmarks.
MARKER = -1

# References must be recognised from far and from the side, too: each is described at these sizes
# [px] and, because walls and cameras are upright, narrowed to these shares (ASIFT, Morel and Yu
# 2009). ORB has fewer views, since it finds many features and should be fast.
_SIZES = {"sift": (224, 112, 56), "orb": (160, 96, 56), "surf": (224, 112, 56)}
_NARROWED = {"sift": (1.0, 0.6, 0.38), "orb": (1.0, 0.55), "surf": (1.0, 0.6, 0.38)}
# White around a reference: a wall is never as dark as its frame.
_BORDER = 0.06
_WALL = 170


@dataclass(frozen=True, eq=False)
class References:
    """Features of every subject, in one table.

    Attributes:
        finder: Finder that made them, which must also be used on pictures.
        subjects: Numbers of the landmarks, and MARKER, in the order of the table.
        starts: Row at which each subject's features start, shape (s,).
        points: Places on the subject's unit square, (0, 0) at the top left; shape (n, 2).
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
