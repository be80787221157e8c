"""Both models of range, against closed forms and the mirror that they are to describe."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sightfield.systems.numerics.vision.estimation.range_models import (
    exact_pixel_radius,
    exact_range,
    fit_parabola,
    implied_k,
    k_values,
    thesis_range,
)
from sightfield.systems.numerics.vision.omni_optics import OmniCamera


def test_at_45_degrees_the_distance_is_the_height():
    assert thesis_range(107 * np.pi / 4, k=107, height=0.3) == pytest.approx(0.3)


def test_at_and_above_the_horizon_there_is_no_distance():
    assert np.isinf(thesis_range([107 * np.pi / 2, 200.0], k=107, height=0.3)).all()


@given(st.floats(0.05, 5.0), st.floats(0.1, 2.0), st.floats(50, 200))
def test_k_values_undo_the_thesis_model(distance, height, k):
    p = k * np.arctan(distance / height)
    assert thesis_range(p, k=k, height=height) == pytest.approx(distance, rel=1e-9)
    assert k_values(p, distance, height=height) == pytest.approx(k)


@given(st.floats(0.15, 6.0), st.floats(0.0, 0.1))
def test_the_exact_model_undoes_the_mirror(distance, base):
    camera = OmniCamera()
    p = exact_pixel_radius([distance], camera=camera, base=base)
    assert exact_range(p, camera=camera, base=base) == pytest.approx(distance, rel=1e-8)


def test_beyond_the_mirror_there_is_no_distance():
    camera = OmniCamera()
    assert np.isinf(exact_range(camera.rim_radius + 1, camera=camera, base=0.0))


def test_near_the_axis_k_is_that_of_the_paraxial_mirror():
    # theta = p / f meets the ball at l theta, whose normal leans by l theta / R: the ray leaves at
    # (1 + 2 l / R) theta to the axis.
    camera = OmniCamera(mirror_radius=0.05, mirror_distance=0.15, focal_length=860.0)
    # Far below, where it does not matter which point of the axis rays seem to come from.
    deep = OmniCamera(pinhole_height=100.0)
    assert implied_k(deep, 0.0, np.array([1.0])) == pytest.approx(860 / 7, rel=1e-3)
    assert implied_k(camera, 0.04, np.array([1.5])) < 860 / 7


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(-1, 1))
def test_the_parabola_of_a_parabola_is_itself(a, b, c):
    y = np.linspace(0.4, 1.5, 10)
    estimate = y - (a * y**2 + b * y + c)
    assert fit_parabola(y, estimate) == pytest.approx((a, b, c), abs=1e-9)
