"""What a fit may look like to be a shell, and what a blob may, ends where it is said to end."""

from dataclasses import replace

import numpy as np
import pytest

from sightfield.systems.numerics.vision.estimation import shell_estimate
from sightfield.systems.numerics.vision.estimation.calibration import calibrate
from sightfield.systems.numerics.vision.estimation.outline_fit import OutlineFit
from sightfield.systems.numerics.vision.estimation.shell_detection import (
    COLOURS,
    Outcome,
    detect_shells,
)
from sightfield.systems.numerics.vision.estimation.shell_estimate import estimate_shell
from sightfield.systems.numerics.vision.surroundings import Shell

DISTANCE = 0.8
GOOD = OutlineFit(
    range=DISTANCE,
    bearing=0.3,
    covariance=np.array([[4e-6, 1e-6], [1e-6, 9e-6]]),
    shift=0.3,
    lopsided=0.2,
    sharpness=0.7,
    saturated=False,
    misfit=0.3,
    dent=0.05,
    roughness=0.02,
    strange=1.3,
    around=0.1,
)


@pytest.fixture(scope="module")
def known(camera, ideal_readings, shell_sizes):
    """A calibration by readings that err a little."""
    ideal = ideal_readings(directions=5)
    errors = np.random.default_rng(1).normal(0.0, 0.1, ideal.pixels.shape)
    return calibrate(replace(ideal, pixels=ideal.pixels + errors), camera=camera, **shell_sizes)


@pytest.fixture
def judged(photograph, known, monkeypatch):
    """A function of a fit's and a detection's changes: what is said, and how fits were asked for.

    The blob is that of a whole shell; whatever is fitted to it gives that fit.
    """
    picture = photograph([(Shell(), DISTANCE, 0.3)], noise=0.0)
    (seen,) = detect_shells(picture, [COLOURS["red"]], known.camera.axis_pixel)

    def judge(share=1.0, model="exact", only_whole=None, **changes):
        asked = []

        def fit(window, outline, start, hidden=(0, 0)):
            asked.append((*start, *hidden))
            fitted = replace(GOOD, **changes)
            whole = not any(hidden)
            return only_whole if whole and only_whole is not None else fitted

        monkeypatch.setattr(shell_estimate, "fit_outline", fit)
        expected = 2 * np.arcsin(0.1 / (DISTANCE + 0.1))
        detection = replace(seen, width=share * expected)
        return estimate_shell(detection, known, model), asked

    return judge


@pytest.mark.parametrize(
    ("changes", "most"),
    [
        ({"misfit": 1.0}, 1.0),
        ({"dent": 0.24}, 0.24),
        ({"roughness": 0.07}, 0.07),
        ({"strange": 2.8}, 2.8),
        ({"around": 0.25}, 0.25),
        ({"shift": 0.8, "sharpness": 1.0}, 0.8),
        ({"shift": 2.5, "sharpness": 1.0, "saturated": True}, 2.5),
    ],
)
def test_a_fit_is_a_shell_s_up_to_each_limit_and_no_further(judged, changes, most):
    name = next(iter(changes))
    assert changes[name] == most
    assert judged(**changes)[0].outcome == Outcome.SEEN
    beyond = judged(**{**changes, name: 1.001 * most})[0]
    assert beyond.outcome == Outcome.NO_SHELL_SHAPE
    assert np.isnan(beyond.range)


def test_a_blur_is_told_from_another_shape(judged):
    assert judged(sharpness=4.0)[0].outcome == Outcome.SEEN
    assert judged(sharpness=4.001)[0].outcome == Outcome.BLURRED


def test_what_has_a_side_hidden_may_be_less_strange_than_a_whole_shell(judged, known):
    bad = replace(GOOD, misfit=2.0)
    for strange, outcome in ((2.0, Outcome.PARTLY_HIDDEN), (2.001, Outcome.NO_SHELL_SHAPE)):
        found, asked = judged(share=0.8, strange=strange, only_whole=bad)
        assert found.outcome == outcome
        assert len(asked) == 3
    # A side's width is added to the one that is missing.
    whole, left, right = asked
    expected = 2 * np.arcsin(0.1 / (whole[0] + 0.1))
    missing = expected - 0.8 * 2 * np.arcsin(0.1 / 0.9)
    assert left[1] - whole[1] == pytest.approx(-0.5 * missing)
    assert right[1] - whole[1] == pytest.approx(0.5 * missing)
    assert left[2] == right[3] > 0 == left[3] == right[2]


@pytest.mark.parametrize(
    ("share", "outcome"),
    [
        (0.345, Outcome.MOSTLY_HIDDEN),
        (0.36, Outcome.PARTLY_HIDDEN),
        (0.95, Outcome.PARTLY_HIDDEN),
        (0.985, Outcome.NO_SHELL_SHAPE),
        (1.50, Outcome.NO_SHELL_SHAPE),
        (1.54, Outcome.TOO_WIDE),
    ],
)
def test_a_blob_is_as_wide_as_a_shell_may_look(judged, share, outcome):
    assert judged(share=share, only_whole=replace(GOOD, dent=0.5))[0].outcome == outcome


def test_a_blob_is_narrower_than_its_fit_by_a_share_and_by_pixels(judged, known):
    radius = known.outline.middles[np.argmin(np.abs(known.outline.ranges - DISTANCE))]
    assert radius > 100
    # An eighth of 28 pixels is more than three of them.
    assert judged(share=0.89)[0].outcome == Outcome.SEEN
    assert judged(share=0.87)[0].outcome == Outcome.PARTLY_HIDDEN
    # Of a farther shell, which looks smaller, it is not.
    assert judged(share=0.7, range=1.15)[0].outcome == Outcome.SEEN


def test_fits_count_to_half_the_nearest_distance_and_to_five_quarters_of_the_farthest(
    judged, known
):
    nearest, farthest = known.readings.distances[[0, -1]]
    near, far = 0.5 * nearest, 1.25 * farthest
    for place, outcome in (
        (0.999 * near, Outcome.OUT_OF_RANGE),
        (near, Outcome.OUTSIDE_CALIBRATION),
        (0.999 * nearest, Outcome.OUTSIDE_CALIBRATION),
        (nearest, Outcome.SEEN),
        (farthest, Outcome.SEEN),
        (1.001 * farthest, Outcome.OUTSIDE_CALIBRATION),
        (far, Outcome.OUTSIDE_CALIBRATION),
        (1.001 * far, Outcome.OUT_OF_RANGE),
    ):
        # As wide as a shell at that distance.
        share = np.arcsin(0.1 / (place + 0.1)) / np.arcsin(0.1 / 0.9)
        found, _ = judged(share=min(max(share, 0.5), 1.3), range=place, shift=0.1)
        assert found.outcome in (outcome, Outcome.NO_SHELL_SHAPE)
        if place >= 0.5:
            assert found.outcome == outcome


@pytest.mark.parametrize("model", ["exact", "thesis"])
@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"lopsided": -0.5},
        {"around": 0.15},
        {"around": 0.1501},
        {"range": 1.7, "bearing": -2.9},
        {"share": 0.6, "only_whole": replace(GOOD, dent=0.5)},
    ],
    ids=["good", "lopsided", "beside", "more beside", "far", "partly"],
)
def test_what_a_fit_says_with_its_doubts_is_as_recorded(judged, as_recorded, model, changes):
    found, asked = judged(model=model, **changes)
    assert found.outcome.has_estimate
    as_recorded([found, asked], relative=1e-4)
