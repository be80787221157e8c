"""Estimates are right within what they claim, or are not made."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.estimation.range_models import MODELS
from sightfield.systems.numerics.vision.estimation.shell_detection import (
    COLOURS,
    Outcome,
    ShellDetection,
    detect_shells,
)
from sightfield.systems.numerics.vision.estimation.shell_estimate import estimate_shell, locate
from sightfield.systems.numerics.vision.surroundings import Shell, shell_of

RED = Shell()


@pytest.fixture
def seen(photograph, calibration):
    """A function of a distance: the detection of a whole shell there in a picture without noise."""

    def detect(distance, bearing=0.3):
        picture = photograph([(RED, distance, bearing)], noise=0.0)
        return detect_shells(picture, [COLOURS["red"]], calibration.camera.axis_pixel)[0]

    return detect


@pytest.fixture
def look(photograph, calibration):
    """A function of what `photograph` takes: detection of the red shell."""

    def detect(*arguments, **settings):
        picture = photograph(*arguments, **settings)
        return detect_shells(picture, [COLOURS["red"]], calibration.camera.axis_pixel)[0]

    return detect


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def check(estimate, distance, bearing):
    """Assert that an estimate is right within four of its own deviations."""
    off = np.array([estimate.range - distance, wrapped(estimate.bearing - bearing)])
    deviations = np.sqrt(np.diag(estimate.covariance))
    assert np.all(np.abs(off) < 4 * deviations), (off, deviations, estimate.outcome)


def test_the_error_is_small_over_15_to_60_inches_and_all_directions(look, calibration):
    generator = np.random.default_rng(0)
    errors = {model: [] for model in MODELS}
    for k in range(40):
        distance, bearing = generator.uniform(0.381, 1.524), generator.uniform(-np.pi, np.pi)
        detection = look([(RED, distance, bearing)], seed=k)
        for model in MODELS:
            estimate = estimate_shell(detection, calibration, model)
            assert estimate.outcome == Outcome.SEEN
            check(estimate, distance, bearing)
            errors[model].append(abs(estimate.range - distance))
    assert np.mean(errors["exact"]) < 0.01
    assert 5 * np.mean(errors["exact"]) < np.mean(errors["thesis"])


@pytest.mark.parametrize("model", MODELS)
def test_a_worse_place_or_model_has_a_larger_covariance(seen, calibration, model):
    near, far = (estimate_shell(seen(d), calibration, model).covariance for d in (0.5, 1.5))
    assert near[0, 0] < far[0, 0]
    assert far[0, 0] < estimate_shell(seen(1.5), calibration, "thesis").covariance[0, 0] + 1e-12


def test_a_little_outside_the_calibration_the_covariance_grows(seen, calibration):
    last = estimate_shell(seen(1.52), calibration)
    beyond = estimate_shell(seen(1.8), calibration)
    assert beyond.outcome == Outcome.OUTSIDE_CALIBRATION
    assert beyond.covariance[0, 0] > 4 * last.covariance[0, 0]
    nearer = estimate_shell(seen(0.25), calibration)
    assert nearer.outcome == Outcome.OUTSIDE_CALIBRATION
    assert nearer.covariance[0, 0] > estimate_shell(seen(0.4), calibration).covariance[0, 0]


def no_numbers(estimate):
    """Whether an estimate says that it is none."""
    unknown = np.isnan([estimate.range, estimate.bearing]).all()
    return bool(unknown and np.isinf(np.diag(estimate.covariance)).all())


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("distance", [0.1, 0.17, 2.2, 3.5])
def test_far_outside_the_calibration_there_is_no_estimate(seen, calibration, model, distance):
    found = estimate_shell(seen(distance), calibration, model)
    assert found.outcome == Outcome.OUT_OF_RANGE
    assert no_numbers(found)


@pytest.mark.parametrize("outcome", [each for each in Outcome if not each.has_estimate])
def test_without_a_detection_there_is_no_estimate(calibration, outcome):
    found = estimate_shell(ShellDetection(outcome=outcome), calibration)
    assert found.outcome == outcome
    assert no_numbers(found)
    position, covariance = locate(found, np.zeros(3), 0.1)
    assert np.isnan(position).all()
    assert np.isinf(np.diag(covariance)).all()


@pytest.mark.parametrize(
    ("share", "outcome"), [(0.2, Outcome.MOSTLY_HIDDEN), (2.0, Outcome.TOO_WIDE)]
)
def test_a_width_that_does_not_fit_the_range_is_noticed(seen, calibration, share, outcome):
    whole = seen(0.8)
    found = estimate_shell(replace(whole, width=share * whole.width), calibration)
    assert found.outcome == outcome
    assert no_numbers(found)


@pytest.mark.parametrize("wall_height", [0.1, 0.15, 0.5])
def test_behind_walls_estimates_are_right_within_what_they_claim(look, calibration, wall_height):
    generator = np.random.default_rng(7)
    outcomes = set()
    for k in range(25):
        distance, bearing = generator.uniform(0.6, 1.6), generator.uniform(-np.pi, np.pi)
        reach = generator.uniform(0.4, 0.75) * distance
        aside = bearing + generator.normal() * 0.1 / reach
        x, y = reach * np.cos(aside), reach * np.sin(aside)
        half = generator.uniform(0.02, 0.1, 2)
        block = [(x - half[0], y - half[1]), (x + half[0], y + half[1])]
        corners = shapely.box(*block[0], *block[1]).exterior.coords[:-1]
        detection = look(
            [(RED, distance, bearing)], blocks=[corners], wall_height=wall_height, seed=k
        )
        for model in MODELS:
            estimate = estimate_shell(detection, calibration, model)
            outcomes.add(estimate.outcome)
            if estimate.outcome.has_estimate:
                check(estimate, distance, bearing)
    assert Outcome.SEEN in outcomes
    if wall_height == 0.5:
        assert outcomes >= {Outcome.NO_BLOB, Outcome.PARTLY_HIDDEN}


def test_behind_another_shell_estimates_are_right_within_what_they_claim(look, calibration):
    generator = np.random.default_rng(5)
    green, outcomes = shell_of("green"), set()
    for k in range(30):
        distance, bearing = generator.uniform(0.8, 1.6), generator.uniform(-np.pi, np.pi)
        nearer = generator.uniform(0.3, 0.9) * distance - RED.radius
        other = (green, nearer, bearing + generator.normal() * 0.1 / nearer)
        estimate = estimate_shell(look([(RED, distance, bearing), other], seed=k), calibration)
        outcomes.add(estimate.outcome)
        if estimate.outcome.has_estimate:
            check(estimate, distance, bearing)
    assert outcomes >= {Outcome.SEEN, Outcome.NO_SHELL_SHAPE}


def test_two_shells_of_one_colour_give_no_estimate(look, calibration):
    found = estimate_shell(look([(RED, 0.5, 0.3), (RED, 1.0, -2.0)]), calibration)
    assert found.outcome == Outcome.TWO_BLOBS
    assert no_numbers(found)


def test_two_shells_that_look_like_one_give_no_confident_bearing(look, calibration):
    found = estimate_shell(look([(RED, 0.8, 0.1), (RED, 0.8, -0.08)]), calibration)
    assert no_numbers(found)


def test_bearing_and_position_are_the_thesis_s(calibration, seen):
    # theta_e = theta_p + alpha (2.5); x_e = x_p + d cos theta_e, y_e = y_p + d sin theta_e (2.6).
    estimate = estimate_shell(seen(1.0), calibration)
    estimate = replace(estimate, bearing=np.pi / 6, covariance=np.diag([4e-6, 9e-6]))
    position, covariance = locate(estimate, np.array([3.0, -2.0, np.pi / 3]), 0.1)
    assert position == pytest.approx([3.0, -2.0 + estimate.range + 0.1])
    # Along the line of sight, here north, the range's; across it, the bearing's.
    assert covariance[1, 1] == pytest.approx(estimate.covariance[0, 0])
    across = (estimate.range + 0.1) ** 2 * estimate.covariance[1, 1]
    assert covariance[0, 0] == pytest.approx(across)
    assert covariance[0, 1] == pytest.approx(0, abs=1e-12)


def test_the_covariance_of_a_position_is_that_of_many(calibration, seen):
    estimate = estimate_shell(seen(1.2, 0.4), calibration)
    pose, generator = np.array([1.0, 2.0, -1.1]), np.random.default_rng(2)
    drawn = generator.multivariate_normal(
        [estimate.range, estimate.bearing], estimate.covariance, 20000
    )
    many = [locate(replace(estimate, range=r, bearing=b), pose, 0.1)[0] for r, b in drawn]
    _, covariance = locate(estimate, pose, 0.1)
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    assert np.cov(np.transpose(many)) / scale == pytest.approx(covariance / scale, abs=0.05)


def test_an_unknown_model_is_named(calibration, seen):
    with pytest.raises(InvalidInput, match="`model` must be one of thesis, exact; got best"):
        estimate_shell(seen(1.0), calibration, "best")
