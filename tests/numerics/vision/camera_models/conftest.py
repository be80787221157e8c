"""Cameras of each model, away from neutral values."""

import pytest

from sightfield.systems.numerics.vision.camera_models.central_cameras import (
    KannalaBrandtCamera,
    MeiCamera,
    ScaramuzzaCamera,
)

SIZE = {"width": 640, "height": 480}
CAMERAS = {
    "scaramuzza": ScaramuzzaCamera(
        polynomial=(-180.0, 0.0, 1.6e-3, -1e-6, 1.1e-8),
        centre_x=331.5,
        centre_y=228.25,
        c=0.997,
        d=-0.004,
        e=0.006,
        **SIZE,
    ),
    "mei": MeiCamera(
        xi=0.93,
        focal_x=260.0,
        focal_y=257.0,
        centre_x=331.5,
        centre_y=228.25,
        skew=0.7,
        k1=-0.08,
        k2=0.012,
        k3=-0.0004,
        p1=0.003,
        p2=-0.002,
        **SIZE,
    ),
    "kannala_brandt": KannalaBrandtCamera(
        focal_x=180.0,
        focal_y=178.0,
        centre_x=331.5,
        centre_y=228.25,
        skew=-0.4,
        k1=0.02,
        k2=-0.008,
        k3=0.001,
        k4=-0.0002,
        **SIZE,
    ),
}


@pytest.fixture(params=CAMERAS)
def camera(request):
    """One of each model."""
    return CAMERAS[request.param]


@pytest.fixture
def cameras():
    """All of them, by name."""
    return CAMERAS
