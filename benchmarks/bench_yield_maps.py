"""Harvests by yield maps with trucks at a gate, as planned and as simulated.

On the thesis's field and on those whose files YIELD_FIELDS names, with two equal combines, and
with a slower and a quicker one.
"""

import os
from dataclasses import replace

import numpy as np
import pytest
import shapely

from sightfield.harvest import (
    Carts,
    Combines,
    FieldSource,
    HarvestScenario,
    OneCombine,
    Trucks,
    Yields,
    prepare_harvest,
    run_harvest,
    summarise_harvest,
)

FILES = os.environ.get("YIELD_FIELDS", "").split()
# Yields of each of so many squares are drawn from this range [t/ha].
SQUARES, RANGE = 6, (4.0, 12.0)


TEAMS = {
    "equal": (),
    "unequal": (
        OneCombine(speed=1.1, capacity=4500.0, unload_rate=80.0),
        OneCombine(speed=1.8, capacity=9000.0, unload_rate=140.0),
    ),
}


@pytest.mark.benchmarks
@pytest.mark.parametrize("team", TEAMS)
@pytest.mark.parametrize("file", ["", *FILES])
def test_as_planned_and_as_simulated(file, team, tmp_path):
    source = FieldSource(file=file) if file else FieldSource(width=400.0, height=275.0)
    field = source.load()
    gate = shapely.line_interpolate_point(field.outline.exterior, 0.6, normalized=True)
    ((x, y),) = field.place.outwards(shapely.get_coordinates(gate)).tolist()
    source = replace(source, gates=((x, y),))
    # The cells of an ASCII grid are square in the coordinates of the field's file.
    low, high = field.place.outwards(np.reshape(field.outline.bounds, (2, 2))).tolist()
    side = max(high[0] - low[0], high[1] - low[1]) / SQUARES
    drawn = np.random.default_rng(4).uniform(*RANGE, (SQUARES, SQUARES)).round(2)
    head = f"ncols {SQUARES}\nnrows {SQUARES}\nxllcorner {low[0]!r}\nyllcorner {low[1]!r}\n"
    rows = "\n".join(" ".join(map(str, row)) for row in drawn.tolist())
    grid = tmp_path / "yields.asc"
    grid.write_text(f"{head}cellsize {side!r}\n{rows}\n")
    scenario = HarvestScenario(
        field=source,
        yields=Yields(file=str(grid)),
        combines=Combines(
            count=2, header_width=9.0, turning_radius=6.0, capacity=6000.0, each=TEAMS[team]
        ),
        carts=Carts(count=2, capacity=12_000.0),
        trucks=Trucks(count=2, capacity=25_000.0, road_time=900.0),
    )
    found = summarise_harvest(run_harvest(prepare_harvest(scenario)), file or "thesis")
    assert found["finished"]
    assert found["audit_faults"] == 0
    names = ("field_area", "makespan", "makespan_planned", "load_deviation", "unloads_missed")
    print("\n", file or "thesis", team, {name: found[name] for name in names})
