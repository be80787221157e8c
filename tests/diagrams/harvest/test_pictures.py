"""Figure 3.8: paths in the colours of their combines, over what each has cut."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from sightfield.diagrams.harvest.pictures import draw_coverage, save_coverage_picture
from sightfield.systems.numerics.harvest.carts.cut_times import CELL
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_combines


@pytest.fixture(scope="module")
def plan():
    combine = Combine(header_width=12.5, turning_radius=8.0)
    return plan_combines(Field.rectangle(200.0, 150.0), [combine] * 2)


@pytest.fixture(scope="module")
def axes(plan):
    axes = Figure().add_subplot()
    draw_coverage(axes, plan)
    return axes


def test_the_lines_are_as_long_as_the_paths(plan, axes):
    drawn = sum(
        np.hypot(*np.diff(line, axis=0).T).sum()
        for lines in axes.collections
        if isinstance(lines, LineCollection)
        for line in lines.get_segments()
    )
    assert drawn == pytest.approx(sum(timed.path.length for timed in plan.paths), rel=1e-3)


def test_the_field_shows_who_cut_what(plan, axes):
    (image,) = axes.get_images()
    shown = np.ma.filled(image.get_array(), -1)
    areas = [(shown == n + 1).sum() * CELL**2 for n in range(2)]
    assert sum(areas) == pytest.approx(200.0 * 150.0, rel=1e-3)
    assert min(areas) > 0.3 * sum(areas)


def test_the_picture_is_written(plan, tmp_path):
    save_coverage_picture(tmp_path / "paths.png", plan)
    assert (tmp_path / "paths.png").read_bytes().startswith(b"\x89PNG")
