"""ROS occupancy maps: cells classified by the map's own thresholds.

A map is a YAML file beside a picture, in the format of `map_server`
(http://wiki.ros.org/map_server, "Map format"; nav2_map_server's `map_io` where that leaves
something open). OpenCV fills the missing part of a truncated picture with zeros, which a map would
show as walls. So the length of a file is checked here against its header.
"""

import re
import zlib
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import yaml

from ..errors import InvalidInput, require, require_finite, require_one_of
from ..files import read_yaml

PNG_SIGNATURE = b"\x89PNG\r\n\x1a\n"

# "P5 width height maxval", separated by white space and comments, then ONE white space.
_GAP = rb"(?:\s|#[^\r\n]*[\r\n])+"
_GRAYMAP_HEADER = re.compile(
    rb"P([25])" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})\s"
)


@dataclass(frozen=True, eq=False)
class GrayImage:
    """A picture as brightness, its first row at the top.

    Attributes:
        channels: Colour channels, shape (rows, columns, k), k = 1 or 3, in [0, white].
        alpha: Opacity in [0, white], shape (rows, columns); None if the file has none.
        white: Value of a white pixel: 255, or what the file states.
    """

    channels: np.ndarray
    alpha: np.ndarray | None
    white: int


def read_gray_image(path: Path, name: str = "image") -> GrayImage:
    """Read a PGM (P2 or P5, 8 or 16 bits) or PNG file.

    Args:
        path: The file; its format is recognised by its content, not its suffix.
        name: Name of the parameter in error messages.

    Raises:
        InvalidInput: Missing, another format, no pixels, truncated or damaged.
    """
    try:
        data = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInput(f"`{name}` must be a readable file; got {path} ({reason})") from None
    if data[:2] in (b"P2", b"P5"):
        return _graymap(data, path, name)
    if data.startswith(PNG_SIGNATURE):
        return _png(data, path, name)
    start = data[:8].hex(" ") or "an empty file"
    raise InvalidInput(f"`{name}` must be a PGM or PNG picture; got {path}, which starts {start}")


def _graymap(data: bytes, path: Path, name: str) -> GrayImage:
    """Parse a portable graymap; see https://netpbm.sourceforge.net/doc/pgm.html."""
    header = _GRAYMAP_HEADER.match(data)
    if header is None:
        raise InvalidInput(f"`{name}` must have a PGM header; got {data[:40]!r} in {path}")
    kind, columns, rows, white = (int(group) for group in header.groups())
    require(columns > 0 and rows > 0, name, "have pixels", f"{columns} x {rows} in {path}")
    require(0 < white < 65536, name, "have a maxval in 1..65535", f"{white} in {path}")
    body = data[header.end() :]
    if kind == 2:
        plain = re.sub(rb"#[^\r\n]*", b"", body)
        if not re.fullmatch(rb"[\d\s]*", plain):
            raise InvalidInput(f"`{name}` must hold decimal pixels; got other text in {path}")
        pixels = np.array(plain.split(), dtype="S").astype(float)
    else:
        depth = 1 if white < 256 else 2
        # A line end after the last pixel is common and harmless.
        if body[rows * columns * depth :].isspace():
            body = body[: rows * columns * depth]
        pixels = np.frombuffer(body[: len(body) // depth * depth], f">u{depth}").astype(float)
    if len(pixels) != rows * columns:
        raise InvalidInput(
            f"`{name}` must hold the {columns} x {rows} pixels of its header; "
            f"got {len(pixels)} instead of {rows * columns} in {path}"
        )
    require(
        bool((pixels <= white).all()), name, f"stay within its maxval {white}", f"more in {path}"
    )
    return GrayImage(pixels.reshape(rows, columns, 1), None, white)


def _png(data: bytes, path: Path, name: str) -> GrayImage:
    """Decode a PNG file after checking that every chunk is present and complete."""
    fault = _png_fault(data)
    if fault:
        raise InvalidInput(f"`{name}` must be a whole PNG file; got {fault} in {path}")
    try:
        pixels = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        pixels = None
    if pixels is None:
        raise InvalidInput(f"`{name}` must be a readable PNG file; got {path}")
    white = 255 if pixels.dtype == np.uint8 else 65535
    pixels = np.atleast_3d(pixels).astype(float)
    if pixels.shape[2] in (2, 4):
        return GrayImage(pixels[:, :, :-1], pixels[:, :, -1], white)
    return GrayImage(pixels, None, white)


def _png_fault(data: bytes) -> str:
    """Describe a fault in the chunks of a PNG file (PNG specification, section 5); '' if none."""
    position, packed, kind = len(PNG_SIGNATURE), b"", b""
    while kind != b"IEND":
        length = int.from_bytes(data[position : position + 4], "big")
        kind = data[position + 4 : position + 8]
        body = data[position + 8 : position + 8 + length]
        check = data[position + 8 + length : position + 12 + length]
        if len(check) < 4:
            return "a truncated file"
        if zlib.crc32(kind + body) != int.from_bytes(check, "big"):
            return f"a damaged {kind!r} chunk"
        packed += body if kind == b"IDAT" else b""
        position += 12 + length
    unpacker = zlib.decompressobj()
    try:
        unpacker.decompress(packed)
    except zlib.error as error:
        return f"damaged pixels ({error})"
    return "" if unpacker.eof else "truncated pixels"


FREE, OCCUPIED, UNKNOWN = 0, 1, 2

REQUIRED_KEYS = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
MODES = ("trinary", "scale", "raw")

# Cell sizes for which areas and coordinates keep enough digits [m].
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
    - scale: pixels that are not opaque are unknown; those between the thresholds are graded:
      values that round to 0 % are free, to 100 % occupied, and the others unknown.
    - raw: the brightness on a scale of 255 IS the occupancy in percent, above 100 unknown;
      `negate` is ignored. The occupancy is compared with the thresholds.

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
        # A gray picture has three equal colours.
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
    """Read a map's YAML file and check its keys."""
    try:
        text = path.read_text(encoding="utf-8")
        settings = read_yaml(text)
        node = yaml.compose(text, Loader=yaml.SafeLoader)
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
    names = [key.value for key, _ in node.value]
    allowed = (*REQUIRED_KEYS, "mode")
    for name in names:
        require(name in allowed, "map file", f"have only the keys {', '.join(allowed)}", name)
    for name in REQUIRED_KEYS:
        require(name in settings, "map file", f"have the key {name}", ", ".join(names))
    return settings


def _number(name: str, value: object) -> float:
    """A finite number; YAML 1.1 reads 5e-2 as text, map_server as a number."""
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
