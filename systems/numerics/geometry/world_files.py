"""Worlds from files: WKT, GeoJSON and ROS occupancy maps.

Longitudes and latitudes of GeoJSON become metres on a plane, for places as small as a field.
"""

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from ..errors import InvalidInput, require, require_one_of
from .occupancy_map import read_occupancy_map
from .occupancy_outline import OutlineOptions, outline_occupancy_map
from .world import World, make_world, world_from_polygon

# WGS 84 ellipsoid: semi-major axis [m] and flattening (NGA.STND.0036, table 3.1).
SEMI_MAJOR_AXIS = 6378137.0
FLATTENING = 1 / 298.257223563


def local_plane(points: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """East and north of an origin, on the plane that touches the ellipsoid there.

    Points of the ellipsoid, in Earth-centred coordinates, are projected along the origin's
    vertical (east-north-up coordinates without their up; Hofmann-Wellenhof, Lichtenegger and
    Wasle, "GNSS", 2008, coordinate transformations). At a distance d lengths come out short by
    the factor 1 - d^2 / (2 R^2) at most, with R = 6371 km: 0.1 mm in a kilometre at 3 km.

    Args:
        points: Longitude and latitude, shape (n, 2) [degrees].
        origin: Longitude and latitude of the plane's zero, shape (2,) [degrees].

    Returns:
        x east and y north, shape (n, 2) [m].
    """
    away = _earth_centred(np.asarray(points, dtype=float)) - _earth_centred(origin[None])
    (sin_lon, sin_lat), (cos_lon, cos_lat) = np.sin(np.radians(origin)), np.cos(np.radians(origin))
    east = np.array([-sin_lon, cos_lon, 0.0])
    north = np.array([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat])
    return np.stack([away @ east, away @ north], axis=1)


def from_local_plane(points: np.ndarray, origin: np.ndarray) -> np.ndarray:
    """Longitude and latitude of points on the plane of `local_plane`, whose inverse this is.

    Each point is taken back along the origin's vertical to the ellipsoid: a quadratic equation.

    Args:
        points: x east and y north, shape (n, 2) [m].
        origin: Longitude and latitude of the plane's zero, shape (2,) [degrees].

    Returns:
        Longitude and latitude, shape (n, 2) [degrees].
    """
    (sin_lon, sin_lat), (cos_lon, cos_lat) = np.sin(np.radians(origin)), np.cos(np.radians(origin))
    east = np.array([-sin_lon, cos_lon, 0.0])
    north = np.array([-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat])
    up = np.array([cos_lat * cos_lon, cos_lat * sin_lon, sin_lat])
    points = np.asarray(points, dtype=float)
    base = _earth_centred(np.asarray(origin, dtype=float)[None])
    base = base + points[:, :1] * east + points[:, 1:] * north
    # Stretching z by a / b makes the ellipsoid a sphere; take the nearer of two intersections.
    stretch = np.array([1.0, 1.0, 1.0 / (1.0 - FLATTENING)])
    at, along = base * stretch, up * stretch
    half, square = at @ along, float(along @ along)
    rest = (at**2).sum(axis=1) - SEMI_MAJOR_AXIS**2
    # This form of the root avoids cancellation where the point is near the ellipsoid.
    height = -rest / (half + np.sqrt(half**2 - square * rest))
    x, y, z = (base + height[:, None] * up).T
    latitude = np.arctan2(z, (1.0 - FLATTENING * (2.0 - FLATTENING)) * np.hypot(x, y))
    return np.degrees(np.stack([np.arctan2(y, x), latitude], axis=1))


def _earth_centred(points: np.ndarray) -> np.ndarray:
    """Earth-centred, Earth-fixed coordinates of points on the ellipsoid, shape (n, 3) [m]."""
    longitude, latitude = np.radians(points).T
    squared_eccentricity = FLATTENING * (2.0 - FLATTENING)
    normal = SEMI_MAJOR_AXIS / np.sqrt(1.0 - squared_eccentricity * np.sin(latitude) ** 2)
    across = normal * np.cos(latitude)
    return np.stack(
        [
            across * np.cos(longitude),
            across * np.sin(longitude),
            (1.0 - squared_eccentricity) * normal * np.sin(latitude),
        ],
        axis=1,
    )


SUFFIXES = {
    ".wkt": "wkt",
    ".geojson": "geojson",
    ".json": "geojson",
    ".yaml": "map_server",
    ".yml": "map_server",
}

# Widest extent for one local plane [degrees]. Coordinates within +-180 and +-90 that span less
# are taken for degrees, not metres.
WIDEST_SPAN = 1.0


@dataclass(frozen=True, eq=False)
class LoadedWorld:
    """A world loaded from a file, its source, and how it differs from the file.

    Attributes:
        world: The free region.
        source: Format of the file: "wkt", "geojson" or "map_server".
        simplification_error: Hausdorff distance between the outline of the world and that in the
            file [m]; 0 for polygons, which are taken as they are.
        speckle_area: Area of dropped speckle [m^2].
        unreachable_area: Area that is free in the file, but not reachable from the world's free
            region [m^2].
        geographic_origin: Longitude and latitude of the world's origin [degrees]; None if the
            file was in metres.
    """

    world: World
    source: str
    simplification_error: float
    speckle_area: float
    unreachable_area: float
    geographic_origin: tuple[float, float] | None


def load_world(
    path: str | Path,
    *,
    options: OutlineOptions | None = None,
    coordinates: str = "metres",
) -> LoadedWorld:
    """Load a world; the suffix gives the format: .wkt, .geojson, .json, .yaml or .yml.

    A polygon's exterior is the boundary, its interiors are obstacles. If a file has several
    polygons, the one that contains all others is the boundary and the others are obstacles; holes
    in these cannot be reached, and are filled. Overlapping obstacles are merged.

    Args:
        path: The file.
        options: How an occupancy map becomes polygons; None: the defaults.
        coordinates: Of WKT and GeoJSON, "metres" or "wgs84". The latter is longitude and latitude
            in degrees; the world is then in metres east and north of the boundary's centroid.

    Raises:
        InvalidInput: The file is missing or malformed, or holds no world; options are given for
            a file that is not an occupancy map.
    """
    path = Path(path)
    require_one_of("coordinates", coordinates, ("metres", "wgs84"))
    require(
        path.suffix.lower() in SUFFIXES, "world file", f"end in {', '.join(SUFFIXES)}", path.name
    )
    require(path.exists(), "world file", "exist", path)
    require(path.is_file(), "world file", "be a file", path)
    source = SUFFIXES[path.suffix.lower()]
    if source == "map_server":
        require(coordinates == "metres", "coordinates", "be metres for a map", coordinates)
        outline = outline_occupancy_map(read_occupancy_map(path), options)
        return LoadedWorld(
            outline.world,
            "map_server",
            outline.simplification_error,
            outline.speckle_area,
            outline.unreachable_area,
            None,
        )
    usual = asdict(OutlineOptions())
    for name, asked in (usual if options is None else asdict(options)).items():
        require(asked == usual[name], name, "be left out for what is no ROS map", asked)
    polygons = polygons_of(read_geometry(path, source))
    rim = _outermost(polygons)
    origin = None
    if coordinates == "wgs84":
        polygons, origin = _in_metres(polygons, rim)
    else:
        _refuse_degrees(polygons)
    others = polygons[:rim] + polygons[rim + 1 :]
    if others:
        holes = [ring.coords for ring in polygons[rim].interiors]
        holes += [other.exterior.coords for other in others]
        world = make_world(polygons[rim].exterior.coords, holes)
    else:
        world = world_from_polygon(polygons[rim])
    return LoadedWorld(world, source, 0.0, 0.0, _pockets(polygons[rim], others), origin)


def _pockets(rim: shapely.Polygon, others: list[shapely.Polygon]) -> float:
    """Free area inside of obstacles, which may overlap [m^2]."""
    if not any(other.interiors for other in others):
        return 0.0
    walls = [*others, *(shapely.Polygon(ring) for ring in rim.interiors)]
    filled = [shapely.Polygon(wall.exterior) for wall in walls]
    return float(shapely.union_all(filled).area - shapely.union_all(walls).area)


def read_geometry(path: Path, source: str) -> BaseGeometry:
    """Read the geometry of a WKT or GeoJSON file, without heights.

    Args:
        path: The file.
        source: "wkt" or "geojson".

    Raises:
        InvalidInput: The file is malformed, or holds nothing.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        # No warnings of NaN coordinates: they are reported as errors below.
        with np.errstate(invalid="ignore"):
            geometry = (
                shapely.from_wkt(text) if source == "wkt" else shapely.from_geojson(_located(text))
            )
    except (OSError, ValueError, shapely.errors.GEOSException) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())[:200]
        raise InvalidInput(
            f"`world file` must be readable {'WKT' if source == 'wkt' else 'GeoJSON'}; "
            f"got {path} ({reason})"
        ) from None
    require(geometry is not None, "world file", "hold a polygon", f"nothing in {path}")
    return shapely.force_2d(geometry)


def _located(text: str) -> str:
    """Drop GeoJSON features without a geometry (RFC 7946, 3.2), which GEOS does not accept."""
    try:
        whole = json.loads(text)
    except (ValueError, RecursionError):
        return text
    features = whole.get("features") if isinstance(whole, dict) else None
    if not isinstance(features, list):
        return text
    lost = [isinstance(each, dict) and each.get("geometry", "") is None for each in features]
    kept = [each for each, nowhere in zip(features, lost, strict=True) if not nowhere]
    return json.dumps(whole | {"features": kept}) if any(lost) else text


def polygons_of(geometry: BaseGeometry) -> list[shapely.Polygon]:
    """The polygons of a geometry, with nested collections taken apart.

    Raises:
        InvalidInput: There is no polygon, something that is not a polygon, or an invalid polygon.
    """
    if isinstance(geometry, shapely.GeometryCollection | shapely.MultiPolygon):
        found = [polygon for part in geometry.geoms for polygon in polygons_of(part)]
        require(len(found) > 0, "world file", "hold a polygon", f"an empty {geometry.geom_type}")
        return found
    if not isinstance(geometry, shapely.Polygon) or geometry.is_empty:
        empty = "an empty " if geometry.is_empty else "a "
        raise InvalidInput(f"`world file` must hold polygons only; got {empty}{geometry.geom_type}")
    if not geometry.is_valid:
        raise InvalidInput(
            f"`world file` must hold valid polygons; got {shapely.is_valid_reason(geometry)}"
        )
    return [geometry]


def _outermost(polygons: list[shapely.Polygon]) -> int:
    """Which polygon's exterior contains all the others."""
    filled = [shapely.Polygon(polygon.exterior) for polygon in polygons]
    largest = int(np.argmax([polygon.area for polygon in filled]))
    for i, polygon in enumerate(filled):
        if not filled[largest].covers(polygon):
            raise InvalidInput(
                "`world file` must have one polygon that contains all the others; got polygon "
                f"{i + 1} of {len(filled)} partly or all outside of the largest, "
                f"polygon {largest + 1}"
            )
    return largest


def _span(polygons: list[shapely.Polygon]) -> tuple[bool, float]:
    """Whether all coordinates could be longitudes and latitudes, and the widest extent."""
    x_low, y_low, x_high, y_high = shapely.total_bounds(polygons).tolist()
    on_globe = x_low >= -180 and x_high <= 180 and y_low >= -90 and y_high <= 90
    return on_globe, max(x_high - x_low, y_high - y_low)


def _refuse_degrees(polygons: list[shapely.Polygon]) -> None:
    on_globe, span = _span(polygons)
    if on_globe and span < WIDEST_SPAN:
        raise InvalidInput(
            f"`coordinates` must be wgs84 for longitudes and latitudes; got metres, but the file "
            f"spans only {span:.6f} within +-180 and +-90, which looks like degrees"
        )


def _in_metres(
    polygons: list[shapely.Polygon], rim: int
) -> tuple[list[shapely.Polygon], tuple[float, float]]:
    """Project polygons of longitude and latitude onto the local plane of the rim's centroid."""
    on_globe, span = _span(polygons)
    bounds = np.round(shapely.total_bounds(polygons), 6).tolist()
    require(on_globe, "world file", "be within +-180, +-90 degrees", f"bounds {bounds}")
    require(span <= WIDEST_SPAN, "world file", f"span at most {WIDEST_SPAN} degree", span)
    centre = shapely.Polygon(polygons[rim].exterior).centroid
    origin = np.array([centre.x, centre.y])
    projected = [
        shapely.transform(polygon, lambda points: local_plane(points, origin))
        for polygon in polygons
    ]
    return projected, (float(centre.x), float(centre.y))
