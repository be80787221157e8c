"""Matching of a picture's features with those of the references, and squares fitted to matches.

A subject is accepted if its matches lie as on a flat square seen from its front.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from .references import Features, References

# A match is kept if its distance is below this share of that to the best other subject (Lowe 2004),
# and below this limit; descriptors have length 1.
RATIO = {"sift": 0.85, "orb": 0.9, "surf": 0.85}
FARTHEST = {"sift": 0.75, "orb": 0.72, "surf": 0.7}


@dataclass(frozen=True, eq=False)
class Matches:
    """Pairs of points.

    Attributes:
        subject: Number of each point's subject, as in the references; shape (n,).
        place: Place on the subject's unit square, shape (n, 2).
        pixel: Place in the picture, shape (n, 2) [px].
    """

    subject: np.ndarray
    place: np.ndarray
    pixel: np.ndarray

    def __len__(self) -> int:
        return len(self.subject)

    def where(self, mask: np.ndarray) -> "Matches":
        """Those of a mask, shape (n,)."""
        return Matches(self.subject[mask], self.place[mask], self.pixel[mask])


def match(features: Features, references: References) -> Matches:
    """Match each feature of a picture with the most similar reference feature, if that is clear.

    The ratio test compares subjects, not features, because a subject's views at several sizes
    contain the same point many times.
    """
    if len(features) == 0:
        return Matches(np.zeros(0, int), np.zeros((0, 2)), np.zeros((0, 2)))
    alike = features.descriptors @ references.descriptors.T
    # Best of each subject, then the two best subjects.
    per_subject = np.maximum.reduceat(alike, references.starts, axis=1)
    order = np.argsort(per_subject, axis=1)
    rows = np.arange(len(features))
    best = order[:, -1]
    nearest = _distance(per_subject[rows, best])
    rival = _distance(per_subject[rows, order[:, -2]]) if per_subject.shape[1] > 1 else 2.0
    method = references.finder.method
    keep = (nearest < RATIO[method] * rival) & (nearest < FARTHEST[method])
    # The most similar of all features is the best subject's best.
    feature = np.argmax(alike[keep], axis=1)
    return Matches(
        np.array(references.subjects)[best[keep]],
        references.points[feature],
        features.points[keep],
    )


def _distance(alike: np.ndarray) -> np.ndarray:
    """Distance of descriptors of length 1, from their product."""
    return np.sqrt(np.maximum(2 - 2 * alike, 0))


# Least number of matches for a square.
FEWEST = 5
# Largest distance between a match and its place on the fitted square [px].
_INLIER = 3.0
_TRIALS, _CONFIDENCE = 2000, 0.999
# Implausible squares: with vertical edges shorter than this [px], or opposite edges whose ratio is
# above this.
_SMALLEST, _UNEVEN = 9.0, 4.0

UNIT_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


def find_square(matches: Matches) -> tuple[np.ndarray, np.ndarray] | None:
    """The square on which most of one subject's matches lie.

    Returns:
        Its corners, shape (4, 2) [px], and which matches lie on it, shape (n,); None if no
        plausible square has at least `FEWEST` of them.
    """
    if len(matches) < FEWEST:
        return None
    # One feature of the subject, described in several views, counts once.
    cells = np.column_stack([np.rint(20 * matches.place), np.rint(matches.pixel)])
    _, once = np.unique(cells, axis=0, return_index=True)
    if len(once) < FEWEST:
        return None
    try:
        found, _ = cv2.findHomography(
            100 * matches.place[once],
            matches.pixel[once],
            cv2.USAC_MAGSAC,
            _INLIER,
            maxIters=_TRIALS,
            confidence=_CONFIDENCE,
        )
    except cv2.error:
        return None
    if found is None or not np.isfinite(found).all():
        return None
    homography = found @ np.diag([100.0, 100.0, 1.0])
    corners = map_square(homography, UNIT_SQUARE)
    if not is_sane(homography, corners):
        return None
    miss = np.hypot(*(map_square(homography, matches.place) - matches.pixel).T)
    on = miss < _INLIER
    if np.count_nonzero(on[once]) < FEWEST:
        return None
    return corners, on


def homography_of(corners: np.ndarray) -> np.ndarray:
    """The map of the unit square onto corners, shape (3, 3); infinite if there is none."""
    u, v = UNIT_SQUARE.T
    x, y = corners.T
    zero, one = np.zeros(4), np.ones(4)
    rows = np.vstack(
        [
            np.column_stack([u, v, one, zero, zero, zero, -u * x, -v * x]),
            np.column_stack([zero, zero, zero, u, v, one, -u * y, -v * y]),
        ]
    )
    try:
        entries = np.linalg.solve(rows, np.concatenate([x, y]))
    except np.linalg.LinAlgError:
        return np.full((3, 3), np.inf)
    return np.append(entries, 1.0).reshape(3, 3)


def map_square(homography: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Where places of the unit square appear, shape (n, 2) [px].

    Args:
        homography: From the unit square to pixels, shape (3, 3).
        places: Shape (n, 2).
    """
    lifted = np.column_stack([places, np.ones(len(places))]) @ homography.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return lifted[:, :2] / lifted[:, 2:]


def is_sane(homography: np.ndarray, corners: np.ndarray) -> bool:
    """Whether corners are plausible for a square seen from its front, wholly before the camera.

    Args:
        homography: From the unit square to pixels, shape (3, 3).
        corners: Where it takes the square's corners, shape (4, 2) [px].
    """
    depth = UNIT_SQUARE @ homography[2, :2] + homography[2, 2]
    if not np.isfinite(corners).all() or not ((depth > 0).all() or (depth < 0).all()):
        return False
    after = np.roll(corners, -1, axis=0) - corners
    turn = after[:, 0] * np.roll(after, -1, axis=0)[:, 1]
    turn -= after[:, 1] * np.roll(after, -1, axis=0)[:, 0]
    lengths = np.hypot(after[:, 0], after[:, 1])
    # Clockwise in the picture, whose rows count downwards; a mirror would turn it round.
    convex = bool((turn > 0).all())
    opposite = lengths[[0, 1]] / np.maximum(lengths[[2, 3]], 1e-9)
    even = bool(((opposite < _UNEVEN) & (opposite > 1 / _UNEVEN)).all())
    return convex and even and bool(lengths[[1, 3]].min() > _SMALLEST)
