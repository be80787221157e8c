"""The thesis's studies: their cells, and how they are shown and compared."""

import numpy as np
import pyarrow as pa
import pytest

from sightfield.diagrams.studies.assignment_study import assignment_grid, assignment_study
from sightfield.diagrams.studies.pictures import draw_curves, draw_means
from sightfield.diagrams.studies.records import SCHEMA, StudyResult
from sightfield.diagrams.studies.summary import summarise
from sightfield.diagrams.studies.tracking_study import tracking_grid, tracking_study

STUDIES = {"tracking": (tracking_study, tracking_grid)}
STUDIES["assignment"] = (assignment_study, assignment_grid)


@pytest.mark.parametrize("name", STUDIES)
def test_every_cell_is_drawn_once_in_each_picture(name):
    make, grid_of = STUDIES[name]
    study = make(runs=1)
    grid = grid_of(study)
    cells = sorted(cell.name for cell in study.cells)
    for panels in (grid.means, grid.curves):
        shown = [cell for p in panels for some in p.series.values() for cell in some.values()]
        assert sorted(shown) == cells
    assert {cell for pair in grid.pairs for cell in pair} == set(cells)
    assert len(set(map(frozenset, grid.pairs))) == len(grid.pairs)


@pytest.mark.parametrize("name", STUDIES)
def test_only_one_thing_differs_between_cells_that_are_compared(name):
    make, grid_of = STUDIES[name]
    study = make(runs=1)
    for first, second in grid_of(study).pairs:
        settings = zip(study.cell(first).settings, study.cell(second).settings, strict=True)
        assert sum(one != other for one, other in settings) == 1


def test_t1_t2_and_t3_are_the_times_with_the_three_risk_vectors():
    titles = [panel.title for panel in tracking_grid(tracking_study(runs=1)).means]
    vectors = ("uniform", "majority", "proportional")
    expected = [f"t{k}: {vector} risk vector" for k, vector in enumerate(vectors, start=1)]
    assert titles == expected


def made_up(study, times_of):
    """A result in which the times are a function of cell and run, with a horizon of 120 s."""
    rows = [
        {
            "cell": cell.name,
            "run": run,
            "seed": run,
            "pursuers": int(cell.name[0]),
            "evaders": int(cell.name[2]),
            "horizon": 120.0,
            "time": min(times_of(cell.name, run), 120.0),
            "censored": times_of(cell.name, run) >= 120.0,
            "lost_evader": -1,
        }
        for cell in study.cells
        for run in range(study.runs)
    ]
    return StudyResult(study, pa.Table.from_pylist(rows, schema=SCHEMA))


def test_a_strategy_that_is_better_in_every_run_is_found_to_be_so():
    study = assignment_study(runs=12, sizes=(2, 3))
    spread = np.random.default_rng(0).uniform(20.0, 80.0, 12)
    gains = {"borda_min": 10.0, "borda_max": 0.0, "random_visible": 0.0, "own_riskiest": -10.0}
    wobble = np.random.default_rng(1).normal(0.0, 1.0, (12, 8))
    names = [cell.name for cell in study.cells]
    result = made_up(
        study,
        lambda cell, run: spread[run] + gains[cell[4:]] + wobble[run, names.index(cell)],
    )
    grid = assignment_grid(study)
    found = {
        (each["first"], each["second"]): each for each in summarise(result, grid)["comparisons"]
    }
    assert len(found) == 8
    better = found["3v2-borda_min", "3v2-own_riskiest"]
    assert better["low"] < 20.0 < better["high"]
    assert better["holm_p"] < 1e-6
    assert found["3v2-borda_max", "3v2-random_visible"]["holm_p"] > 0.05


def test_pictures_show_what_is_there():
    study = tracking_study(runs=5, sizes=(1, 2))
    result = made_up(study, lambda cell, run: 30.0 * (run + 1))
    grid = tracking_grid(study)
    means, curves = draw_means(result, grid), draw_curves(result, grid)
    assert [axis.get_title() for axis in means.axes] == [panel.title for panel in grid.means]
    for axis in means.axes:
        for container in axis.containers:
            # 30, 60, 90, 120 and 150 s, the last one cut off.
            np.testing.assert_allclose(container.lines[0].get_ydata(), 84.0)
    for axis in curves.axes:
        for line in axis.get_lines():
            assert line.get_ydata()[0] == 1.0
            assert line.get_ydata()[-1] == pytest.approx(0.4)
            assert line.get_xdata()[-1] == 120.0
