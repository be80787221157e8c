"""Folders of calibration pictures: where each shell stood is said by a table or by the names.

A table `shells.csv` has a row for each picture, and columns
`file`, one of `distance_m` and `distance_in`, and one of `bearing_rad` and `bearing_deg`.
Without it, names say it, with a distance in m, cm, mm or in and a bearing in deg or rad:
`15in_90deg.png`, `red_0.381m_-1.57rad.jpg`, `381mm_90deg_second_try.png`. Distances
are from the mirror's axis to the shell's near side, bearings counter-clockwise from the robot's
front.
"""

import csv
import math
import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from ...errors import InvalidInput, require
from .labelled_pictures import LabelledPicture
from .pictures import SUFFIXES, load_picture, save_picture
from .readings import INCH

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
