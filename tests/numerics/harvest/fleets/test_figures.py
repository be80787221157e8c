"""Fuel: the published law at points that can be done by hand, and linear where it should be."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.fleets.figures import (
    driving_energy,
    driving_fuel,
    fuel_rate,
    idling_rate,
    threshing_energy,
)
from sightfield.systems.numerics.harvest.machines import Combine

HOUR = 3600.0


def test_an_engine_at_full_power_burns_0_316_litres_a_kilowatt_hour():
    assert HOUR * fuel_rate(100e3, 100e3) == pytest.approx(31.6)


def test_half_the_speed_saves_fuel_as_published():
    # (0.22 * 0.3 + 0.096) (1 + 0.0045 * 0.3 * 50 - 0.00877 * 50) = 0.162 * 0.629
    assert HOUR * fuel_rate(100e3, 30e3, 50.0) == pytest.approx(100 * 0.162 * 0.629)
    assert HOUR * idling_rate(100e3) == pytest.approx(100 * 0.096 * (1 - 0.4385))


def test_only_the_sum_of_the_energy_counts():
    loads = np.random.default_rng(3).uniform(0.0, 150e3, 500)
    each = sum(fuel_rate(150e3, load) for load in loads)
    assert driving_fuel(150e3, float(loads.sum()), 500.0) == pytest.approx(each)


def test_an_hour_of_threshing_by_the_standard_s_figures():
    # 30 t of grain and as much straw in an hour: 20 kW + 30 * 3.6 kW.
    assert threshing_energy(30e3, HOUR) == pytest.approx((20 + 108) * 3.6e6)
    assert threshing_energy(0.0, HOUR) == pytest.approx(20 * 3.6e6)


def test_a_kilometre_with_ten_tonnes_on_firm_soil():
    # 5.818% of the weight, four fifths of the power arriving.
    energy = driving_energy(10e3, 1000.0)
    assert energy == pytest.approx(0.0581818 * 9.80665 * 10e3 * 1000.0 / 0.8, rel=1e-5)


def test_a_hectare_of_wheat_takes_what_combines_take():
    """Ten to twenty litres, which is what farms measure."""
    combine, grain = Combine(), 8000.0
    way = 1e4 / combine.header_width
    time = way / combine.speed
    energy = threshing_energy(grain, time)
    energy += driving_energy(combine.mass + combine.capacity / 2, way)
    assert 10.0 < driving_fuel(combine.engine_power, energy, time) < 20.0
    assert energy / time < combine.engine_power
