"""ROS occupancy maps: what each cell is, by the map's own thresholds.

A map is a YAML file beside a picture, in the format of `map_server`
(http://wiki.ros.org/map_server, "Map format"; nav2_map_server's `map_io` where that leaves
something open).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from ..errors import (
    InvalidInput,
    require,
    require_finite,
    require_one_of,
)
from .maps.gray_image import GrayImage, read_gray_image

FREE, OCCUPIED, UNKNOWN = 0, 1, 2

REQUIRED_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
MODES = ("trinary", "scale", "raw")

# Sizes of a cell that still give areas and coordinates with digits to spare [m].
RESOLUTION_RANGE = (1e-6, 1e6)


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """A grid of square cells that are free, occupied or unknown.

    Attributes:
        cells: FREE, OCCUPIED or UNKNOWN, shape (rows, columns); row 0 is the LOWEST row of the
            map (smallest y before the origin's yaw), column 0 the leftmost.
        resolution: Side of a cell [m].
        origin: Pose x [m], y [m], yaw [rad] of the lower left corner of cell (0, 0) in the world;
            rows grow along its y axis.
    """

    cells: np.ndarray
    resolution: float
    origin: tuple[float, float, float]

    def to_world(self, points: np.ndarray) -> np.ndarray:
        """Carry points from [column, row] cell units to the world, shape (n, 2) [m]."""
        x, y, yaw = self.origin
        c, s = np.cos(yaw), np.sin(yaw)
        turn = np.array([[c, s], [-s, c]])
        return self.resolution * (np.asarray(points, dtype=float) @ turn) + [x, y]


def read_occupancy_map(path: str | Path) -> OccupancyMap:
    """Read a `map_server` map from its YAML file.

    With brightness v and white w, a pixel's occupancy is p = (w - v) / w, or v / w if `negate`.
    Above `occupied_thresh` it is occupied, below `free_thresh` free, else unknown. Colours are
    averaged. The modes differ as in nav2_map_server:

    - trinary: alpha, if any, is averaged in as one more channel.
    - scale: pixels that are not opaque are unknown; those between the thresholds are graded,
      which makes the ones that round to 0 % free, to 100 % occupied, and the others unknown.
    - raw: the brightness on a scale of 255 IS the occupancy in percent, above 100 unknown;
      `negate` has no say. It is compared with the thresholds.

    Raises:
        InvalidInput: The YAML or the picture is missing or malformed, a key is missing, unknown,
            repeated or out of range, or no cell is free.
    """
    path = Path(path)
    settings = _read_settings(path)
    picture = settings["image"]
    require(isinstance(picture, str) and picture != "", "image", "name a file", repr(picture))
    assert isinstance(picture, str)
    resolution = _number("resolution", settings["resolution"])
    low, high = RESOLUTION_RANGE
    require(low <= resolution <= high, "resolution", f"be between {low} and {high} m", resolution)
    occupied_above = _probability("occupied_thresh", settings["occupied_thresh"])
    free_below = _probability("free_thresh", settings["free_thresh"])
    require(
        free_below <= occupied_above,
        "free_thresh",
        f"be at most occupied_thresh = {occupied_above}",
        free_below,
    )
    require_one_of("negate", settings["negate"], (0, 1, False, True))
    mode = str(settings.get("mode", "trinary"))
    require_one_of("mode", mode, MODES)
    pose = _origin(settings["origin"])
    image = read_gray_image(path.parent / picture)
    cells = _classify(image, mode, bool(settings["negate"]), occupied_above, free_below)
    require(bool((cells == FREE).any()), "image", "have a free cell", f"none in {picture}")
    # Pictures start at the top, maps at the bottom.
    return OccupancyMap(cells[::-1].copy(), resolution, pose)


def _classify(
    image: GrayImage, mode: str, negate: bool, occupied_above: float, free_below: float
) -> np.ndarray:
    """Class of every pixel, shape (rows, columns)."""
    channels, white = image.channels, image.white
    if mode == "trinary" and image.alpha is not None:
        # A gray picture has its three colours all the same.
        colours = np.broadcast_to(channels, (*channels.shape[:2], 3))
        channels = np.concatenate([colours, image.alpha[:, :, None]], axis=2)
    brightness = channels.mean(axis=2)
    occupancy = brightness / white if negate else (white - brightness) / white
    known = np.ones(brightness.shape, dtype=bool)
    if mode == "raw":
        percent = np.round(brightness * (255 / white))
        known = percent <= 100
        occupancy = percent / 100
    elif mode == "scale" and image.alpha is not None:
        known = image.alpha == white
    occupied, free = occupancy > occupied_above, occupancy < free_below
    if mode == "scale" and occupied_above > free_below:
        grade = np.rint(100 * (occupancy - free_below) / (occupied_above - free_below))
        occupied, free = occupied | (grade == 100), free | (grade == 0)
    return np.select([~known, occupied, free], [UNKNOWN, OCCUPIED, FREE], UNKNOWN).astype(np.uint8)


def _read_settings(path: Path) -> dict[str, object]:
    """The keys of a map's YAML file, checked for being the right ones."""
    try:
        text = path.read_text(encoding="utf-8")
        node = yaml.compose(text, Loader=yaml.SafeLoader)
        settings = yaml.safe_load(text)
    except (OSError, ValueError, yaml.YAMLError) as error:
        reason = " ".join(str(getattr(error, "strerror", None) or error).split())
        raise InvalidInput(
            f"`map file` must be a readable YAML file; got {path} ({reason})"
        ) from None
    require(
        isinstance(settings, dict) and isinstance(node, yaml.MappingNode),
        "map file",
        "map keys to values",
        f"{type(settings).__name__} in {path}",
    )
    # The parser keeps the last of two equal keys in silence, map_server the first.
    names = [key.value for key, _ in node.value]
    allowed = (*REQUIRED_KEYS, "mode")
    for name in names:
        require(name in allowed, "map file", f"have only the keys {', '.join(allowed)}", name)
        require(names.count(name) == 1, "map file", "have each key once", f"{name} twice")
    for name in REQUIRED_KEYS:
        require(name in settings, "map file", f"have the key {name}", ", ".join(names))
    return settings


def _number(name: str, value: object) -> float:
    """A finite number; YAML 1.1 takes 5e-2 for a text, map_server for a number."""
    if isinstance(value, str):
        try:
            value = float(value)
        except ValueError:
            raise InvalidInput(f"`{name}` must be a finite number; got {value!r}") from None
    require_finite(name, value)  # type: ignore[arg-type]  # checks the type itself
    return float(value)  # type: ignore[arg-type]  # a number by now


def _probability(name: str, value: object) -> float:
    number = _number(name, value)
    require(0.0 <= number <= 1.0, name, "be between 0 and 1", number)
    return number


def _origin(value: object) -> tuple[float, float, float]:
    require(
        isinstance(value, list) and len(value) == 3,
        "origin",
        "be a list [x, y, yaw]",
        value,
    )
    assert isinstance(value, list)
    x, y, yaw = (_number(f"origin[{i}]", entry) for i, entry in enumerate(value))
    return x, y, yaw
