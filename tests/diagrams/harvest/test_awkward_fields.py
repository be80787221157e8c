"""Fields in which carts and combines have to make room for one another to come to an end."""

import pytest
import shapely

from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import Carts, Combines, FieldSource, HarvestScenario
from sightfield.diagrams.harvest.summary import summarise

NOTCH = shapely.Polygon(
    [(138.5, -37.2), (-55.4, 112.9), (20, 210.3), (108.7, 141.6), (164.5, 213.7), (269.6, 132.3)]
)
RECTANGLE = shapely.Polygon([(-17.2, 37.4), (121.7, 199.8), (230.9, 106.3), (92, -56.1)])
POND = shapely.Point(123.5, 54.5).buffer(6.9)
LARGER = shapely.Polygon([(-34.1, 54.5), (74.5, 277.1), (281.7, 176), (173.1, -46.6)])
LAKE = shapely.Point(152.5, 71.2).buffer(13.4)

CASES = {
    # At its end a cart has to pass by specks of crop that combines have missed.
    "notch": (NOTCH, 5, 2, {"header_width": 9.0, "capacity": 9000.0}, {"density": 0.405}),
    # A cart without a task stands where a combine has to back up.
    "pond": (
        RECTANGLE.difference(POND),
        3,
        1,
        {"header_width": 6.0, "capacity": 5000.0},
        {"density": 0.72, "strategy": "on-demand"},
    ),
    # The same specks, on a route that has been searched.
    "lake": (
        LARGER.difference(LAKE),
        2,
        1,
        {"header_width": 6.0, "capacity": 9000.0},
        {"density": 0.654, "routes": "car"},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_an_awkward_field_is_harvested_to_the_end(case, tmp_path):
    shape, combines, carts, team, more = CASES[case]
    file = tmp_path / "field.wkt"
    file.write_text(shape.wkt)
    scenario = HarvestScenario(
        field=FieldSource(file=str(file), coordinates="metres"),
        combines=Combines(count=combines, **team),
        carts=Carts(count=carts),
        hours=3.0,
        **more,
    )
    summary = summarise(run_harvest(prepare_harvest(scenario)), case)
    assert summary["finished"]
    assert summary["harvested_area_fraction"] > 0.99
    assert summary["grain_lost"] == 0.0
    assert summary["crop_crossings"] == 0
