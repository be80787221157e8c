"""An auger reaches the box of a cart beside it, wherever the tractor before the box is."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.machines.alongside import (
    MIDDLE,
    box_middle,
    is_alongside,
    pair_up,
)

LENGTH, HITCH, REACH = 5.0, 0.9, 8.0
POSE = np.array([10.0, 5.0, np.pi / 2])


def state_of(box, heading, beta):
    """The state of a cart whose box has its middle at a place [m] and a heading."""
    theta = heading + beta
    behind = LENGTH * (1.0 - MIDDLE)
    x, y = (
        np.array(box)
        + behind * np.array([np.cos(heading), np.sin(heading)])
        + HITCH * np.array([np.cos(theta), np.sin(theta)])
    )
    return np.array([x, y, theta, beta])


def reached(state, stands=False):
    return is_alongside(POSE, state, LENGTH, HITCH, REACH, stands)


@pytest.mark.parametrize("beta", [0.0, 0.5, -1.2])
def test_the_middle_of_the_box_is_behind_the_hitch_along_the_trailer(beta):
    found = box_middle(state_of((3.0, -2.0), 0.7, beta), LENGTH, HITCH)
    np.testing.assert_allclose(found, (3.0, -2.0, 0.7), atol=1e-12)


@pytest.mark.parametrize("beta", [0.0, 0.6, -0.9])
def test_it_reaches_a_box_that_is_beside_and_parallel_however_its_tractor_turns(beta):
    beside = np.array([10.0 - REACH, 5.0])
    assert reached(state_of(beside, np.pi / 2, beta))
    assert not reached(state_of(np.add(beside, (0.0, 4.0)), np.pi / 2, beta))
    assert not reached(state_of(np.add(beside, (-1.5, 0.0)), np.pi / 2, beta))
    assert not reached(state_of(np.add(beside, (2 * REACH, 0.0)), np.pi / 2, beta))
    assert not reached(state_of(beside, np.pi / 2 + 0.3, beta))


def test_a_combine_that_stands_swings_its_auger():
    ahead = state_of((10.0 - REACH, 9.0), 0.3, 0.2)
    assert not reached(ahead)
    assert reached(ahead, stands=True)
    assert not reached(state_of((10.0 - REACH, 20.0), 0.3, 0.2), stands=True)


def test_a_combine_pours_only_into_a_cart_that_is_to_empty_it():
    poses = np.array([POSE, np.add(POSE, (40.0, 0.0, 0.0))])
    at = [state_of((x - REACH, 5.0), np.pi / 2, 0.1) for x in (50.0, 10.0)]
    stands = np.zeros(2, dtype=bool)

    def pairs(*wanted):
        return pair_up(
            poses, np.array(at), np.array(wanted, dtype=float), stands, LENGTH, HITCH, REACH
        ).tolist()

    assert pairs(1, 0) == [1.0, 0.0]
    assert pairs(1, -1) == [-1.0, 0.0]
    assert pairs(0, 1) == [-1.0, -1.0]
