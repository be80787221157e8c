"""The whole audit, on a harvest made by hand in which one thing is wrong, grain among others."""

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.audit.audit import audit_harvest
from sightfield.systems.numerics.harvest.audit.harvest_log import read_harvest


@pytest.fixture
def audited(by_hand, tmp_path):
    """A function that writes the harvest as it is now, and audits it."""

    def run(gap=0.3):
        return audit_harvest(*read_harvest(by_hand.write(tmp_path)), gap)

    return run


def kinds(found):
    return {fault.kind for fault in found.faults}


def test_nothing_is_wrong_with_a_clean_harvest(audited):
    found = audited()
    assert found.faults == ()
    assert found.passed
    figures = found.figures
    assert figures["coverage"] == 1.0
    assert figures["crop_under_bodies"] == 0.0
    assert figures["grain_harvested"] == pytest.approx(0.7 * 5400)
    assert figures["combine_acceleration"] == pytest.approx(0.5, abs=0.01)
    assert figures["combine_lateral_acceleration"] == pytest.approx(1.5**2 / 4.5, rel=0.01)
    assert figures["min_combine_to_combine"] is None
    assert figures["min_to_obstacle"] is None
    assert figures["min_cart_to_combine"] > 20


def test_a_gap_that_is_not_positive_is_refused(audited):
    with pytest.raises(InvalidInput, match="gap"):
        audited(gap=0.0)


def put_cart(by_hand, shapes, x, y, theta):
    """The cart stands there all the time, its trailer bent by 0.5 rad."""
    cart = np.broadcast_to([x, y, theta], (len(by_hand.log["time"]), 3))
    by_hand.log["tractor_pose"] = cart[:, None].copy()
    by_hand.log["trailer_pose"] = shapes.behind(cart, 0.5)[:, None]


def test_a_tractor_too_near_to_a_header_that_passes_is_seen_when_it_passes(
    by_hand, shapes, audited
):
    # The first row's header ends at y = 0; the tractor is 1.25 m to each side of its axle.
    put_cart(by_hand, shapes, 100.0, -1.25 - 0.17, 0.0)
    by_hand.log["trailer_pose"][:, 0] = [94.6, -1.42, 0.0]
    (fault,) = audited().faults
    assert (fault.kind, fault.machines) == ("machines too near", ("combine 0", "cart 0"))
    assert fault.amount == pytest.approx(0.17, abs=1e-3)
    # 120 m from the start at 1.5 m/s, and 1.5 s more for speeding up.
    assert fault.begin < 80 + 1.5 < fault.end
    assert fault.end - fault.begin < 12
    assert audited(gap=0.16).passed


def test_machines_that_overlap_are_told_with_the_area(by_hand, shapes, audited):
    # Off the field, 0.5 m of the tractor's width in the header's way.
    put_cart(by_hand, shapes, 210.0, -1.25 + 0.5, 0.0)
    by_hand.log["trailer_pose"][:, 0] = [204.6, -4.0, 0.0]
    found = audited()
    overlap = next(fault for fault in found.faults if fault.kind == "machines overlap")
    # The header is 2 m deep.
    assert overlap.amount == pytest.approx(0.5 * 2.0, rel=1e-6)
    assert found.figures["min_cart_to_combine"] == 0.0


def test_a_machine_that_teleports_is_seen(by_hand, audited):
    by_hand.log["combine_pose"][800:, 0, 0] += 1.0
    found = audited()
    assert kinds(found) >= {"acceleration along", "speed differs from poses"}
    time = by_hand.log["time"][799]
    assert all(abs(fault.time - time) < 1.0 for fault in found.faults)


def test_a_cart_that_teleports_with_its_trailer_is_seen(by_hand, audited):
    by_hand.log["tractor_pose"][800:, 0, 1] += 1.0
    by_hand.log["trailer_pose"][800:, 0, 1] += 1.0
    assert kinds(audited()) >= {"pose jumps", "trailer pose jumps", "moves sideways"}


