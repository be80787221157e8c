"""Fields that are no rectangles, with ponds in them and several carts, are harvested to the end."""

import pytest
import shapely
from shapely import affinity

from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.report import summarise_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import Carts, Combines, FieldSource, HarvestScenario

NOTCH = shapely.Polygon(
    [(138.5, -37.2), (-55.4, 112.9), (20, 210.3), (108.7, 141.6), (164.5, 213.7), (269.6, 132.3)]
)
RECTANGLE = shapely.Polygon([(-17.2, 37.4), (121.7, 199.8), (230.9, 106.3), (92, -56.1)])
POND = shapely.Point(123.5, 54.5).buffer(6.9)

CASES = {
    "notch": (NOTCH, 3, 2, {"header_width": 9.0, "capacity": 6000.0}, {"density": 0.405}),
    "pond": (
        RECTANGLE.difference(POND),
        2,
        1,
        {"header_width": 6.0, "capacity": 3500.0},
        {"density": 0.72, "strategy": "on-demand"},
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_an_awkward_field_is_harvested_to_the_end(case, tmp_path):
    shape, combines, carts, team, more = CASES[case]
    file = tmp_path / "field.wkt"
    file.write_text(affinity.scale(shape, 0.75, 0.75, origin=(0, 0)).wkt)
    scenario = HarvestScenario(
        field=FieldSource(file=str(file), coordinates="metres"),
        combines=Combines(count=combines, **team),
        carts=Carts(count=carts),
        period=0.5,
        hours=3.0,
        **more,
    )
    summary = summarise_harvest(run_harvest(prepare_harvest(scenario)), case)
    assert summary["finished"]
    assert summary["audit_faults"] == 0
    assert summary["coverage"] > 0.985
    assert summary["grain_lost"] == 0.0
    assert summary["grain_delivered"] == pytest.approx(summary["grain_harvested"], rel=1e-9)
    assert (summary["min_cart_to_cart"] is None) == (carts == 1)
    assert (summary["min_to_obstacle"] is None) == (case != "pond")
