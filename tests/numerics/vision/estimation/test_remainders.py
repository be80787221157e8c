"""What is left over after a fit tells how far errors have moved what was fitted."""

from functools import partial

import cv2
import numpy as np
import pytest

from sightfield.systems.numerics.vision.estimation.edge_errors import remainder_covariance

SHAPE = 28, 44


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


def drawn_in_blocks(generator):
    """Errors of a compressed picture: in each block of 8 pixels waves that are rounded off."""
    rows, columns = (8 * (size // 8 + 2) for size in SHAPE)
    errors = np.zeros((rows, columns), np.float32)
    for row in range(0, rows, 8):
        for column in range(0, columns, 8):
            waves = np.zeros((8, 8), np.float32)
            waves[:3, :3] = generator.standard_normal((3, 3))
            waves[0, 0] = 0.0
            errors[row : row + 8, column : column + 8] = cv2.idct(waves)
    row, column = generator.integers(0, 8, 2)
    return errors[row : row + SHAPE[0], column : column + SHAPE[1]].ravel()


@pytest.mark.parametrize(
    "draw",
    [partial(drawn, reach=1), partial(drawn, reach=4), drawn_in_blocks],
    ids=["pixels", "neighbours", "blocks"],
)
def test_errors_are_told_by_remainders_whatever_is_alike_in_them(scene, fit, draw):
    slopes, gains = fit
    generator, moved, told = np.random.default_rng(3), [], []
    for _ in range(200):
        errors = 0.03 * draw(generator)
        step = errors @ gains
        moved.append(step[:2])
        told.append(
            remainder_covariance(
                scene,
                errors - slopes @ step,
                slopes,
                gains,
                np.zeros(len(slopes)),
                np.array([0.5, 0.0, 0.5]),
            )
        )
    shares = np.diag(np.mean(told, axis=0)) / np.mean(np.square(moved), axis=0)
    assert np.all((shares > 0.8) & (shares < 1.3))


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
        covariance = remainder_covariance(scene, left, slopes, gains, share * raster, spread)
        told.append(covariance[0, 0])
    alone = 0.02**2 * (gains[:, 0] @ gains[:, 0])
    assert told[0] > 1.5 * told[1]
    assert told[1] < 3 * alone


def test_what_few_remainders_tell_is_doubted_as_much_as_it_errs(scene, fit):
    """Squares over variances are 1 on average; variances that vary by themselves make them more."""
    slopes, gains = fit
    nothing, spread = np.zeros(len(slopes)), np.array([0.5, 0.0, 0.5])
    generator, squares = np.random.default_rng(7), []
    for reach in (4, 8):
        for _ in range(600):
            errors = 0.03 * drawn(generator, reach)
            step = errors @ gains
            left = errors - slopes @ step
            told = np.diag(remainder_covariance(scene, left, slopes, gains, nothing, spread))
            squares.append(step[:2] ** 2 / told)
    assert np.mean(squares) == pytest.approx(1.0, abs=0.06)
