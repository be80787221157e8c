"""Fields from files: WKT, GeoJSON, Shapefile and task data of farm machines (ISO 11783-10)."""

import json
import re
import struct
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar
from xml.etree.ElementTree import Element, ParseError

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...errors import InvalidInput, require, require_one_of
from ...geometry.world import world_from_polygon
from ...geometry.world_files import WIDEST_SPAN, polygons_of, read_geometry
from ...units import area_text
from .field import MARGIN, Field, Place

# Values of the property `kind` of a feature; all others are a field's.
NO_GO, GATE, TRUCK = "no-go", "gate", "truck"

TASKDATA_FILE = "TASKDATA.XML"
# Larger files are no task data of fields [bytes].
LARGEST = 50_000_000

# Types of PLN, LSG and PNT (ISO 11783-10, annex D).
BOUNDARY, WATER, BUILDING, ROAD, OBSTACLE, WINDBREAK = "1", "3", "4", "5", "6", "12"
EXTERIOR, INTERIOR, GUIDANCE, FENCE, OBSTACLE_LINE = "1", "2", "5", "7", "9"
ACCESS, STORAGE, OBSTACLE_POINT = "3", "4", "5"
# Boundaries of these are not driven over.
NO_GO_AREAS = (WATER, BUILDING, ROAD, OBSTACLE, WINDBREAK)

_EXTERNAL = re.compile(r"PFD\d{5}")

_Shape = TypeVar("_Shape", bound=BaseGeometry)

# Room kept round obstacles that are points or lines [m].
OBSTACLE_RADIUS = 1.0
# Parts of a field that no-go areas leave are dropped if they are smaller than this [m^2].
SLIVER = 100.0
# No coordinates of places on Earth are larger [m].
FARTHEST = 1e8
# A field in metres that is farther from the origin of its file gets an origin of its own [m].
FAR = 20_000.0


class NamedPolygon(NamedTuple):
    """A polygon of crop and what its field is called.

    Attributes:
        polygon: In the coordinates of its file.
        name: Name of its field, or empty.
    """

    polygon: shapely.Polygon
    name: str


class FieldShapes(NamedTuple):
    """All that a file says of fields.

    Attributes:
        crops: Polygons of fields, and of whatever lies in them.
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
    # Features without a geometry lie nowhere.
    located = [each for each in about["features"] or () if each.get("geometry")]
    return sort_shapes(
        [
            (*_told(feature.get("properties")), geometry)
            for feature, geometry in zip(located, whole.geoms, strict=True)
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
        # What pyshp warns of, for instance a length other than the file's, counts as damage.
        with warnings.catch_warnings(action="error"), shapefile.Reader(str(path)) as reader:
            found = [
                (
                    *_told(each.record.as_dict() if each.record is not None else None),
                    shapely.force_2d(shapely.geometry.shape(each.shape.__geo_interface__)),
                )
                for each in _with_records(reader, path)
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


def _with_records(reader: Any, path: Path) -> Iterator[Any]:
    """Shapes with their records, or, without a .dbf file, by themselves."""
    if any(path.with_suffix(suffix).exists() for suffix in (".dbf", ".DBF")):
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
    """Sort geometries by their kinds.

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


def read_taskdata(path: Path) -> FieldShapes:
    """Partfields with their boundaries, obstacles, accesses (gates) and storages (truck places).

    Entities are not expanded, and no document type is allowed.

    Args:
        path: The file, or the folder that holds it.

    Raises:
        InvalidInput: The file is malformed, or holds no partfield with a boundary.
    """
    if path.is_dir():
        path = next(
            (each for each in path.iterdir() if each.name.upper() == TASKDATA_FILE),
            path / TASKDATA_FILE,
        )
    root = _parse(path)
    require(
        root.tag == "ISO11783_TaskData", "world file", "be ISO 11783 task data", f"<{root.tag}>"
    )
    fields = list(root.iter("PFD"))
    for reference in root.iter("XFR"):
        name = reference.get("A", "")
        if _EXTERNAL.fullmatch(name):
            fields += list(_parse(path.parent / f"{name}.XML").iter("PFD"))
    shapes = FieldShapes([], [], [], [], geographic=True)
    for field in fields:
        _add(shapes, field)
    require(len(shapes.crops) > 0, "world file", "hold a partfield with a boundary", path)
    return shapes


