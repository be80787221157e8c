"""Fields on which more grows in some places: as planned, and where more grows than was known."""

from dataclasses import replace

import pytest

from sightfield.diagrams.harvest.job import prepare_harvest
from sightfield.diagrams.harvest.report import summarise_harvest
from sightfield.diagrams.harvest.run import run_harvest
from sightfield.diagrams.harvest.scenario import (
    Carts,
    Combines,
    FieldSource,
    HarvestScenario,
    Yields,
)

GRID = "ncols 2\nnrows 1\nxllcorner -10\nyllcorner -10\ncellsize 60\nNODATA_value -1\n13 5\n"
# South of y = 50 13 t/ha grow up to x = 50 and 5 t/ha beyond, north of it 9 t/ha [kg].
GRAIN = 2500 * 1.3 + 2500 * 0.5 + 2000 * 0.9


@pytest.fixture(scope="module")
def job(tmp_path_factory):
    file = tmp_path_factory.mktemp("yields") / "yields.asc"
    file.write_text(GRID)
    return prepare_harvest(
        HarvestScenario(
            field=FieldSource(width=100.0, height=70.0),
            density=0.9,
            yields=Yields(file=str(file)),
            combines=Combines(count=1, header_width=9.0, capacity=3000.0),
            carts=Carts(count=1, capacity=8000.0),
            reserve=0.2,
            period=0.5,
            hours=1.0,
        )
    )


def test_tanks_fill_as_planned_and_as_the_map_says(job):
    found = summarise_harvest(run_harvest(job), "map")
    assert found["finished"]
    assert found["audit_faults"] == 0
    assert found["yields_known"] == pytest.approx(50 / 70)
    assert found["makespan"] == pytest.approx(found["makespan_planned"], rel=0.02)
    assert found["load_deviation"] < 0.02
    assert found["grain_delivered"] == pytest.approx(GRAIN, rel=0.01)


def test_a_reserve_holds_what_grows_beyond_the_map(job):
    crop = job.plan.supply.density
    more = replace(job, grown=replace(crop, values=1.15 * crop.values))
    found = summarise_harvest(run_harvest(more), "more")
    assert found["finished"]
    assert found["audit_faults"] == 0
    assert found["grain_delivered"] == pytest.approx(1.15 * GRAIN, rel=0.01)
