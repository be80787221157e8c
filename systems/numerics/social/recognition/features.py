"""Points of a picture that can be found again, each with a description to know it by."""

import math
from dataclasses import dataclass

import cv2
import numpy as np

from ...errors import InvalidInput, require_one_of

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
    al. (2011), twice as fast and blinder. surf: Bay et al. (2008), which the thesis uses
    and whose patented code most builds of OpenCV leave out.

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
