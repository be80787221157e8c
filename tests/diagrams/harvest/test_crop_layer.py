"""Patches of crop: all of the field, once each, where and when the plan cuts it."""

import numpy as np
import pytest
import shapely

from sightfield.diagrams.harvest.crop_layer import (
    CropPatch,
    crop_patches,
    patch_meshes,
    seen_back,
)
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


def test_a_patch_that_touches_itself_when_it_is_turned_is_drawn():
    """A swath of a drawn field and a triangle of 5 cm beside it: the replay was a traceback."""
    triangle = [
        (-143.036842056982, -67.59800998595671),
        (-142.12846666961275, -68.01616564551631),
        (-142.14860161335397, -68.05990554692015),
    ]
    swath = [
        (-143.94521744435127, -67.1798543263971),
        (-147.7086183803877, -75.35523281272057),
        (-244.49567394363228, -30.800904702740088),
        (-236.70890126084427, -24.47761918349797),
        (-143.2328468498016, -67.50778240542341),
    ]
    shape = shapely.MultiPolygon([shapely.Polygon(triangle), shapely.Polygon(swath)])
    edge = shapely.MultiLineString([swath[:2], swath[3:]])
    pinched = 0
    for theta in np.linspace(0.0, 6.2, 120):
        patch = CropPatch(5, 317.5, 426.3, np.array([-243.7, -26.2, theta]), shape, edge)
        pinched += not shapely.is_valid(seen_back(patch, shape))
        crop, rows = patch_meshes(patch, 2.0, 0.6)
        assert crop.area > shape.area / (patch.end - patch.begin)
        assert rows is not None
    assert pinched > 0
