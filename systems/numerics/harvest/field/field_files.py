"""Fields from files: WKT, GeoJSON, Shapefile and ISO 11783 task data."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ...errors import InvalidInput, require, require_one_of
from ...geometry.world import world_from_polygon
from ...geometry.world_files import DEGREE_SPAN, WIDEST_SPAN
from ...units import area_text
from .field import MARGIN, Field
from .field_shapes import FieldShapes, NamedPolygon, read_geojson, read_shapefile, read_wkt
from .place import Place
from .taskdata import read_taskdata

_Shape = TypeVar("_Shape", bound=BaseGeometry)

READERS = {
    ".wkt": read_wkt,
    ".geojson": read_geojson,
    ".json": read_geojson,
    ".shp": read_shapefile,
    ".xml": read_taskdata,
}
# Room kept round obstacles that are points or lines [m].
OBSTACLE_RADIUS = 1.0
# What a no-go area leaves of a field that is smaller than this is none [m^2].
SLIVER = 100.0
# No coordinates of places on Earth are larger [m].
FARTHEST = 1e8
# A field in metres that is farther from the zero of its file gets a zero of its own [m].
FAR = 20_000.0


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
    try:
        place = _place(shapes.crops, coordinates)
    except InvalidInput as error:
        hint = "; or are they metres? Then coordinates has to be metres"
        raise InvalidInput(str(error) + (hint if "degree" in str(error) else "")) from None
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
    # Crop of other parts stands.
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
    """Where the metres of the field begin."""
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
        require(on_globe, "field file", "be within +-180, +-90 degrees", said)
        require(span <= WIDEST_SPAN, "field file", f"span at most {WIDEST_SPAN} degree", span)
        return Place(origin=(centre.x, centre.y))
    looks = f"metres, but the file spans only {span:.6f}, which looks like degrees"
    degrees = on_globe and span < DEGREE_SPAN
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
