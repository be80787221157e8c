"""A plan in files: GeoJSON (RFC 7946), and task data of farm machines with guidance lines.

Both have the boundary, obstacles, gates, places of trucks and the swaths that combines cut. GeoJSON
also has all times, the ways of machines and the unloadings; task data is ISO 11783-10, version 4.
"""

from dataclasses import replace
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np
import shapely

from ..field.field import Field, Place
from ..field.field_files import ACCESS, BOUNDARY, EXTERIOR, GUIDANCE, INTERIOR, OBSTACLE, STORAGE
from ..paths import MachinePath, TimedPath
from .harvest_plan import HarvestPlan

# Largest distance between an arc and the chords that stand for it [m].
CHORD_ERROR = 0.005
# A line that turns by less than this is straight [rad].
STRAIGHT = 1e-6

# Decimals of degrees and of metres: a tenth of a millimetre.
DECIMALS = {True: 9, False: 4}
# Time between two points of a way [s].
STEP = 2.0

# Longest designator (ISO 11783-10, annex D).
LONGEST_NAME = 32
# Types of guidance patterns, and of their points.
AB, CURVE = "1", "3"
POINT_A, POINT_B, POINT_BETWEEN, POINT_OTHER = "6", "7", "9", "2"
# A pattern is one swath: nothing is copied to its sides, and nothing is driven beyond its ends.
NO_PROPAGATION, NO_EXTENSION = "4", "4"
# Name of a field whose place on Earth is unknown: it is put in the sea, at 0, 0.
NOWHERE = "not placed: metres from 0N 0E"


class Swath(NamedTuple):
    """What a combine cuts at a stretch.

    Attributes:
        combine: Its number, from 0.
        number: Of the swath among those of the combine, from 1, in the order of driving.
        points: Of the middle of the header, shape (n, 2) [m].
        straight: Whether it is a straight line, of two points.
        begin, end: When the header is at its ends [s].
        length: [m].
    """

    combine: int
    number: int
    points: np.ndarray
    straight: bool
    begin: float
    end: float
    length: float


def swaths_of(plan: HarvestPlan) -> list[Swath]:
    """The swaths of all combines, combine by combine, in the order of driving."""
    found = []
    for combine, timed in enumerate(plan.service.plans):
        path = timed.path
        # What is cut on the way from one piece of work to the next is a swath as well.
        kinds = np.where(path.cutting, path.work, -1)
        edges = np.flatnonzero(np.diff(kinds)) + 1
        firsts, lasts = [0, *edges.tolist()], [*edges.tolist(), len(kinds)]
        number = 0
        for first, last in zip(firsts, lasts, strict=True):
            if last == first or kinds[first] < 0:
                continue
            number += 1
            stations = path.stations[first], path.stations[last]
            turned = np.abs(path.poses[first : last + 1, 2] - path.poses[first, 2]).max()
            straight = bool(turned < STRAIGHT)
            points = path.poses[[first, last], :2] if straight else path_points(path, first, last)
            found.append(
                Swath(
                    combine,
                    number,
                    points,
                    straight,
                    # When it leaves the first end and comes to the last; sums are rounded.
                    _time_at(timed, stations[0] + 1e-6),
                    _time_at(timed, stations[1] - 1e-6),
                    float(stations[1] - stations[0]),
                )
            )
    return found


def path_points(path: MachinePath, first: int, last: int) -> np.ndarray:
    """Points along some pieces of a path, so dense that chords stay within CHORD_ERROR of arcs.

    Args:
        path: The path.
        first, last: Numbers of the first pose and the last.

    Returns:
        Shape (n, 2) [m].
    """
    stations = [path.stations[first : first + 1]]
    for piece in range(first, last):
        length, bend = path.lengths[piece], abs(path.curvatures[piece])
        parts = int(np.ceil(length * np.sqrt(bend / (8 * CHORD_ERROR)))) if bend > 0 else 1
        begin, end = path.stations[piece], path.stations[piece + 1]
        stations.append(np.linspace(begin, end, max(parts, 1) + 1)[1:])
    return path.pose_at(np.concatenate(stations))[:, :2]


def way_points(timed: TimedPath, step: float) -> np.ndarray:
    """Places of a machine on its way at evenly spaced times.

    Args:
        timed: Its path and times.
        step: Largest time between two points [s].

    Returns:
        x, y and time, shape (n, 3) [m], [m], [s]; while it stands, the first and last point only.
    """
    count = max(2, int(np.ceil((timed.end - timed.times[0]) / step)) + 1)
    times = np.linspace(timed.times[0], timed.end, count)
    points = np.column_stack([timed.pose_at(times)[:, :2], times])
    moved = np.hypot(*np.diff(points[:, :2], axis=0).T) > 1e-3
    keep = np.concatenate([[True], moved]) | np.concatenate([moved, [True]])
    return points[keep]


