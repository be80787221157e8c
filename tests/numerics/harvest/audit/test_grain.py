"""Grain that is not where it must be."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.harvest_log import read_harvest


@pytest.fixture
def faults(by_hand, tmp_path):
    """A function that audits the harvest: its faults by kind."""

    def run():
        found = audit_harvest(*read_harvest(by_hand.write(tmp_path)))
        return {fault.kind: fault for fault in found.faults}

    return run


def test_a_tank_is_not_fuller_than_it_can_be(by_hand, faults):
    tank = by_hand.log["tank"]
    by_hand.about["combines"][0]["capacity"] = float(tank.max())
    assert faults() == {}
    by_hand.about["combines"][0]["capacity"] = float(tank.max()) - 0.5
    (fault,) = faults().values()
    assert (fault.kind, fault.machines) == ("more grain than it holds", ("combine 0",))
    assert fault.amount == pytest.approx(tank.max())


def test_a_cart_is_not_fuller_than_it_can_be(by_hand, faults):
    by_hand.about["carts"][0]["capacity"] = 1200.0
    fault = faults()["more grain than it holds"]
    assert fault.machines == ("cart 0",)
    assert (fault.amount, fault.limit) == pytest.approx((1260.0, 1200.0))


def test_a_gram_lost_on_the_way_to_the_cart_is_seen(by_hand, faults):
    late = by_hand.log["cart_load"][:, 0] > 0
    standing = np.flatnonzero(late)[0]
    by_hand.log["cart_load"][late, 0] -= 1e-3
    fault = faults()["grain is lost"]
    assert fault.amount == pytest.approx(1e-3, abs=1e-8)
    assert fault.time == by_hand.log["time"][standing]


def test_a_hundred_micrograms_are_rounding(by_hand, faults):
    late = by_hand.log["cart_load"][:, 0] > 0
    by_hand.log["cart_load"][late, 0] -= 1e-7
    assert faults() == {}


def test_grain_does_not_come_from_nowhere(by_hand, faults):
    # Nobody cuts at the very end.
    by_hand.log["delivered"][-3:] += 0.02
    fault = faults()["grain from nowhere"]
    assert fault.amount == pytest.approx(0.02)
    assert fault.time == by_hand.log["time"][-3]


def test_what_is_delivered_stays_so(by_hand, faults):
    by_hand.log["delivered"][1400:] = 100.0
    by_hand.log["cart_load"][1400:] -= 100.0
    assert faults() == {}
    by_hand.log["delivered"][1500:] = 40.0
    by_hand.log["cart_load"][1500:] += 60.0
    assert set(faults()) == {"grain is taken back"}


def test_no_tank_is_less_than_empty(by_hand, faults):
    by_hand.log["tank"][:] -= 1.0
    assert set(faults()) == {"less than no grain"}


def test_a_field_gives_its_density_and_no_more(by_hand, faults):
    by_hand.about["density"] = 0.72
    fault = faults()["grain differs from the area cut"]
    assert fault.amount == pytest.approx(0.02 * 5400, rel=0.02)
    # Without a density the grain has to come evenly.
    del by_hand.about["density"]
    assert faults() == {}
    by_hand.log["tank"][800:] += 150.0
    by_hand.log["tank"][:800] *= 1.5
    assert set(faults()) >= {"grain differs from the area cut"}
