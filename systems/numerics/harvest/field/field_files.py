"""Fields from files: WKT and GeoJSON."""

from pathlib import Path

from ...errors import InvalidInput, require
from ...geometry.world_files import load_world
from .field import MARGIN, Field

SUFFIXES = (".wkt", ".geojson", ".json")


def read_field(path: str | Path, *, coordinates: str = "wgs84", margin: float = MARGIN) -> Field:
    """Read a field's boundary; its interior rings are obstacles.

    Of several polygons, in a FeatureCollection or a MultiPolygon, one has to contain all the
    others, which are obstacles then. Heights are dropped.

    Args:
        path: A .wkt, .geojson or .json file.
        coordinates: "wgs84": longitude and latitude in degrees, projected to metres east and
            north of the boundary's centroid; "metres": taken as they are.
        margin: Width of the strip outside of the boundary that may be driven on [m].

    Raises:
        InvalidInput: The file is missing or malformed, or holds no single valid region.
    """
    suffix = Path(path).suffix.lower()
    require(suffix in SUFFIXES, "field file", f"end in {', '.join(SUFFIXES)}", Path(path).name)
    try:
        loaded = load_world(path, coordinates=coordinates)
    except InvalidInput as error:
        said = str(error).replace("`world file`", "`field file`")
        if "degrees" in said:
            said += "; or are they metres? Then coordinates has to be metres"
        raise InvalidInput(said) from None
    return Field(loaded.world, margin)