def _time_at(timed: TimedPath, station: float) -> float:
    """When a machine comes to a station [s]."""
    low, high = float(timed.times[0]), timed.end
    for _ in range(60):
        middle = (low + high) / 2
        if timed.station_at(middle) < station:
            low = middle
        else:
            high = middle
    return high


def plan_geojson(plan: HarvestPlan) -> dict[str, Any]:
    """A plan as a FeatureCollection, ready for JSON.

    Every feature has a `kind`: field, no-go, gate, swath, way, visit, trip, truck. Coordinates are
    longitude and latitude (WGS 84), or, if the place of the field is unknown, the metres of its
    file; the member `coordinates` says which. Times are seconds after the beginning.

    Args:
        plan: What is written.
    """
    field = plan.combines.field
    service = plan.service
    features = [_feature("field", _polygon(field), name=field.name, area=round(field.area, 2))]
    for each in field.no_go:
        rings = [_line(field, np.array(each.exterior.coords))]
        features.append(_feature("no-go", {"type": "Polygon", "coordinates": rings}))
    features += [_feature("gate", _point(field, gate)) for gate in field.gates]
    for swath in swaths_of(plan):
        features.append(
            _feature(
                "swath",
                {"type": "LineString", "coordinates": _line(field, swath.points)},
                combine=swath.combine,
                number=swath.number,
                straight=swath.straight,
                begin=round(swath.begin, 2),
                end=round(swath.end, 2),
                length=round(swath.length, 2),
                width=plan.combines.size.header_width,
            )
        )
    features += [_way(field, timed, combine=n) for n, timed in enumerate(service.plans)]
    features += [_way(field, motion.timed, cart=k) for k, motion in enumerate(service.motions)]
    for visit in service.visits:
        path = service.plans[visit.combine]
        here = path.pose_at(np.array([visit.begin, visit.end]))[:, :2]
        features.append(
            _feature(
                "visit",
                {"type": "LineString", "coordinates": _line(field, here)},
                **{**visit._asdict(), "taken": round(visit.taken, 2)},
            )
        )
    for trip in service.trips:
        place = _point(field, plan.supply.trucks[trip.cart, :2])
        told = trip._asdict() | {"fillings": [each._asdict() for each in trip.fillings]}
        features.append(_feature("trip", place, **told))
    for cart, truck in enumerate(plan.supply.trucks):
        features.append(_feature("truck", _point(field, truck[:2]), cart=cart))
    known = field.place.geographic
    return {
        "type": "FeatureCollection",
        "coordinates": "wgs84" if known else "metres",
        "makespan": round(plan.makespan, 2),
        "features": features,
    }


def _feature(kind: str, geometry: dict[str, Any], **properties: object) -> dict[str, Any]:
    return {"type": "Feature", "properties": {"kind": kind, **properties}, "geometry": geometry}


def _way(field: Field, timed: TimedPath, **whose: int) -> dict[str, Any]:
    points = way_points(timed, STEP)
    shape = {"type": "LineString", "coordinates": _line(field, points[:, :2])}
    return _feature("way", shape, **whose, times=np.round(points[:, 2], 2).tolist())


def _polygon(field: Field) -> dict[str, Any]:
    polygon = field.polygon
    rings = [polygon.exterior, *polygon.interiors]
    # RFC 7946: exteriors run counter-clockwise, interiors clockwise.
    turned = [
        np.array(ring.coords)[:: 1 if ring.is_ccw == (k == 0) else -1]
        for k, ring in enumerate(rings)
    ]
    return {"type": "Polygon", "coordinates": [_line(field, ring) for ring in turned]}


def _point(field: Field, point: np.ndarray) -> dict[str, Any]:
    return {"type": "Point", "coordinates": _line(field, point[None])[0]}


def _line(field: Field, points: np.ndarray) -> list[list[float]]:
    outside = field.place.outwards(points)
    return np.round(outside, DECIMALS[field.place.geographic]).tolist()


def plan_taskdata(plan: HarvestPlan) -> bytes:
    """A partfield with its boundary, obstacles, gates and places of trucks, and all guidance lines.

    For each combine there is a guidance group, in it a pattern for each swath in the order of
    driving: an A-B line, or a curve. If the place of the field is unknown, its origin is put at
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
