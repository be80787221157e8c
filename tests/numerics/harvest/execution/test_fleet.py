"""Carts that are off their paths: steered back, and never faster round than tyres hold."""

import math

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.execution.fleet import pack_tracks, pose_on, steer
from sightfield.systems.numerics.harvest.paths import MachinePath

RADIUS, ACROSS_MOST, PERIOD = 10.0, 2.0, 0.5


@pytest.fixture
def tracks():
    """A straight of 30 m and a bend to the right of a radius of 10 m, half a circle of it."""
    poses = [(0.0, 0.0, 0.0), (30.0, 0.0, 0.0), (30.0, -2 * RADIUS, -math.pi)]
    return pack_tracks([MachinePath.of(poses)])


def driven(tracks, speed, state, end):
    """Greatest acceleration across, and the error across at the end."""
    station, state, greatest = 0.0, np.array(state, dtype=float), 0.0
    while station < end:
        after = station + speed * PERIOD
        v, omega = steer(
            tracks, state[None], np.array([station]), np.array([after]), PERIOD, ACROSS_MOST
        )
        greatest = max(greatest, abs(v * omega))
        half = omega * PERIOD / 2
        chord = v * PERIOD * np.sinc(half / math.pi)
        state[0] += chord * math.cos(state[2] + half)
        state[1] += chord * math.sin(state[2] + half)
        state[2] += 2 * half
        station = after
    x, y, theta = pose_on(tracks, 0, station)
    return greatest, math.cos(theta) * (state[1] - y) - math.sin(theta) * (state[0] - x)


@pytest.mark.parametrize("aside", [0.6, -0.6])
def test_a_cart_beside_its_path_is_steered_back_no_faster_than_tyres_hold(tracks, aside):
    speed = 0.985 * math.sqrt(ACROSS_MOST * RADIUS)
    greatest, _ = driven(tracks, speed, (0.0, aside, 0.0, 0.0), 29.0)
    assert greatest <= ACROSS_MOST + 1e-12
    greatest, left = driven(tracks, speed, (0.0, aside, 0.0, 0.0), 58.0)
    assert greatest == pytest.approx(ACROSS_MOST)
    assert abs(left) < 0.2


def test_a_step_into_a_bend_brings_a_cart_off_and_back(tracks):
    # A step begins on the straight and ends in the bend: what is held for it cuts the corner.
    speed = 0.985 * math.sqrt(ACROSS_MOST * RADIUS)
    greatest, left = driven(tracks, speed, (0.0, 0.0, 0.0, 0.0), 58.0)
    assert greatest <= ACROSS_MOST + 1e-12
    assert abs(left) < 0.1
