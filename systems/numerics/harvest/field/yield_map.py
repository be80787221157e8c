"""Grain on a field: the same everywhere, or a map of it from GeoJSON or an ESRI ASCII grid."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely

from ...errors import InvalidInput, require, require_chance, require_positive
from ...geometry.world_files import polygons_of, read_geometry
from ...units import read_quantity
from .field import Field

# Spacing of the places that a mean is taken over, as a part of the ground's longer side [-].
FINE = 1 / 400

# Least side of the cells of a map that is read [m], and about how many there are at most.
LEAST_SIDE = 1.0
MOST_CELLS = 250_000
# No grain yields more [kg/m^2].
MOST = 10.0
# Least part of a field that a file must cover: else it is of another field, or misplaced [-].
LEAST_KNOWN = 0.05
# Largest file that is read [byte].
LARGEST = 50e6

# Keywords before the numbers of an ASCII grid; of each pair of corners a file has one.
_HEADER = ("ncols", "nrows", "cellsize", "nodata_value")
_CORNERS = (("xllcorner", "xllcenter"), ("yllcorner", "yllcenter"))


@dataclass(frozen=True, eq=False)
class YieldMap:
    """Grain in square cells, uniform within each; beyond them the nearest cell counts.

    Attributes:
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Of a cell [m].
        values: Grain, rows from south to north, shape (rows, columns) [kg/m^2].
        known: Part of the field whose grain is known; the density of the rest is assumed.

    Raises:
        InvalidInput: The side is not positive, there is no cell, grain is negative or not finite,
            or the part is not from 0 to 1.
    """

    corner: np.ndarray
    side: float
    values: np.ndarray
    known: float = 1.0

    def __post_init__(self) -> None:
        require_positive("side", self.side)
        require(self.values.ndim == 2 and self.values.size > 0, "values", "be cells", "none")
        sound = bool((np.isfinite(self.values) & (self.values >= 0)).all())
        require(sound, "yields", "be finite, zero or positive", "others")
        require_chance("known", self.known)

    def at(self, points: np.ndarray) -> np.ndarray:
        """Grain at points, shape (n, 2) [m] -> (n,) [kg/m^2]."""
        column, row = np.floor((np.asarray(points) - self.corner) / self.side).T
        rows, columns = self.values.shape
        row, column = np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)
        return self.values[row.astype(int), column.astype(int)]

    def on_cells(self, corner: np.ndarray, side: float, shape: tuple[int, int]) -> np.ndarray:
        """Grain at the middles of the cells of another grid, shape (rows, columns) [kg/m^2].

        Args:
            corner: x, y of the corner of its first cell, shape (2,) [m].
            side: Of its cells [m].
            shape: Their rows and columns.
        """
        places = []
        for axis, count in ((1, shape[0]), (0, shape[1])):
            middles = corner[axis] + side * (np.arange(count) + 0.5)
            numbers = np.floor((middles - self.corner[axis]) / self.side).astype(int)
            places.append(np.clip(numbers, 0, self.values.shape[1 - axis] - 1))
        return self.values[np.ix_(*places)]


def grain_on_cells(
    density: float | YieldMap, corner: np.ndarray, side: float, shape: tuple[int, int]
) -> np.ndarray:
    """Grain on each cell of a grid, shape (rows, columns) [kg].

    Args:
        density: Of the crop [kg/m^2].
        corner: x, y of the corner of the first cell, shape (2,) [m].
        side: Of the cells [m].
        shape: Their rows and columns.
    """
    if isinstance(density, YieldMap):
        return side**2 * density.on_cells(corner, side, shape)
    return np.full(shape, side**2 * density)


def mean_density(density: float | YieldMap, ground: shapely.Polygon) -> float:
    """Mean density of grain on some ground [kg/m^2].

    Args:
        density: Of the crop [kg/m^2].
        ground: What the mean is taken over.
    """
    if not isinstance(density, YieldMap):
        return density
    x_low, y_low, x_high, y_high = ground.bounds
    step = min(FINE * max(x_high - x_low, y_high - y_low), density.side / 2)
    step = max(step, FINE / 5 * max(x_high - x_low, y_high - y_low))
    x, y = np.meshgrid(np.arange(x_low, x_high, step), np.arange(y_low, y_high, step))
    places = np.column_stack([x.ravel(), y.ravel()]) + step / 2
    inside = shapely.contains_xy(ground, *places.T)
    return float(density.at(places[inside]).mean())


def known_part(density: float | YieldMap) -> float | None:
    """Part of a field whose grain is known from a map; None without one.

    Args:
        density: Of the crop [kg/m^2].
    """
    return density.known if isinstance(density, YieldMap) else None


def read_yields(
    path: str | Path, field: Field, density: float, *, key: str = "yield", unit: str = "t/ha"
) -> YieldMap:
    """Read a map of the yield of a field.

    Args:
        path: A .geojson or .json file of polygons with a property, where the last of overlapping
            polygons counts; or an .asc file, an ESRI ASCII grid. Coordinates are of the kind
            of the field's file: longitude and latitude, or metres.
        field: The field.
        density: Where the file says nothing [kg/m^2].
        key: Name of the property, in upper or lower case.
        unit: Of the file's numbers, as "t/ha" or "bu/ac wheat".

    Raises:
        InvalidInput: The file is missing or malformed, tells of less than LEAST_KNOWN of the field,
            or holds yields that are no numbers, negative or beyond those of any grain; the unit is
            none of yields.
    """
    path = Path(path)
    require(path.suffix.lower() in _READERS, "yields", f"end in {', '.join(_READERS)}", path.name)
    require(path.is_file(), "yields", "exist", path)
    require(path.stat().st_size <= LARGEST, "yields", f"be at most {LARGEST / 1e6:g} MB", path)
    factor = read_quantity("yields.unit", f"1 {unit}", "kg/m^2")
    x_low, y_low, x_high, y_high = field.outline.bounds
    side = max(LEAST_SIDE, math.sqrt((x_high - x_low) * (y_high - y_low) / MOST_CELLS))
    columns, rows = math.ceil((x_high - x_low) / side), math.ceil((y_high - y_low) / side)
    x, y = (side * (np.arange(count) + 0.5) for count in (columns, rows))
    middles = np.stack(np.meshgrid(x_low + x, y_low + y), axis=-1).reshape(-1, 2)
    told = factor * _READERS[path.suffix.lower()](path, field.place.outwards(middles), key)
    known = np.isfinite(told)
    inside = shapely.contains_xy(field.polygon, *middles.T)
    share = float(known[inside].mean()) if inside.any() else 0.0
    require(share > 0, "yields", "lie on the field", f"none of {path.name}")
    least = f"tell of at least {LEAST_KNOWN:.0%} of the field"
    require(share >= LEAST_KNOWN, "yields", least, f"{share:.2%} in {path.name}")
    low, high = float(told[known].min()), float(told[known].max())
    worst = low if low < 0 else high
    sound = low >= 0 and high <= MOST
    require(sound, "yields", f"lie between 0 and {MOST * 10:g} t/ha", f"{10 * worst:.6g} t/ha")
    values = np.where(known, told, density).reshape(rows, columns)
    require(bool((values.ravel()[inside] > 0).any()), "yields", "be positive somewhere", path.name)
    return YieldMap(np.array([x_low, y_low]), side, values, share)


def _read_polygons(path: Path, points: np.ndarray, key: str) -> np.ndarray:
    """What the polygons of a GeoJSON file say of points, NaN where nothing."""
    try:
        read_geometry(path, "geojson")
        about = json.loads(path.read_text(encoding="utf-8-sig"))
    except InvalidInput as error:
        raise InvalidInput(str(error).replace("`world file`", "`yields`")) from None
    features = about.get("features") if isinstance(about, dict) else None
    require(isinstance(features, list), "yields", "be a FeatureCollection", path.name)
    assert isinstance(features, list)
    found = np.full(len(points), np.nan)
    for number, feature in enumerate(features):
        if not feature.get("geometry"):
            continue
        told = feature.get("properties")
        plain = {str(name).lower(): value for name, value in (told or {}).items()}
        value = plain.get(key.lower())
        fits = isinstance(value, (int, float)) and math.isfinite(value) and value is not True
        if not fits:
            shown = f"{value!r:.40} in feature {number}"
            raise InvalidInput(f"`yields` must have a number as `{key}` of each; got {shown}")
        try:
            shape = shapely.from_geojson(json.dumps(feature["geometry"]))
            parts = polygons_of(shape)
        except InvalidInput as error:
            raise InvalidInput(str(error).replace("`world file`", "`yields`")) from None
        for part in parts:
            found[shapely.contains_xy(part, *points.T)] = value
    return found


def _read_raster(path: Path, points: np.ndarray, key: str) -> np.ndarray:
    """What an ASCII grid, which knows no properties, says of points, NaN where nothing."""
    del key
    corner, side, values = _ascii_grid(path)
    columns, rows = np.floor((points - corner) / side).T
    inside = (rows >= 0) & (rows < values.shape[0])
    inside &= (columns >= 0) & (columns < values.shape[1])
    found = np.full(len(points), np.nan)
    found[inside] = values[rows[inside].astype(int), columns[inside].astype(int)]
    return found


def _ascii_grid(path: Path) -> tuple[list[float], float, np.ndarray]:
    """Lower left corner and side of the cells of an ASCII grid, and values from south to north."""
    try:
        words = path.read_text(encoding="utf-8-sig").split()
        told: dict[str, float] = {}
        while len(words) >= 2 and words[0][0].isalpha() and words[0].lower() != "nan":
            told[words[0].lower()] = float(words[1])
            words = words[2:]
        numbers = np.array(words, dtype=float)
    except (OSError, ValueError) as error:
        reason = " ".join(str(error).split())[:100]
        raise InvalidInput(f"`yields` must be a readable grid; got {path} ({reason})") from None
    for name in _HEADER[:3]:
        require(name in told, "yields", f"tell {name} in its head", sorted(told))
    side = told["cellsize"]
    require_positive("yields: cellsize", side)
    fits = told["nrows"] * told["ncols"] == len(numbers) > 0
    told_size = f"{told['nrows']:g} x {told['ncols']:g} numbers"
    require(fits, "yields", f"hold {told_size} as its head says", len(numbers))
    require(told["nrows"] >= 1, "yields", "have rows", told["nrows"])
    corner = []
    for edge, middle in _CORNERS:
        require(edge in told or middle in told, "yields", f"tell {edge} in its head", sorted(told))
        corner.append(told[edge] if edge in told else told[middle] - side / 2)
    require(bool(np.isfinite(corner).all()), "yields", "lie somewhere", corner)
    cells = numbers.reshape(int(told["nrows"]), -1)
    # Esri's default if a file names none; some name nan, which does not equal itself.
    nothing = told.get("nodata_value", -9999.0)
    untold = np.isnan(cells) if math.isnan(nothing) else cells == nothing
    wrong = np.argwhere(~untold & ~np.isfinite(cells))
    if len(wrong):
        row, column = wrong[0]
        got = f"{cells[row, column]} in row {row + 1}, column {column + 1}"
        wanted = f"be numbers, or {nothing:g} where there are none"
        raise InvalidInput(f"`yields` must {wanted}; got {got} of {path.name}")
    return corner, side, np.where(untold, np.nan, cells)[::-1]


_READERS = {".geojson": _read_polygons, ".json": _read_polygons, ".asc": _read_raster}
