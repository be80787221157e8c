"""A plan as GeoJSON (RFC 7946): boundary, swaths, ways with times, unloadings, trucks, gates."""

from typing import Any

import numpy as np

from ..field.field import Field
from ..paths.timed_path import TimedPath
from ..plan.harvest_plan import HarvestPlan
from .plan_lines import swaths_of, way_points

# Decimals of degrees and of metres: a tenth of a millimetre.
DECIMALS = {True: 9, False: 4}
# Between two points of a way [s].
STEP = 2.0


def plan_geojson(plan: HarvestPlan) -> dict[str, Any]:
    """A plan as a FeatureCollection, ready for JSON.

    Every feature has a `kind`: field, no-go, gate, swath, way, visit, trip, truck. Coordinates are
    longitude and latitude (WGS 84), or, where nobody knows where the field lies, the metres of its
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
