"""Calibration pictures, simulated or real: a shell at a known place in each.

In a folder, a table or the names say where each shell stood. A table `shells.csv` has a row for
each picture, and columns `file`, one of `distance_m` and `distance_in`, and one of `bearing_rad`
and `bearing_deg`. Without it, names say it, with a distance in m, cm, mm or in and a bearing in
deg or rad: `15in_90deg.png`, `red_0.381m_-1.57rad.jpg`, `381mm_90deg_second_try.png`. Distances
are from the mirror's axis to the shell's near side, bearings counter-clockwise from the robot's
front.
"""

import csv
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...errors import InvalidInput, require, require_positive
from ...geometry.world import make_world
from ..omni_optics import OmniCamera, make_ray_table
from ..rendering import render
from ..sensor import Sensor, expose
from ..surroundings import Shell, Surroundings
from .calibration import INCH, Calibration, Readings, calibrate
from .pictures import SUFFIXES, load_picture, require_contrast, require_size, save_picture
from .range_models import exact_pixel_radius
from .shell_detection import Outcome, ShellColour, ShellDetection, detect_shells
from .shell_estimate import ShellEstimate, estimate_shell

# How far beyond the farthest shell the walls of the simulated room are [m].
_ROOM = 2.0
# Bearings a third of a degree apart; more are a slip of the finger that would take days.
_MOST_DIRECTIONS = 1080


class LabelledPicture(NamedTuple):
    """One calibration picture.

    Attributes:
        name: For messages, as a file's.
        distance: From the mirror's axis to the shell's near side [m].
        bearing: Of the shell from the robot's front, counter-clockwise [rad].
        picture: Red, green, blue, shape (height, width, 3), uint8.
    """

    name: str
    distance: float
    bearing: float
    picture: np.ndarray


class _Place(NamedTuple):
    """Where the shell of a picture stood: name, distance [m], bearing [rad]."""

    name: str
    distance: float
    bearing: float


def simulated_pictures(
    camera: OmniCamera,
    sensor: Sensor,
    shell: Shell,
    *,
    distances: Sequence[float],
    directions: int,
) -> Iterator[LabelledPicture]:
    """Take the pictures of 2.2.4.2 with a simulated camera in an empty room.

    Args:
        camera: The true optics.
        sensor: Quality of the pictures.
        shell: What is placed.
        distances: From the axis to the shell's near side [m].
        directions: Number of bearings, evenly round the robot from its front on.

    Raises:
        InvalidInput: No direction or too many, or a distance is not positive.
    """
    require(directions > 0, "directions", "be positive", directions)
    require(
        directions <= _MOST_DIRECTIONS, "directions", f"be at most {_MOST_DIRECTIONS}", directions
    )
    for distance in distances:
        require_positive("distances", distance)
    half = max(distances) + 2 * shell.radius + _ROOM
    corners = [[-half, -half], [half, -half], [half, half], [-half, half]]
    room, rays = Surroundings(world=make_world(corners, [])), make_ray_table(camera)

    def taken() -> Iterator[LabelledPicture]:
        for row, distance in enumerate(distances):
            for column in range(directions):
                bearing = math.remainder(2 * math.pi * column / directions, 2 * math.pi)
                at = (distance + shell.radius) * np.array([[math.cos(bearing), math.sin(bearing)]])
                light = render(camera, rays, room, (0.0, 0.0, 0.0), [shell], at)
                picture = expose(sensor, light, row * directions + column)[:, :, :3]
                name = f"{1000 * distance:.1f}mm_{math.degrees(bearing):.2f}deg.png"
                yield LabelledPicture(name, distance, bearing, picture)

    # What is asked for is checked when it is asked for, and not with the first picture.
    return taken()


# Shells are read by their base alone first; then so many times by their outline, with the optics
# fitted to the readings before.
_PASSES = 2
# Blobs are as wide as their shells to this share, or to so many pixels.
_WIDTH_SHARE, _WIDTH_PIXELS = 0.03, 0.7


