"""What a file says of fields, in the coordinates of the file: WKT, GeoJSON and Shapefile."""

import json
import struct
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import shapely
from shapely.geometry.base import BaseGeometry

from ...errors import InvalidInput, require
from ...geometry.world_files import polygons_of, read_geometry

# Values of the property `kind` of a feature; all others are a field's.
NO_GO, GATE, TRUCK = "no-go", "gate", "truck"


class NamedPolygon(NamedTuple):
    """A polygon of crop and what its field is called.

    Attributes:
        polygon: In the coordinates of its file.
        name: Or empty.
    """

    polygon: shapely.Polygon
    name: str


class FieldShapes(NamedTuple):
    """All that a file says of fields.

    Attributes:
        crops: Of fields and of whatever is in them.
        no_go: Polygons, lines and points that nothing drives on.
        gates: Where fields are entered.
        trucks: Where trucks may stand.
        geographic: Whether coordinates are longitude and latitude; None: the file does not say.
    """

    crops: list[NamedPolygon]
    no_go: list[BaseGeometry]
    gates: list[shapely.Point]
    trucks: list[shapely.Point]
    geographic: bool | None = None


def read_wkt(path: Path) -> FieldShapes:
    """Polygons of a WKT file.

    Raises:
        InvalidInput: The file is malformed, or holds something else.
    """
    return sort_shapes([("", "", read_geometry(path, "wkt"))])


def read_geojson(path: Path) -> FieldShapes:
    """Features of a GeoJSON file, told apart by their property `kind`.

    Raises:
        InvalidInput: The file is malformed, or holds something else.
    """
    whole = read_geometry(path, "geojson")
    about = json.loads(path.read_text(encoding="utf-8-sig"))
    if about.get("type") != "FeatureCollection":
        return sort_shapes([("", "", whole)])
    assert isinstance(whole, shapely.GeometryCollection)
    if len(whole.geoms) != len(about["features"]):
        # Features without a geometry are none.
        about["features"] = [each for each in about["features"] if each.get("geometry")]
    return sort_shapes(
        [
            (*_told(feature.get("properties")), geometry)
            for feature, geometry in zip(about["features"], whole.geoms, strict=True)
        ]
    )


def read_shapefile(path: Path) -> FieldShapes:
    """Polygons and points of a Shapefile, told apart by their attribute `kind`.

    Raises:
        InvalidInput: The file is malformed, or holds something else.
    """
    # It is needed for Shapefiles only.
    import shapefile

    require(path.is_file(), "world file", "exist", path)
    projection = path.with_suffix(".prj")
    geographic = None
    try:
        if projection.is_file():
            text = projection.read_text(encoding="latin-1").lstrip().upper()
            geographic = text.startswith(("GEOGCS", "GEOGCRS"))
        # What pyshp warns of, a length that is not the file's for instance, is damage.
        with warnings.catch_warnings(action="error"), shapefile.Reader(str(path)) as reader:
            found = [
                (
                    *_told(each.record.as_dict() if each.record is not None else None),
                    shapely.force_2d(shapely.geometry.shape(each.shape.__geo_interface__)),
                )
                for each in _with_records(reader)
                if each.shape.shapeType != shapefile.NULL
            ]
    except (
        OSError,
        ValueError,
        KeyError,
        IndexError,
        AttributeError,
        TypeError,
        MemoryError,
        struct.error,
        Warning,
        shapefile.ShapefileException,
        shapely.errors.ShapelyError,
    ) as error:
        reason = " ".join(str(error).split())[:200]
        raise InvalidInput(
            f"`world file` must be a readable Shapefile; got {path} ({reason})"
        ) from None
    require(len(found) > 0, "world file", "hold a polygon", f"nothing in {path}")
    return sort_shapes(found)._replace(geographic=geographic)


def _with_records(reader: Any) -> Iterator[Any]:
    """Shapes with their records, or, without a .dbf file, by themselves."""
    if reader.dbf is not None:
        yield from reader.iterShapeRecords()
        return
    for shape in reader.iterShapes():
        yield _Bare(shape)


class _Bare(NamedTuple):
    shape: Any
    record: None = None


def _told(properties: object) -> tuple[str, str]:
    """Kind and name in the properties of a feature."""
    if not isinstance(properties, dict):
        return "", ""
    plain = {str(key).lower(): value for key, value in properties.items()}
    kind, name = plain.get("kind"), plain.get("name")
    return (
        kind.strip().lower() if isinstance(kind, str) else "",
        name.strip() if isinstance(name, str) else "",
    )


def sort_shapes(found: list[tuple[str, str, BaseGeometry]]) -> FieldShapes:
    """Geometries by what they are.

    Args:
        found: Kind, name and geometry of each.

    Raises:
        InvalidInput: Fields are no valid polygons, or gates and trucks no points.
    """
    shapes = FieldShapes([], [], [], [])
    for kind, name, geometry in found:
        if kind in (GATE, TRUCK):
            is_point = isinstance(geometry, shapely.Point) and not geometry.is_empty
            require(is_point, "world file", f"have points as a {kind}", geometry.geom_type)
            assert isinstance(geometry, shapely.Point)
            (shapes.gates if kind == GATE else shapes.trucks).append(geometry)
        elif kind == NO_GO:
            require(geometry.is_valid, "world file", "hold valid polygons", "an invalid no-go area")
            shapes.no_go.append(geometry)
        else:
            shapes.crops.extend(NamedPolygon(each, name) for each in polygons_of(geometry))
    return shapes
