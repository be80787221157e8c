"""Yield maps from files, against what was written into them."""

import json

import numpy as np
import pytest
import shapely

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.harvest.field.field import Field
from sightfield.systems.numerics.harvest.field.field_files import read_field
from sightfield.systems.numerics.harvest.field.yield_map import mean_density, read_yields

FIELD = Field.rectangle(80.0, 60.0)
GRID = "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 0\ncellsize 20\nNODATA_value -1\n"


def _collection(*pairs):
    features = [
        {"type": "Feature", "properties": told, "geometry": json.loads(shapely.to_geojson(shape))}
        for told, shape in pairs
    ]
    return json.dumps({"type": "FeatureCollection", "features": features})


def _written(tmp_path, text, suffix=".geojson"):
    path = tmp_path / f"yields{suffix}"
    path.write_text(text)
    return path


def test_the_last_polygon_counts_and_elsewhere_what_is_told(tmp_path):
    west, middle = shapely.box(0, 0, 30, 60), shapely.box(20, 10, 50, 50)
    path = _written(tmp_path, _collection(({"Yield": 9}, west), ({"Yield": 3.5}, middle)))
    found = read_yields(path, FIELD, 0.61)
    places = np.array([[5.0, 5.0], [25.0, 30.0], [25.0, 5.0], [70.0, 30.0]])
    assert found.at(places) == pytest.approx([0.9, 0.35, 0.9, 0.61])
    grain = 0.9 * (west.area - 10 * 40) + 0.35 * middle.area
    grain += 0.61 * (80 * 60 - shapely.union(west, middle).area)
    assert mean_density(found, FIELD.polygon) == pytest.approx(grain / (80 * 60), rel=0.01)


def test_bushels_of_a_grid_lie_where_its_head_says_from_north_to_south(tmp_path):
    path = _written(tmp_path, GRID + "60 80 -1\n90 70 50\n", ".asc")
    found = read_yields(path, FIELD, 0.5, unit="bu/ac wheat")
    # A bushel of wheat is 60 lb, an acre 4046.86 m^2.
    bushels = 60 * 0.45359237 / 4046.8564224
    places = np.array([[15.0, 30.0], [35.0, 30.0], [15.0, 5.0], [65.0, 5.0], [65.0, 30.0], [5, 5]])
    wanted = [60 * bushels, 80 * bushels, 90 * bushels, 50 * bushels, 0.5, 0.5]
    assert found.at(places) == pytest.approx(wanted)


def test_a_map_in_degrees_lies_on_a_field_in_degrees(tmp_path):
    ring = [(9.0, 48.0), (9.002, 48.0), (9.002, 48.001), (9.0, 48.001)]
    boundary = tmp_path / "field.wkt"
    boundary.write_text(shapely.Polygon(ring).wkt)
    field = read_field(boundary)
    east = shapely.box(9.001, 47.9, 9.1, 48.1)
    found = read_yields(_written(tmp_path, _collection(({"t": 7}, east))), field, 0.2, key="T")
    x = field.place.inwards(np.array([[9.001, 48.0005]]))[0, 0]
    assert found.at(np.array([[x - 3.0, 0.0], [x + 3.0, 0.0]])) == pytest.approx([0.2, 0.7])


def test_a_map_says_how_much_of_the_field_it_knows(tmp_path):
    east = shapely.box(60, 0, 900, 900)
    found = read_yields(_written(tmp_path, _collection(({"yield": 7}, east))), FIELD, 0.2)
    assert found.known == pytest.approx(0.25)
    whole = read_yields(_written(tmp_path, _collection(({"yield": 7}, FIELD.outline))), FIELD, 0.2)
    assert whole.known == 1.0


@pytest.mark.parametrize(
    ("head", "mark"), [("NODATA_value -1", "-1"), ("nodata_value nan", "NaN"), ("", "-9999")]
)
def test_cells_without_data_are_those_that_the_head_marks(tmp_path, head, mark):
    text = GRID.replace("NODATA_value -1", head) + f"8 {mark} 5 5 5 5"
    found = read_yields(_written(tmp_path, text, ".asc"), FIELD, 0.3)
    assert found.at(np.array([[15.0, 30.0], [35.0, 30.0]])) == pytest.approx([0.8, 0.3])
    assert found.known == pytest.approx(5 * 20 * 20 / (80 * 60))


BOX = shapely.box(0, 0, 30, 60)
REFUSED = {
    "no yield": (_collection(({"name": "a"}, BOX)), ".geojson", "`yield`"),
    "text": (_collection(({"yield": "much"}, BOX)), ".geojson", "a number"),
    "elsewhere": (_collection(({"yield": 5}, shapely.box(900, 0, 950, 60))), ".geojson", "field"),
    "negative": (_collection(({"yield": -5}, BOX)), ".geojson", "between 0"),
    "kilograms": (_collection(({"yield": 7800}, BOX)), ".geojson", "between 0"),
    "no features": (json.dumps({"type": "Point", "coordinates": [1, 2]}), ".geojson", "Feature"),
    "broken": ("{", ".geojson", "readable"),
    "short grid": (GRID + "1 2 3 4 5", ".asc", "numbers"),
    "not a number": (GRID + "1 2 3 4 nan 6", ".asc", "nan in row 2, column 2"),
    "endless": (GRID + "1 2 inf 4 5 6", ".asc", "numbers, or -1 where .* inf in row 1, column 3"),
    "a corner of the field": (
        _collection(({"yield": 5}, shapely.box(0, 0, 15, 15))),
        ".geojson",
        "at least 5% of the field; got 4.69% in",
    ),
    "no head": ("1 2 3", ".asc", "ncols"),
    "words": (GRID + "1 2 3 4 5 six", ".asc", "readable"),
    "other": ("", ".tif", "end in"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_other_files_are_refused_in_one_line(case, tmp_path):
    text, suffix, said = REFUSED[case]
    with pytest.raises(InvalidInput, match=said) as caught:
        read_yields(_written(tmp_path, text, suffix), FIELD, 0.5)
    assert "\n" not in str(caught.value)
