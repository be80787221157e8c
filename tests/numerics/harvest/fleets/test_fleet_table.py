"""Fleets side by side: more never takes longer, and the knee is where it should be."""

from dataclasses import replace

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.fleets.figures import FleetFigures
from sightfield.systems.numerics.harvest.fleets.fleet_table import fleet_table, knee_of
from sightfield.systems.numerics.harvest.machines import Cart, Combine
from sightfield.systems.numerics.harvest.trucks import TruckFleet

ROW = FleetFigures(
    combines=1, carts=1, trucks=1, makespan=1.0, combine_engine_time=1.0, cart_engine_time=1.0,
    combine_way=1.0, cart_way=1.0, combine_fuel=1.0, cart_fuel=1.0, combines_for_carts=0.0,
    combines_for_combines=0.0, carts_for_grain=0.0, carts_for_trucks=0.0, misses=0, visits=1,
    trips=1,
)  # fmt: skip


def rows_of(times: list[float]) -> list[FleetFigures]:
    return [replace(ROW, combines=n + 1, makespan=time) for n, time in enumerate(times)]


def test_the_knee_of_a_broken_line_is_where_it_breaks():
    assert knee_of(rows_of([10.0, 7.0, 4.0, 3.8, 3.6, 3.4])) == 2


def test_fleets_that_are_slower_than_smaller_ones_are_no_knee():
    assert knee_of(rows_of([10.0, 4.0, 9.0, 8.0, 3.9])) == 1


def test_of_two_fleets_the_quicker_one_is_the_knee():
    assert knee_of(rows_of([10.0, 4.0])) == 1
    assert knee_of(rows_of([10.0])) == 0


def test_more_carts_and_trucks_never_take_longer():
    table = fleet_table(
        Field.rectangle(160.0, 120.0),
        [Combine(capacity=3000.0)] * 2,
        Cart(capacity=6000.0),
        TruckFleet(capacity=4000.0, road_time=600.0),
        density=0.8,
        truck_rate=300.0,
        most=(2, 2),
    )
    assert not table.refused
    assert len(table.rows) == 8
    for row in table.rows:
        for more in (
            table.row(row.combines, row.carts + 1, row.trucks),
            table.row(row.combines, row.carts, row.trucks + 1),
        ):
            assert more is None or more.makespan <= row.makespan
        assert row.makespan * row.combines >= row.combine_engine_time - 1e-6
        assert row.combine_engine_time >= row.combines_for_carts + row.combines_for_combines
    one, two = (table.row(n, 2, 2) for n in (1, 2))
    assert one is not None
    assert two is not None
    assert two.makespan < one.makespan


def test_no_fleet_at_all_is_refused():
    with pytest.raises(InvalidInput, match="most"):
        fleet_table(
            Field.rectangle(160.0, 120.0), [Combine()], Cart(), TruckFleet(),
            density=0.8, truck_rate=300.0, most=(0, 1),
        )  # fmt: skip