def _parse(path: Path) -> Element:
    # They are needed for task data only.
    from defusedxml import DefusedXmlException
    from defusedxml.ElementTree import parse

    require(path.is_file(), "world file", "exist", path)
    try:
        size = path.stat().st_size
        require(size <= LARGEST, "world file", f"have at most {LARGEST} bytes", size)
        root: Any = parse(path, forbid_dtd=True).getroot()
    except InvalidInput:
        raise
    except (ParseError, DefusedXmlException, OSError, ValueError, LookupError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InvalidInput(f"`world file` must be readable XML; got {path} ({reason})") from None
    return root


def _add(shapes: FieldShapes, field: Element) -> None:
    name = field.get("C", "") or field.get("A", "")
    for polygon in field.findall("PLN"):
        kind = polygon.get("A", "")
        if kind == BOUNDARY:
            shapes.crops.extend(NamedPolygon(each, name) for each in _polygons(polygon, name))
        elif kind in NO_GO_AREAS:
            shapes.no_go.extend(_polygons(polygon, name))
    for line in field.findall("LSG"):
        if line.get("A") in (FENCE, OBSTACLE_LINE):
            points = _points(line, name)
            require(len(points) > 1, "world file", f"have lines of two points in {name}", line.tag)
            shapes.no_go.append(shapely.LineString(points))
    for point in field.findall("PNT"):
        kinds = {ACCESS: shapes.gates, STORAGE: shapes.trucks, OBSTACLE_POINT: shapes.no_go}
        kind = point.get("A", "")
        if kind in kinds:
            kinds[kind].append(shapely.Point(_point(point, name)))


def _polygons(element: Element, name: str) -> list[shapely.Polygon]:
    """Polygons of a PLN: interiors belong to the exterior that they lie in."""
    rings = [(line.get("A"), _points(line, name)) for line in element.findall("LSG")]
    for kind, points in rings:
        known = kind in (EXTERIOR, INTERIOR)
        require(known, "world file", f"have exteriors and interiors only in {name}", kind)
        enough = len(np.unique(points, axis=0)) >= 3
        require(enough, "world file", f"have rings of three points in {name}", len(points))
    outer = [shapely.Polygon(points) for kind, points in rings if kind == EXTERIOR]
    inner = [shapely.Polygon(points) for kind, points in rings if kind == INTERIOR]
    require(len(outer) > 0, "world file", f"have an exterior in {name}", "none")
    for ring in (*outer, *inner):
        valid = "rings that do not cross themselves"
        require(
            ring.is_valid, "world file", f"have {valid} in {name}", shapely.is_valid_reason(ring)
        )
    made = [each.difference(shapely.union_all(inner)) for each in outer]
    return [
        part
        for each in made
        for part in shapely.get_parts(each)
        if isinstance(part, shapely.Polygon) and not part.is_empty
    ]


def _points(line: Element, name: str) -> np.ndarray:
    return np.array([_point(each, name) for each in line.findall("PNT")]).reshape(-1, 2)


def _point(point: Element, name: str) -> tuple[float, float]:
    """Longitude and latitude."""
    found = []
    for key, most in (("D", 180.0), ("C", 90.0)):
        text = point.get(key, "")
        try:
            value = float(text)
        except ValueError:
            value = np.nan
        what = f"have degrees within +-{most:g} in {name}"
        require(abs(value) <= most, "world file", what, f'{key}="{text[:40]}"')
        found.append(value)
    return found[0], found[1]


READERS = {
    ".wkt": read_wkt,
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".shp": read_shapefile,
    ".xml": read_taskdata,
}


def read_field(
    path: str | Path,
    *,
    coordinates: str = "wgs84",
    margin: float = MARGIN,
    part: int = 0,
    no_go: str | Path = "",
    gates: Sequence[tuple[float, float]] = (),
    trucks: Sequence[tuple[float, float]] = (),
) -> Field:
    """Read a field's boundary; its interior rings are obstacles, and so are polygons in it.

    In GeoJSON and in Shapefiles a feature's property `kind` may be `no-go`, `gate` or `truck`; in
    task data boundaries, obstacles, accesses and storages are told apart by their types. Heights
    are dropped.

    Args:
        path: A .wkt, .geojson, .json, .shp or .xml file, or a folder with a TASKDATA.XML.
        coordinates: "wgs84": longitude and latitude in degrees, projected to metres east and
            north of the largest boundary's centroid; "metres": taken as they are.
        margin: Width of the strip outside of the boundary that may be driven on [m].
        part: Which one of several parts, from 1; 0: the only one.
        no_go: Another file with polygons that nothing drives on, cut out of the field; or empty.
        gates, trucks: Places besides those in the file, in the coordinates of the file.

    Raises:
        InvalidInput: The file is missing or malformed, or holds no valid region, or several of
            which none is chosen.
    """
    require_one_of("coordinates", coordinates, ("metres", "wgs84"))
    require(part >= 0, "part", "be 0 or the number of a part", part)
    shapes = _read(Path(path), "field file")
    if shapes.geographic is not None:
        said = "wgs84" if shapes.geographic else "metres"
        require(coordinates == said, "coordinates", f"be {said} for {Path(path).name}", coordinates)
    require(len(shapes.crops) > 0, "field file", "hold a polygon", f"none in {path}")
    place = _place(shapes.crops, coordinates)
    closed = [*shapes.no_go]
    if no_go:
        layer = _read(Path(no_go), "no_go")
        closed += [*layer.no_go, *(each.polygon for each in layer.crops)]
    every = [NamedPolygon(_inwards(each.polygon, place), each.name) for each in shapes.crops]
    forbidden = [_widened(_inwards(each, place)) for each in closed]
    parts = _parts(every, forbidden)
    number = _choice(parts, part)
    chosen = parts[number]
    world = world_from_polygon(chosen.polygon)
    # The crop of other parts stands, so nothing drives on it.
    forbidden += [each.polygon for each in parts[:number] + parts[number + 1 :]]
    outside = shapely.union_all(forbidden).difference(shapely.Polygon(world.boundary))
    near = outside.intersection(shapely.Polygon(world.boundary).buffer(2 * margin + SLIVER**0.5))
    return replace(
        Field(world, margin),
        no_go=tuple(
            each
            for each in shapely.get_parts(near)
            if isinstance(each, shapely.Polygon) and each.area > 0
        ),
        gates=_places(shapes.gates, gates, place),
        trucks=_places(shapes.trucks, trucks, place),
        place=place,
        name=chosen.name,
    )


def _read(path: Path, called: str) -> FieldShapes:
    suffix = ".xml" if path.is_dir() else path.suffix.lower()
    require(suffix in READERS, called, f"end in {', '.join(READERS)}", path.name)
    require(path.exists(), called, "exist", path)
    try:
        return READERS[suffix](path)
    except InvalidInput as error:
        raise InvalidInput(str(error).replace("`world file`", f"`{called}`")) from None


def _place(crops: Sequence[NamedPolygon], coordinates: str) -> Place:
    """Where the origin of the field's coordinates in metres lies."""
    polygons = [each.polygon for each in crops]
    largest = max((shapely.Polygon(each.exterior) for each in polygons), key=lambda each: each.area)
    x_low, y_low, x_high, y_high = bounds = shapely.total_bounds(polygons).tolist()
    fits = bool((np.abs(bounds) < FARTHEST).all())
    require(fits, "field file", f"hold coordinates within +-{FARTHEST:g}", bounds)
    on_globe = x_low >= -180 and x_high <= 180 and y_low >= -90 and y_high <= 90
    span = max(x_high - x_low, y_high - y_low)
    centre = largest.centroid
    if coordinates == "wgs84":
        said = f"bounds {np.round(bounds, 6).tolist()}"
        hint = "; or are they metres? Then coordinates has to be metres"
        require(on_globe, "field file", "be within +-180, +-90 degrees", f"{said}{hint}")
        narrow = f"span at most {WIDEST_SPAN} degree"
        require(span <= WIDEST_SPAN, "field file", narrow, f"{span}{hint}")
        return Place(origin=(centre.x, centre.y))
    looks = f"metres, but the file spans only {span:.6f}, which looks like degrees"
    degrees = on_globe and span < WIDEST_SPAN
    require(not degrees, "coordinates", "be wgs84 for longitudes and latitudes", looks)
    far = max(abs(each) for each in bounds) > FAR
    return Place(offset=(round(centre.x), round(centre.y)) if far else (0.0, 0.0))


def _inwards(shape: _Shape, place: Place) -> _Shape:
    return shapely.transform(shape, place.inwards)


def _widened(shape: BaseGeometry) -> BaseGeometry:
    """Polygons as they are, lines and points with some room round them."""
    return shape if shape.area > 0 else shape.buffer(OBSTACLE_RADIUS)


def _places(
    found: Sequence[shapely.Point], told: Sequence[tuple[float, float]], place: Place
) -> np.ndarray:
    every = [*((each.x, each.y) for each in found), *told]
    return place.inwards(np.array(every, dtype=float).reshape(-1, 2))


def _parts(crops: list[NamedPolygon], no_go: list[BaseGeometry]) -> list[NamedPolygon]:
    """Parts of the field, each without the polygons that lie in it and without no-go areas."""
    order = sorted(crops, key=lambda each: -shapely.Polygon(each.polygon.exterior).area)
    outer: list[tuple[NamedPolygon, list[BaseGeometry]]] = []
    for each in order:
        filled = shapely.Polygon(each.polygon.exterior)
        for whole, inside in outer:
            around = shapely.Polygon(whole.polygon.exterior)
            if around.covers(filled):
                inside.append(filled)
                break
            common = around.intersection(filled).area
            require(
                common <= 1e-9 * filled.area + 1e-6,
                "field file",
                "have parts that do not overlap, or lie in one another",
                f"two that have {area_text(common)} in common",
            )
        else:
            outer.append((each, []))
    numbers = {id(each.polygon): k for k, each in enumerate(crops)}
    outer.sort(key=lambda pair: numbers[id(pair[0].polygon)])
    made = [
        NamedPolygon(part, whole.name)
        for whole, inside in outer
        for part in _less(whole.polygon, [*inside, *no_go])
    ]
    require(len(made) > 0, "no_go", "leave something of the field", "nothing")
    return made


def _less(polygon: shapely.Polygon, closed: Sequence[BaseGeometry]) -> list[shapely.Polygon]:
    if not closed:
        return [polygon]
    left = polygon.difference(shapely.union_all(list(closed)))
    return [
        each
        for each in shapely.get_parts(left)
        if isinstance(each, shapely.Polygon) and each.area > SLIVER
    ]


def _choice(parts: Sequence[NamedPolygon], part: int) -> int:
    listed = ", ".join(
        f"{k + 1}: {each.name + ' ' if each.name else ''}{area_text(each.polygon.area)}"
        for k, each in enumerate(parts[:12])
    )
    fits = part <= len(parts) and (part > 0 or len(parts) == 1)
    require(fits, "part", f"be one of {len(parts)} parts of the field ({listed})", part)
    return max(part - 1, 0)
