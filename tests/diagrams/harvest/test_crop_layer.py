"""Patches of crop: all of the field, once each, where and when the plan cuts it."""

import numpy as np
import pytest
import shapely

from sightfield.diagrams.harvest.crop_layer import crop_patches
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.machines import Combine
from sightfield.systems.numerics.harvest.plan.harvest_plan import plan_combines

BENT = [(0, 0), (160, -20), (190, 60), (110, 70), (90, 130), (10, 110)]
COMBINE = Combine(header_width=10.0)


@pytest.fixture(scope="module", params=["rectangle", "bent"])
def plan(request):
    field = Field.rectangle(140, 90) if request.param == "rectangle" else Field(make_world(BENT))
    return plan_combines(field, [COMBINE] * 2)


@pytest.fixture(scope="module")
def patched(plan):
    return crop_patches(plan.field, COMBINE, plan.paths)


def test_patches_and_what_is_left_make_up_the_field(plan, patched):
    patches, left = patched
    shapes = [patch.shape for patch in patches]
    area = sum(shape.area for shape in shapes)
    assert area == pytest.approx(shapely.union_all(shapes).area, rel=1e-3)
    assert area + left.area == pytest.approx(plan.field.area, rel=5e-3)
    missed = plan.coverage.area - plan.coverage.covered_area
    assert left.area <= missed + 5e-3 * plan.field.area


def test_a_patch_lies_on_its_combines_way(plan, patched):
    for patch in patched[0]:
        path = plan.paths[patch.combine].path
        way = path.pose_at(np.linspace(patch.begin, patch.end, 40))[:, :2]
        reach = np.hypot(COMBINE.header_width, COMBINE.header_depth) / 2 + 0.3
        assert shapely.LineString(way).buffer(reach).contains(patch.shape)
        np.testing.assert_allclose(way[-1], patch.pose[:2], atol=1e-6)


def test_patches_are_few(plan, patched):
    # A swath is one; arcs of rounds have some for their corners.
    works = [len(np.unique(path.work[path.cutting])) for path in plan.coverage.paths]
    assert len(patched[0]) < 2 * sum(works) + 30
