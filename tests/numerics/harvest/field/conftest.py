"""What every plan of a field has to obey, whatever the field."""

from collections.abc import Callable

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.harvest.field.combine_path import CombinePath
from sightfield.systems.numerics.harvest.field.coverage import CoveragePlan


def check_path_is_drivable(path: CombinePath, radius: float) -> None:
    """No jumps, no curvature beyond 1 / radius, and pieces that lead where the heading points."""
    chords = np.diff(path.points, axis=0)
    ways = np.hypot(*chords.T)
    np.testing.assert_allclose(np.diff(path.stations), ways, atol=1e-9)
    assert path.stations[0] == 0.0
    assert (ways > 0).all()
    turns = np.remainder(np.diff(path.headings) + np.pi, 2 * np.pi) - np.pi
    assert (np.abs(turns) <= ways / radius * 1.01 + 1e-9).all()
    courses = np.arctan2(chords[:, 1], chords[:, 0]) + np.where(path.gears > 0, 0.0, np.pi)
    off = np.remainder(courses - path.headings[:-1] - turns / 2 + np.pi, 2 * np.pi) - np.pi
    # An arc is given by chords of 1/16 rad at most, of which parts are off by half of that; and the
    # course of a piece is only as sure as it is long.
    assert (np.abs(off) < 0.04 + 1e-6 / ways).all()


def check_plan_holds(plan: CoveragePlan) -> None:
    """Drivable paths on the ground, areas that add up, and nobody where crop stands."""
    ground = plan.field.ground.buffer(0.1)
    shapely.prepare(ground)
    for path in plan.paths:
        check_path_is_drivable(path, plan.turning_radius)
        at = np.arange(0.0, path.length, 0.5)
        assert shapely.contains_xy(ground, path.pose_at(at)[:, :2]).all()
        assert (path.cut_area[path.gears < 0] == 0).all()
    cut = sum(float(path.cut_area.sum()) for path in plan.paths)
    cells = plan.cells
    assert cut == pytest.approx(plan.covered_area, rel=1e-12)
    assert cells.crop_area[cells.cut_by >= 0].sum() == pytest.approx(cut, rel=1e-9)
    assert plan.covered_area + plan.missed_area == pytest.approx(plan.field.area, rel=1e-12)
    # But for corners of cells that stray stalks are counted in, shorter in all than half a header.
    assert standing_crop_driven_over(plan) * cells.size <= plan.header_width / 2


def standing_crop_driven_over(plan: CoveragePlan) -> int:
    """In how many places a combine backs up over crop, by the plan's own clock.

    A cell counts as standing while its middle is before the header, so that one looks a cell's
    size behind.
    """
    cells = plan.cells
    bad = 0
    for n, path in enumerate(plan.paths):
        at = np.arange(0.0, path.length, cells.size)
        at = at[path.gear_at(at) < 0]
        x, y, theta = path.pose_at(at).T
        behind = np.stack([x, y], axis=1) - cells.size * np.stack([np.cos(theta), np.sin(theta)], 1)
        row, column, on = cells.cell_of(behind)
        by, when = cells.cut_by[row, column], cells.cut_at[row, column]
        clock = plan.timeline.clock_at(n, at)
        bad += int((on & cells.has_crop[row, column] & (by < 0)).sum())
        for m in range(len(plan.paths)):
            theirs = on & (by == m)
            reached = plan.timeline.station_at(m, clock[theirs])
            bad += int((reached < when[theirs] - cells.size).sum())
    return bad


@pytest.fixture(scope="session")
def check_plan() -> Callable[[CoveragePlan], None]:
    """Checks of one plan."""
    return check_plan_holds
