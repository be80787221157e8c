"""Maps, timetables and pictures of a harvest with all that a field may have are as recorded."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from sightfield.diagrams.harvest import scenarios
from sightfield.diagrams.harvest.crop_layer import crop_patches, patch_meshes
from sightfield.diagrams.harvest.driver_map import draw_map
from sightfield.diagrams.harvest.job import prepare_harvest, travel_times
from sightfield.diagrams.harvest.pictures import clock, draw_timetable, save_coverage_picture
from sightfield.diagrams.harvest.scenario import FieldSource, HarvestScenario
from sightfield.diagrams.scenario_files import find_scenario, load_scenario
from sightfield.systems.numerics.errors import InvalidInput

FIELD = shapely.Polygon([(3, 1), (118, 4), (120, 86), (60, 90), (1, 88)]).difference(
    shapely.Point(70, 52).buffer(5.5, quad_segs=2)
)
SMALL = (
    "field.width=120",
    "field.height=90",
    "combines.header_width=9",
    "combines.turning_radius=6",
    "combines.capacity=2000",
    "carts.capacity=5000",
)


@pytest.fixture(scope="module")
def job():
    """Two combines and a cart on a rectangle."""
    return prepare_harvest(
        load_scenario(HarvestScenario, find_scenario("thesis_2", scenarios), SMALL)
    )


@pytest.fixture(scope="module")
def elsewhere(job, tmp_path_factory):
    """The same on a field with a pond, a strip that is shut and a gate."""
    folder = tmp_path_factory.mktemp("field")
    (folder / "field.wkt").write_text(FIELD.wkt, encoding="utf-8")
    (folder / "shut.wkt").write_text(shapely.box(40, 70, 52, 75).wkt, encoding="utf-8")
    source = FieldSource(
        file="field.wkt",
        coordinates="metres",
        no_go="shut.wkt",
        gates=((3.0, 1.0),),
        margin=14.0,
        origin=(6.1, 51.2),
    )
    return replace(job, field=source.load(folder))


def test_the_drivers_map_is_as_recorded(job, elsewhere, drawn, as_recorded):
    as_recorded(drawn(draw_map(job)), "rectangle", relative=1e-5)
    as_recorded(drawn(draw_map(elsewhere)), "pond", relative=1e-5)


def test_the_timetable_is_as_recorded(job, drawn, as_recorded):
    as_recorded(drawn(draw_timetable(job)), relative=1e-5)


def test_the_paths_are_drawn_as_recorded(job, drawn, as_recorded, saved_pictures, tmp_path):
    save_coverage_picture(tmp_path / "paths.png", job.plan.combines)
    as_recorded(drawn(saved_pictures["paths.png"]), relative=1e-5)


def test_what_is_reckoned_before_is_as_recorded(job, as_recorded):
    as_recorded(job.answer, "schedule", relative=1e-5)
    as_recorded([job.reach, job.trucks], "places")
    times = [travel_times(job.plan.combines, speed, 6.0) for speed in (1.8, 2.0, 5.0)]
    as_recorded(times, "travel", relative=1e-5)
    assert times[0].max() == job.plan.combines.makespan


def test_patches_of_crop_are_as_recorded(elsewhere, as_recorded):
    job = elsewhere
    patches, left = crop_patches(job.field, job.scenario.combines, job.plan.service.plans)
    meshes = [patch_meshes(each, 0.4, 0.2) for each in patches]
    told = {
        "who": [each.combine for each in patches],
        "ways": np.array([[each.begin, each.end, *each.pose] for each in patches]),
        "areas": np.array([each.shape.area for each in patches]),
        "crop": np.array([crop.area for crop, _ in meshes]),
        "rows": np.array([rows.area if rows else math.nan for _, rows in meshes]),
        "left": left.area,
    }
    as_recorded(told, relative=1e-4, absolute=1e-6)


@pytest.mark.parametrize("time", [0.4, 59.6, 3599.4, 3599.6, 7325.0, 36_061.0])
def test_a_clock_is_as_recorded(time, as_recorded):
    as_recorded(clock(time))


def test_fields_and_sides_are_allowed_up_to_their_limits():
    assert FieldSource(width=1e4, height=900.0, margin=0.0).load().area == pytest.approx(9e6)
    assert FieldSource(width=4e3, height=2.5e3, margin=0.0).load().area == pytest.approx(1e7)
    for width, height in ((10_001.0, 900.0), (4e3, 2501.0)):
        with pytest.raises(InvalidInput):
            FieldSource(width=width, height=height, margin=0.0).load()
