"""Errors over distance and angle, measured on rendered pictures and drawn."""

import numpy as np
import pytest

from sightfield.diagrams.social.pictures.error_curves import (
    ErrorCurves,
    measure_errors,
    save_error_curves,
)


@pytest.fixture(scope="module")
def curves() -> ErrorCurves:
    return measure_errors(distances=(0.7, 1.8), angles=(0.1, 0.6), pictures=3)


def test_the_camera_is_less_sure_from_afar(curves):
    errors = curves.over_distance["level"]
    near, far = np.nanmedian(errors.camera_doubt, axis=1)
    assert far > 2 * near
    assert np.nanmax(errors.camera[0]) < 0.02


def test_the_printed_equation_is_the_worst(curves):
    at_angles = curves.over_angle
    printed = np.nanmedian(at_angles["thesis"].camera)
    assert printed > 5 * np.nanmedian(at_angles["edges"].camera)
    assert printed > 5 * np.nanmedian(at_angles["level"].camera)


def test_how_the_evader_is_turned_is_worth_knowing(curves):
    by_size = np.nanmedian(curves.over_angle["edges"].evader)
    assert np.nanmedian(curves.over_angle["level"].evader) < 0.5 * by_size


def test_curves_are_drawn(curves, tmp_path):
    save_error_curves(tmp_path / "curves.png", curves)
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
