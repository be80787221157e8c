"""What is left over after a fit tells how far errors have moved what was fitted."""

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.vision.estimation.edge_errors import remainder_covariance
from sightfield.systems.numerics.vision.estimation.expected_picture import Scene
from sightfield.systems.numerics.vision.estimation.range_models import make_outline

SHAPE = 28, 44


@pytest.fixture(scope="module")
def scene(camera):
    """A window all of whose pixels are fitted."""
    count = SHAPE[0] * SHAPE[1]
    return Scene(
        outline=make_outline(camera, radius=0.1, base=0.04, top=0.2),
        shape=SHAPE,
        axis=np.zeros(2),
        bearings=np.zeros(count),
        radii=np.ones(count),
        strength=np.zeros(count),
        inside=np.arange(count),
        ring=np.zeros(count, bool),
        points=np.ones((count, 1)),
        noise=0.02,
        saturated=False,
    )


@pytest.fixture(scope="module")
def fit():
    """Slopes of two places and of what else a fit follows, and what pixels do to these."""
    rows, columns = np.divmod(np.arange(SHAPE[0] * SHAPE[1]), SHAPE[1])
    edge = [np.exp(-0.5 * ((rows - 12) / 1.2) ** 2), np.exp(-0.5 * ((columns - 20) / 1.2) ** 2)]
    slopes = np.column_stack([*edge, np.ones(len(rows)), rows - 14, columns - 22])
    return slopes, slopes @ np.linalg.inv(slopes.T @ slopes)


def drawn(generator, reach):
    """Errors of deviation 1, of pixels that err alike within so many."""
    fine = generator.standard_normal((SHAPE[0] + 2 * reach, SHAPE[1] + 2 * reach))
    summed = cv2.blur(fine, (reach, reach))[reach:-reach, reach:-reach]
    return reach * summed.ravel()


@pytest.mark.parametrize("reach", [1, 4])
def test_errors_are_told_by_remainders_whether_they_are_alike_or_not(scene, fit, reach):
    slopes, gains = fit
    generator, moved, told = np.random.default_rng(reach), [], []
    for _ in range(120):
        errors = 0.03 * drawn(generator, reach)
        step = errors @ gains
        moved.append(step[:2])
        told.append(
            remainder_covariance(
                scene,
                errors - slopes @ step,
                slopes,
                gains,
                gains[:, :2],
                np.zeros(len(slopes)),
                np.array([0.5, 0.0, 0.5]),
            )
        )
    shares = np.diag(np.mean(told, axis=0)) / np.mean(np.square(moved), axis=0)
    # As there is never less than nothing of a kind, there seems to be a little of all.
    assert np.all((shares > 0.75) & (shares < 1.6))


def test_what_the_raster_explains_is_not_counted_again(scene, fit):
    slopes, gains = fit
    generator = np.random.default_rng(5)
    raster = 0.04 * slopes[:, 0]
    spread = np.array([1.0, 0.0, 1.0])
    told = []
    for share in (0.0, 1.0):
        # Neighbours err alike as the smoothing makes them.
        smooth = cv2.GaussianBlur(generator.standard_normal(SHAPE), (0, 0), 1.0).ravel()
        errors = 0.02 * generator.standard_normal(len(slopes)) + raster * smooth / smooth.std()
        left = errors - slopes @ (errors @ gains)
        covariance = remainder_covariance(
            scene, left, slopes, gains, gains[:, :2], share * raster, spread
        )
        told.append(covariance[0, 0])
    alone = 0.02**2 * (gains[:, 0] @ gains[:, 0])
    assert told[0] > 1.5 * told[1]
    assert told[1] < 3 * alone