def test_a_trailer_that_leaves_its_hitch_is_seen(by_hand, audited):
    by_hand.log["trailer_pose"][300:320, 0, 1] += 0.08
    assert kinds(audited()) == {"trailer off its hitch"}


def test_an_outline_beyond_the_margin_is_seen_with_its_area(by_hand, shapes, audited):
    by_hand.about["margin"] = 51.0
    put_cart(by_hand, shapes, 250.0, 13.0, 0.3)
    found = audited()
    (fault,) = found.faults
    assert (fault.kind, fault.machines) == ("beyond the margin", ("cart 0",))
    assert (fault.begin, fault.end) == (0.0, 500.0)
    c, s = np.cos(0.3), np.sin(0.3)
    corners = np.array([[-0.6, -1.25], [2.5, -1.25], [2.5, 1.25], [-0.6, 1.25]])
    x = 250 + c * corners[:, 0] - s * corners[:, 1]
    assert x.min() < 251 < x.max()
    # The ground ends at x = 251, which runs through the tractor.
    off = shapely.Polygon(np.column_stack([x, s * corners[:, 0] + c * corners[:, 1]]))
    assert fault.amount == pytest.approx(off.difference(shapely.box(0, -9, 251, 9)).area)
    assert found.figures["beyond_margin"] == fault.amount


def test_a_margin_is_round_at_corners(by_hand, shapes, audited):
    # The field's corner is at (200, 27); the tractor's farthest corner is 2.5 m ahead of its pose.
    by_hand.about["margin"] = 60.0
    ahead, aside = 60.0 / np.sqrt(2), 60.0 / np.sqrt(2)
    put_cart(by_hand, shapes, 200 + ahead - 2.6, 27 + aside - 1.35, 0.0)
    assert audited().passed
    put_cart(by_hand, shapes, 200 + ahead - 2.4, 27 + aside - 1.15, 0.0)
    assert kinds(audited()) == {"beyond the margin"}


def test_a_pole_under_a_header_is_an_obstacle_driven_over(by_hand, audited):
    pole = [[100, 8], [100.4, 8], [100.4, 8.3], [100, 8.3]]
    by_hand.about["parts"][0]["holes"] = [pole]
    found = audited()
    (fault,) = found.faults
    assert (fault.kind, fault.machines) == ("in an obstacle", ("combine 0",))
    assert fault.amount == pytest.approx(0.4 * 0.3)
    assert found.figures["min_to_obstacle"] == 0.0


def test_a_hole_along_which_a_header_drives_is_only_touched(by_hand, audited):
    # Between the field's upper edge and a hole beside it the header fits to the millimetre.
    by_hand.about["parts"][0]["boundary"] = [[0, 0], [200, 0], [200, 40], [0, 40]]
    by_hand.about["parts"][0]["holes"] = [[[50, 27], [90, 27], [90, 33], [50, 33]]]
    by_hand.about["parts"].append({"boundary": [[60, 29], [70, 29], [70, 31], [60, 31]]})
    found = audited()
    assert "in an obstacle" not in kinds(found)
    assert found.figures["min_to_obstacle"] == pytest.approx(0.0, abs=1e-3)
    # The island in the hole is crop of its own.
    assert found.figures["field_area"] == pytest.approx(200 * 40 - 40 * 6 + 20)


def test_crop_under_a_cart_is_told_with_the_cart(by_hand, shapes, audited):
    put_cart(by_hand, shapes, 100.0, 20.0, 1.0)
    found = audited()
    (fault,) = [each for each in found.faults if each.kind == "crop under bodies"]
    assert fault.machines == ("cart 0",)
    # Tractor and trailer are 2.5 m wide, 3.1 m and 4.3 m long.
    assert fault.amount == pytest.approx(2.5 * (3.1 + 4.3), rel=0.05)
    assert found.figures["crop_under_bodies"] == fault.amount


def test_samples_farther_apart_than_half_a_second_are_a_fault(by_hand, audited):
    for name in by_hand.log:
        by_hand.log[name] = np.delete(by_hand.log[name], [1000, 1001], axis=0)
    assert kinds(audited()) == {"samples too far apart"}


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
