"""From light to pixels."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.vision.sensor import Sensor, expose, is_dropped

CLEAN = {"blur": 0.0, "noise": 0.0}


def grey(level: float) -> np.ndarray:
    return np.full((60, 80, 3), level, dtype=np.float32)


def test_a_perfect_sensor_counts_light():
    light = np.linspace(0, 1, 256 * 3, dtype=np.float32).reshape(16, 16, 3)
    picture = expose(Sensor(**CLEAN), light, 0)
    assert picture.dtype == np.uint8
    np.testing.assert_array_equal(picture[..., :3], np.floor(light * 255 + 0.5))
    assert (picture[..., 3] == 255).all()


def test_exposure_scales_counts_until_they_saturate():
    dim, bright = (expose(Sensor(exposure=e, **CLEAN), grey(0.6), 0) for e in (0.5, 2.0))
    assert (dim[..., :3] == math.floor(0.3 * 255 + 0.5)).all()
    assert (bright[..., :3] == 255).all()


def test_noise_has_its_deviation_and_no_bias():
    picture = expose(Sensor(blur=0.0, noise=6.0), grey(0.5), 0)[..., :3].astype(float)
    assert picture.mean() == pytest.approx(127.5, abs=0.3)
    # Rounding adds the variance of a uniform distribution.
    assert picture.std() == pytest.approx(math.sqrt(36 + 1 / 12), rel=0.03)
    across = np.corrcoef(picture.reshape(-1, 3).T) - np.eye(3)
    assert np.abs(across).max() < 0.05


def test_pictures_repeat_with_their_seed_and_number_only():
    noisy = Sensor(seed=4)
    first = expose(noisy, grey(0.5), 7)
    np.testing.assert_array_equal(first, expose(noisy, grey(0.5), 7))
    assert (first != expose(noisy, grey(0.5), 8)).any()
    assert (first != expose(Sensor(seed=5), grey(0.5), 7)).any()


@pytest.mark.parametrize("bits", [1, 2, 5])
def test_a_coarse_sensor_tells_two_to_the_bits_levels_apart(bits):
    light = np.linspace(0, 1, 4800, dtype=np.float32).reshape(40, 40, 3)
    picture = expose(Sensor(bits=bits, **CLEAN), light, 0)[..., :3]
    levels = np.unique(picture)
    assert len(levels) == 2**bits
    assert levels[0] == 0
    assert levels[-1] == 255
    assert np.abs(picture / 255 - light).max() <= 0.5 / (2**bits - 1) + 1 / 255


def test_blur_spreads_a_point_with_its_deviation_and_keeps_its_light():
    point = np.zeros((41, 41, 3), dtype=np.float32)
    point[20, 20] = 1.0
    picture = expose(Sensor(blur=2.0, noise=0.0, exposure=20.0), point, 0)[..., 0].astype(float)
    assert picture.sum() == pytest.approx(20 * 255, rel=0.02)
    offsets = np.arange(41) - 20
    deviation = math.sqrt((picture.sum(axis=0) * offsets**2).sum() / picture.sum())
    assert deviation == pytest.approx(2.0, rel=0.03)


def test_the_share_of_lost_pictures_is_the_one_asked_for():
    lost = [is_dropped(Sensor(drop_share=0.3, seed=1), frame) for frame in range(3000)]
    assert np.mean(lost) == pytest.approx(0.3, abs=0.03)
    assert lost == [is_dropped(Sensor(drop_share=0.3, seed=1), frame) for frame in range(3000)]
    assert not any(is_dropped(Sensor(), frame) for frame in range(10))
    assert all(is_dropped(Sensor(drop_share=1.0), frame) for frame in range(10))


@pytest.mark.filterwarnings("error")
def test_the_worst_sensors_that_there_are_still_take_pictures():
    worst = Sensor(exposure=1e6, blur=1e3, noise=1e6)
    assert expose(worst, np.full((12, 16, 3), 0.5), 0).shape == (12, 16, 4)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"exposure": 0.0}, "`exposure` must be positive; got 0.0"),
        ({"blur": -1.0}, "`blur` must be zero or positive; got -1.0"),
        ({"noise": math.inf}, "`noise` must be a finite number; got inf"),
        ({"exposure": 1e8}, r"`exposure` must be at most 1e\+06; got 100000000"),
        ({"blur": 1e9}, r"`blur` must be at most 1000; got 1000000000"),
        ({"noise": 1e8}, r"`noise` must be at most 1e\+06; got 100000000"),
        ({"bits": 9}, "`bits` must be a whole number from 1 to 8; got 9"),
        ({"drop_share": 1.5}, r"`drop_share` must lie in \[0, 1\]; got 1.5"),
        ({"seed": -1}, "`seed` must be zero or positive; got -1"),
    ],
)
def test_impossible_sensors_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        Sensor(**change)
