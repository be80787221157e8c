"""Which point of which reference each point of a picture resembles, beyond doubt."""

from dataclasses import dataclass

import numpy as np

from .features import Features
from .references import References

# A match is kept when it is nearer than this share of the distance to the best other subject
# (Lowe 2004), and not farther than this; descriptors have length 1.
RATIO = {"sift": 0.85, "orb": 0.9, "surf": 0.85}
FARTHEST = {"sift": 0.75, "orb": 0.72, "surf": 0.7}


@dataclass(frozen=True, eq=False)
class Matches:
    """Pairs of points.

    Attributes:
        subject: Of each, as the references number them; shape (n,).
        place: On the subject's unit square, shape (n, 2).
        pixel: In the picture, shape (n, 2) [px].
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
    """Match every feature of a picture with the most similar one of all references.

    The ratio test compares subjects, not features: views of one subject at several sizes hold the
    same point many times.
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
    """Of descriptors of length 1, from their product."""
    return np.sqrt(np.maximum(2 - 2 * alike, 0))