def read_pictures(
    pictures: Iterable[LabelledPicture],
    camera: OmniCamera,
    colour: ShellColour,
    *,
    base: float,
    shell_radius: float,
    shell_top: float,
) -> tuple[Readings, list[str]]:
    """Find the shell in each picture.

    A reading is where the fitted outline has its base, by the same fit that will measure ranges
    with the calibration: its errors are in both, and cancel in the ranges.

    Args:
        pictures: With known places.
        camera: The optics as measured with a ruler.
        colour: Of the shell.
        base: Height of the shells' bottom edges above the floor [m].
        shell_radius: Of the shells [m].
        shell_top: Height of their top edges above the floor [m].

    Returns:
        The readings, and a line "name: reason" for each picture without a whole shell in it.

    Raises:
        InvalidInput: A picture of another size or all one colour, too few shells are found, they
            fit no such mirror, or are wider or narrower than shells at such distances: the ruler
            was wrong, which readings of bases alone do not tell.
    """
    sizes = {"base": base, "shell_radius": shell_radius, "shell_top": shell_top}
    found, skipped = _detect(pictures, camera, colour)
    _require_widths(found, shell_radius)
    readings = Readings(
        distance=np.array([label.distance for label, _ in found]),
        bearing=np.array([label.bearing for label, _ in found]),
        pixels=np.array([detection.pixel for _, detection in found]),
    )
    for _ in range(_PASSES):
        known = calibrate(readings, camera=camera, **sizes)
        whole = []
        for place, detection in found:
            estimate = estimate_shell(_seen_by(known, camera, detection), known)
            if estimate.outcome in (Outcome.SEEN, Outcome.OUTSIDE_CALIBRATION):
                whole.append((place, detection, estimate))
            else:
                skipped.append(f"{place.name}: {estimate.outcome.words}")
        _require_some(whole, colour, skipped)
        found = [(place, detection) for place, detection, _ in whole]
        readings = _readings(
            [place for place, _ in found], [estimate for *_, estimate in whole], known
        )
    return readings, skipped


def _detect(
    pictures: Iterable[LabelledPicture], camera: OmniCamera, colour: ShellColour
) -> tuple[list[tuple[_Place, ShellDetection]], list[str]]:
    found, skipped = [], []
    for name, distance, bearing, picture in pictures:
        require_size(picture, camera.width, camera.height, name)
        require_contrast(picture, name)
        (detection,) = detect_shells(picture, [colour], camera.axis_pixel)
        if detection.outcome.has_estimate:
            found.append((_Place(name, distance, bearing), detection))
        else:
            skipped.append(f"{name}: {detection.outcome.words}")
    _require_some(found, colour, skipped)
    return found, skipped


def _require_some(found: Sequence[object], colour: ShellColour, skipped: list[str]) -> None:
    reason = skipped[0] if skipped else "none at all"
    require(len(found) > 0, "pictures", f"show {colour.name} shells", reason)


def _require_widths(found: Sequence[tuple[_Place, ShellDetection]], shell_radius: float) -> None:
    """Refuse distances at which shells would be wider or narrower; mirrors keep bearings."""
    expected = np.array(
        [2 * math.asin(shell_radius / (place.distance + shell_radius)) for place, _ in found]
    )
    width = np.array([detection.width for _, detection in found])
    radius = np.array([detection.pixel_radius for _, detection in found])
    share = float(np.median(width / expected)) - 1
    pixels = float(np.median((width - expected) * radius))
    require(
        abs(share) <= _WIDTH_SHARE or abs(pixels) <= _WIDTH_PIXELS,
        "pictures",
        "show shells as wide as their distances and radius say",
        f"shells that are {abs(share):.0%} {'wider' if share > 0 else 'narrower'}",
    )


def _seen_by(known: Calibration, camera: OmniCamera, detection: ShellDetection) -> ShellDetection:
    """What was detected with the axis of one camera, for a calibrated one."""
    assert detection.window is not None
    moved = known.camera.axis_pixel - camera.axis_pixel
    window = replace(detection.window, axis=detection.window.axis + moved)
    return replace(detection, window=window)


def _readings(
    places: Sequence[_Place], estimates: Sequence[ShellEstimate], known: Calibration
) -> Readings:
    """Where a calibrated camera shows the near points of the bases of shells it has measured."""
    turn = np.array([each.bearing for each in estimates])
    radius = exact_pixel_radius(
        [each.range for each in estimates], camera=known.camera, base=known.base
    )
    ways = np.column_stack([np.sin(turn), -np.cos(turn)])
    return Readings(
        distance=np.array([each.distance for each in places]),
        bearing=np.array([each.bearing for each in places]),
        pixels=known.camera.axis_pixel + radius[:, None] * ways,
    )


