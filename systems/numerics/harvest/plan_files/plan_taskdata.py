"""A plan as task data of farm machines: ISO 11783-10, version 4, with guidance lines."""

from dataclasses import replace
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import shapely

from ..field.field import Field
from ..field.place import Place
from ..field.taskdata import (
    ACCESS,
    BOUNDARY,
    EXTERIOR,
    GUIDANCE,
    INTERIOR,
    OBSTACLE,
    STORAGE,
)
from ..plan.harvest_plan import HarvestPlan
from .plan_lines import Swath, swaths_of

# Longest designator (ISO 11783-10, annex D).
LONGEST_NAME = 32
# Types of guidance patterns, and of their points.
AB, CURVE = "1", "3"
POINT_A, POINT_B, POINT_BETWEEN, POINT_OTHER = "6", "7", "9", "2"
# A pattern is one swath: nothing is copied to its sides, and nothing is driven beyond its ends.
NO_PROPAGATION, NO_EXTENSION = "4", "4"
# What a field is called that has no place on Earth: it is laid down in the sea, at 0, 0.
NOWHERE = "not placed: metres from 0N 0E"


def plan_taskdata(plan: HarvestPlan) -> bytes:
    """A partfield with its boundary, obstacles, gates and places of trucks, and all guidance lines.

    For each combine there is a guidance group, in it a pattern for each swath in the order of
    driving: an A-B line, or a curve. Of a field that nobody knows the place of the zero is put at
    longitude and latitude 0, and its name says so.

    Args:
        plan: What is written.

    Returns:
        The contents of TASKDATA.XML.
    """
    field = plan.combines.field
    name = field.name or "field"
    if not field.place.geographic:
        field, name = replace(field, place=Place(origin=(0.0, 0.0))), NOWHERE
    root = Element(
        "ISO11783_TaskData",
        VersionMajor="4",
        VersionMinor="2",
        ManagementSoftwareManufacturer="Sightfield",
        ManagementSoftwareVersion="1",
        DataTransferOrigin="1",
    )
    area = str(round(field.area))
    part = SubElement(root, "PFD", A="PFD1", C=name[:LONGEST_NAME], D=area)
    _add_polygon(part, field, field.polygon, BOUNDARY)
    for each in (*field.obstacles, *field.no_go):
        _add_polygon(part, field, each, OBSTACLE)
    for kind, points in ((ACCESS, field.gates), (STORAGE, plan.supply.trucks[:, :2])):
        for k, point in enumerate(points):
            called = f"gate {k}" if kind == ACCESS else f"truck of cart {k}"
            _add_points(part, field, point[None], [kind], called)
    swaths = swaths_of(plan)
    numbers = iter(range(1, len(swaths) + 1))
    for combine in range(len(plan.service.plans)):
        group = SubElement(part, "GGP", A=f"GGP{combine + 1}", B=f"combine {combine}")
        for swath in swaths:
            if swath.combine == combine:
                width = plan.combines.size.header_width
                _add_pattern(group, field, swath, next(numbers), width)
    indent(root)
    return tostring(root, encoding="utf-8", xml_declaration=True)


def _add_pattern(group: Element, field: Field, swath: Swath, number: int, width: float) -> None:
    pattern = SubElement(
        group,
        "GPN",
        A=f"GPN{number}",
        B=f"combine {swath.combine} swath {swath.number}",
        C=AB if swath.straight else CURVE,
        E=NO_PROPAGATION,
        F=NO_EXTENSION,
    )
    if swath.straight:
        east, north = np.diff(swath.points, axis=0)[0]
        pattern.set("G", f"{np.degrees(np.arctan2(east, north)) % 360.0:.6f}")
    # Widths and lengths are millimetres.
    line = SubElement(
        pattern, "LSG", A=GUIDANCE, C=str(round(1e3 * width)), D=str(round(1e3 * swath.length))
    )
    between = [POINT_BETWEEN] * (len(swath.points) - 2)
    _add_points(line, field, swath.points, [POINT_A, *between, POINT_B])


def _add_polygon(part: Element, field: Field, polygon: shapely.Polygon, kind: str) -> None:
    area = str(round(polygon.area))
    parent = SubElement(part, "PLN", A=kind, C=area)
    for number, ring in enumerate((polygon.exterior, *polygon.interiors)):
        line = SubElement(parent, "LSG", A=INTERIOR if number else EXTERIOR)
        points = np.array(ring.coords)
        _add_points(line, field, points, [POINT_OTHER] * len(points))


def _add_points(
    parent: Element, field: Field, points: np.ndarray, kinds: list[str], called: str = ""
) -> None:
    for kind, (east, north) in zip(kinds, field.place.outwards(points).tolist(), strict=True):
        point = SubElement(parent, "PNT", A=kind)
        if called:
            point.set("B", called)
        point.set("C", f"{north:.9f}")
        point.set("D", f"{east:.9f}")
