"""The filter believes what it should."""

import numpy as np
import pytest

from sightfield.systems.numerics.vision.estimation.position_filter import (
    correct,
    predict,
    start_track,
)

EYE = np.eye(2)


def test_without_noise_a_point_flies_straight_on():
    track = start_track(np.array([1.0, 2.0]), 0.01 * EYE, 0.5)
    track = track._replace(mean=np.array([1.0, 2.0, 0.3, -0.4]))
    later = predict(track, 2.0, 0.0)
    assert later.mean == pytest.approx([1.6, 1.2, 0.3, -0.4])
    assert later.covariance[:2, :2] == pytest.approx((0.01 + 4 * 0.25) * EYE)


def test_two_steps_are_as_good_as_one():
    track = start_track(np.array([1.0, 2.0]), 0.01 * EYE, 0.5)
    once, twice = predict(track, 0.7, 0.2), predict(predict(track, 0.3, 0.2), 0.4, 0.2)
    assert twice.mean == pytest.approx(once.mean)
    assert twice.covariance == pytest.approx(once.covariance)


def test_a_still_point_measured_n_times_is_known_to_one_over_n():
    track = start_track(np.zeros(2), 0.04 * EYE, 1e-9)
    for _ in range(9):
        track = correct(predict(track, 0.1, 0.0), np.array([0.1, 0.0]), 0.04 * EYE)
        assert track is not None
    assert track.covariance[:2, :2] == pytest.approx(0.004 * EYE, rel=1e-6)
    assert track.mean[:2] == pytest.approx([0.09, 0.0], rel=1e-6)


def test_information_adds_up():
    track = start_track(np.array([1.0, 1.0]), np.array([[0.2, 0.05], [0.05, 0.1]]), 0.3)
    noise = np.array([[0.1, -0.02], [-0.02, 0.3]])
    after = correct(track, np.array([1.2, 0.9]), noise)
    assert after is not None
    known = np.linalg.inv(track.covariance)
    known[:2, :2] += np.linalg.inv(noise)
    assert after.covariance == pytest.approx(np.linalg.inv(known))


def test_a_measurement_far_off_is_refused():
    track = start_track(np.zeros(2), 0.01 * EYE, 0.1)
    assert correct(track, np.array([0.4, 0.0]), 0.01 * EYE) is not None
    assert correct(track, np.array([0.6, 0.0]), 0.01 * EYE) is None


def test_the_claimed_covariance_is_the_true_one():
    generator = np.random.default_rng(4)
    density, noise, step = 0.05, 0.03**2 * EYE, 0.1
    squared = []
    for _ in range(200):
        truth = np.zeros(4)
        track = start_track(generator.normal(0, 0.03, 2), noise, 0.2)
        truth[2:] = generator.normal(0, 0.2, 2)
        for _ in range(20):
            clean = predict(track._replace(mean=truth, covariance=np.zeros((4, 4))), step, density)
            truth = generator.multivariate_normal(clean.mean, clean.covariance)
            seen = truth[:2] + generator.normal(0, 0.03, 2)
            predicted = predict(track, step, density)
            track = correct(predicted, seen, noise) or predicted
        off = truth - track.mean
        squared.append(off @ np.linalg.solve(track.covariance, off))
    # Chi-squared with four degrees of freedom: mean 4, deviation of the mean of 200 is 0.2.
    assert np.mean(squared) == pytest.approx(4, abs=0.8)
