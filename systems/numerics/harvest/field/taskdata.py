"""Fields in the task data of farm machines: TASKDATA.XML of ISO 11783-10."""

import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

import numpy as np
import shapely

from ...errors import InvalidInput, require
from .field_shapes import FieldShapes, NamedPolygon

NAME = "TASKDATA.XML"
# Larger files are no task data of fields [bytes].
LARGEST = 50_000_000

# Types of PLN, LSG and PNT (ISO 11783-10, annex D).
BOUNDARY, WATER, BUILDING, ROAD, OBSTACLE, WINDBREAK = "1", "3", "4", "5", "6", "12"
EXTERIOR, INTERIOR, GUIDANCE, FENCE, OBSTACLE_LINE = "1", "2", "5", "7", "9"
ACCESS, STORAGE, OBSTACLE_POINT = "3", "4", "5"
# Boundaries of these are not driven over.
NO_GO = (WATER, BUILDING, ROAD, OBSTACLE, WINDBREAK)

_EXTERNAL = re.compile(r"PFD\d{5}")


def read_taskdata(path: Path) -> FieldShapes:
    """Partfields with their boundaries, obstacles, accesses (gates) and storages (truck places).

    Entities are not expanded, and no document type is allowed.

    Args:
        path: The file, or the folder that holds it.

    Raises:
        InvalidInput: The file is malformed, or holds no partfield with a boundary.
    """
    if path.is_dir():
        path = next((each for each in path.iterdir() if each.name.upper() == NAME), path / NAME)
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
        elif kind in NO_GO:
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
