"""Figure 3.8: paths in the colours of their combines, over what each has cut."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from sightfield.diagrams.harvest.pictures.coverage_picture import (
    draw_coverage,
    save_coverage_picture,
)
from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field


@pytest.fixture(scope="module")
def plan():
    return plan_coverage(Field.rectangle(400.0, 275.0), 25.0, 10.0, 2)


def test_the_lines_are_as_long_as_the_paths(plan):
    axes = Figure().add_subplot()
    draw_coverage(axes, plan)
    drawn = sum(
        np.hypot(*np.diff(line, axis=0).T).sum()
        for lines in axes.collections
        if isinstance(lines, LineCollection)
        for line in lines.get_segments()
    )
    assert drawn == pytest.approx(sum(path.length for path in plan.paths))


def test_the_field_shows_who_cut_what(plan):
    axes = Figure().add_subplot()
    draw_coverage(axes, plan)
    (image,) = axes.get_images()
    shown = np.ma.filled(image.get_array(), -1)
    assert (shown == plan.cells.cut_by + 1).all()


def test_the_picture_is_written(plan, tmp_path):
    save_coverage_picture(tmp_path / "paths.png", plan)
    assert (tmp_path / "paths.png").read_bytes().startswith(b"\x89PNG")
