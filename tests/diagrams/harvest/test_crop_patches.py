"""Patches of crop: all of the field, once each, where and when the plan cuts it."""

import numpy as np
import pytest
import shapely

from sightfield.diagrams.harvest.scene.crop_patches import crop_patches
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.harvest.field.coverage import plan_coverage
from sightfield.systems.numerics.harvest.field.field import Field

BENT = [(0, 0), (160, -20), (190, 60), (110, 70), (90, 130), (10, 110)]


@pytest.fixture(scope="module", params=["rectangle", "bent"])
def plan(request):
    field = Field.rectangle(140, 90) if request.param == "rectangle" else Field(make_world(BENT))
    return plan_coverage(field, 10.0, 6.0, 2)


def test_patches_and_what_is_left_make_up_the_field(plan):
    patches, left = crop_patches(plan)
    shapes = [patch.shape for patch in patches]
    assert sum(shape.area for shape in shapes) == pytest.approx(
        shapely.union_all(shapes).area, rel=1e-3
    )
    assert sum(shape.area for shape in shapes) + left.area == pytest.approx(
        plan.field.area, rel=5e-3
    )
    assert left.area <= plan.missed_area + 5e-3 * plan.field.area


def test_a_patch_lies_on_its_combines_way(plan):
    for patch in crop_patches(plan)[0]:
        path = plan.paths[patch.combine]
        way = path.pose_at(np.linspace(patch.begin, patch.end, 40))[:, :2]
        reach = plan.header_width / 2 + 0.3
        assert shapely.LineString(way).buffer(reach).contains(patch.shape)
        np.testing.assert_allclose(way[-1], patch.pose[:2], atol=1e-6)


def test_patches_are_few(plan):
    # Four sides for each of the rings, with some for the corners.
    assert len(crop_patches(plan)[0]) < 8 * len(plan.rings) + 30