TABLE = "shells.csv"
_LENGTHS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": INCH}
_ANGLES = {"rad": 1.0, "deg": math.pi / 180}
_NUMBER = r"\d+(?:\.\d+)?"
_NAME = re.compile(
    rf"(?:[^_]*_)?(?P<distance>{_NUMBER})(?P<length>mm|cm|in|m)"
    rf"_(?P<bearing>[+-]?{_NUMBER})(?P<angle>deg|rad)(?:_.*)?"
)


class Label(NamedTuple):
    """Where a shell stood: its picture's file, distance [m], bearing in (-pi, pi] [rad]."""

    file: Path
    distance: float
    bearing: float


def read_labels(folder: str | Path) -> list[Label]:
    """What a folder says of its pictures, without opening them.

    Raises:
        InvalidInput: No folder, no pictures, a table without the columns or with other things
            than numbers, or a name that says no place.
    """
    folder = Path(folder)
    require(folder.is_dir(), "pictures", "be a folder", folder)
    labels = _by_table(folder) if (folder / TABLE).is_file() else _by_names(folder)
    require(len(labels) > 0, "pictures", f"hold {', '.join(SUFFIXES)} files", f"none in {folder}")
    return labels


def load_pictures(labels: Iterable[Label]) -> Iterator[LabelledPicture]:
    """Open the pictures one by one.

    Raises:
        InvalidInput: See `load_picture`.
    """
    for label in labels:
        yield LabelledPicture(
            label.file.name, label.distance, label.bearing, load_picture(label.file)
        )


def save_pictures(folder: Path, pictures: Iterable[LabelledPicture]) -> int:
    """Write pictures and their table into a folder; returns their number."""
    rows = []
    for name, distance, bearing, picture in pictures:
        save_picture(folder / name, picture)
        rows.append((name, repr(distance), repr(bearing)))
    with (folder / TABLE).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([("file", "distance_m", "bearing_rad"), *rows])
    return len(rows)


def _by_table(folder: Path) -> list[Label]:
    path = folder / TABLE
    try:
        with path.open(newline="", encoding="utf-8") as file:
            reader = csv.DictReader(file, skipinitialspace=True)
            columns, rows = reader.fieldnames or [], list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InvalidInput(f"`{TABLE}` must be a readable table; got {error}") from None
    require("file" in columns, TABLE, "have a column file", ", ".join(columns))
    length, angle = _unit(columns, "distance", "m in"), _unit(columns, "bearing", "rad deg")
    labels = []
    for number, row in enumerate(rows, start=2):
        where = f"{TABLE}, line {number}"
        file = folder / str(row["file"])
        require(file.is_file(), where, "name a file in the folder", row["file"])
        labels.append(
            _label(
                where,
                file,
                _number(where, row[f"distance_{length}"]) * _LENGTHS[length],
                _number(where, row[f"bearing_{angle}"]) * _ANGLES[angle],
            )
        )
    return labels


def _unit(columns: Iterable[str], quantity: str, units: str) -> str:
    names = [f"{quantity}_{unit}" for unit in units.split()]
    there = [name for name in names if name in columns]
    require(len(there) == 1, TABLE, f"have one column of {', '.join(names)}", ", ".join(columns))
    return there[0].removeprefix(f"{quantity}_")


def _number(where: str, text: object) -> float:
    try:
        return float(str(text))
    except ValueError:
        raise InvalidInput(f"`{where}` must hold numbers; got {text}") from None


def _by_names(folder: Path) -> list[Label]:
    labels = []
    for file in sorted(folder.iterdir()):
        if file.suffix.lower() not in SUFFIXES:
            continue
        match = _NAME.fullmatch(file.stem)
        if match is None:
            raise InvalidInput(
                f"`pictures` must have names as 15in_90deg.png, or a table {TABLE}; got {file.name}"
            )
        distance = float(match["distance"]) * _LENGTHS[match["length"]]
        bearing = float(match["bearing"]) * _ANGLES[match["angle"]]
        labels.append(_label(file.name, file, distance, bearing))
    return labels


def _label(where: str, file: Path, distance: float, bearing: float) -> Label:
    require(0 < distance < math.inf, where, "have a positive distance", distance)
    require(math.isfinite(bearing), where, "have a finite bearing", bearing)
    return Label(file, distance, math.remainder(bearing, 2 * math.pi))
