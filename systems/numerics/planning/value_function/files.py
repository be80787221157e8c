"""Value functions on disk: one NumPy archive with a version, the parameters and a checksum."""

import json
import os
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from ...errors import InvalidInput, require
from ...files import written_whole
from ..goal import Goal
from ..trailer import Trailer
from .grid import StateGrid
from .known_words import KnownWords
from .obstacles import Walls
from .policy import way_time
from .value_function import ValueFunction

FORMAT = "sightfield value function"
VERSION = 3


def save_value_function(value: ValueFunction, path: str | os.PathLike[str]) -> None:
    """Write to a temporary name and move, so that a file is whole or is not there.

    Args:
        value: What to save.
        path: Where; the name is kept as it is.

    Raises:
        InvalidInput: The folder does not exist or cannot be written to, or the path is a folder.
    """
    about = {
        "format": FORMAT,
        "version": VERSION,
        "grid": asdict(value.grid),
        "trailer": asdict(value.trailer),
        "goal": asdict(value.goal),
        "scheme": value.scheme,
        "sweeps": value.sweeps,
        "residual": value.residual,
        "converged": value.converged,
        "wall_time": value.wall_time,
        "warnings": value.warnings,
        "walls": None if value.walls is None else _walls_about(value.walls),
        "placement": value.placement,
    }
    distance = np.zeros((0, 0)) if value.walls is None else value.walls.distance
    words = {} if value.words is None else value.words._asdict()
    about["checksum"] = _checksum([value.table, distance, *words.values()], about)
    with written_whole(path) as file:
        text = np.array(json.dumps(about))
        np.savez(file, about=text, table=value.table, distance=distance, **words)


def load_value_function(path: str | os.PathLike[str]) -> ValueFunction:
    """Read what `save_value_function` wrote.

    Args:
        path: The file.

    Raises:
        InvalidInput: The file is missing, truncated, changed, foreign or of another version.
    """
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            require(
                isinstance(archive, np.lib.npyio.NpzFile) and "about" in archive.files,
                "file",
                f"be a {FORMAT}",
                path,
            )
            about = json.loads(str(archive["about"]))
            require(
                isinstance(about, dict) and about.get("format") == FORMAT,
                "file",
                f"be a {FORMAT}",
                path,
            )
            require(
                about.get("version") == VERSION,
                "file",
                f"have version {VERSION} of the format",
                about.get("version"),
            )
            table, distance = archive["table"], archive["distance"]
            words = {name: archive[name] for name in KnownWords._fields if name in archive.files}
    except InvalidInput:
        raise
    except OSError as error:
        raise InvalidInput(f"`file` must be readable; got {path}: {error.strerror}") from None
    except (zipfile.BadZipFile, zlib.error, EOFError) as error:
        raise InvalidInput(f"`file` must be whole; got {path}: {error}") from None
    except (ValueError, KeyError, AttributeError, TypeError):
        raise InvalidInput(f"`file` must be a {FORMAT}; got {path}") from None
    try:
        value = ValueFunction(
            table=table,
            grid=StateGrid(**about["grid"]),
            trailer=Trailer(**about["trailer"]),
            goal=Goal(**{key: tuple(entries) for key, entries in about["goal"].items()}),
            scheme=about["scheme"],
            sweeps=about["sweeps"],
            residual=about["residual"],
            converged=about["converged"],
            wall_time=about["wall_time"],
            warnings=tuple(about["warnings"]),
            walls=None if about["walls"] is None else _walls(about["walls"], distance),
            way_time=None if about["walls"] is None else way_time,
            words=KnownWords(**words) if words else None,
            placement=tuple(about["placement"]),
        )
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidInput(f"`file` must have every parameter; got {path}: {error}") from None
    require(
        table.dtype == np.float32 and table.shape == value.grid.shape,
        "file",
        f"have a table of shape {value.grid.shape}",
        table.shape,
    )
    said = about.pop("checksum", None)
    require(
        _checksum([table, distance, *words.values()], about) == said,
        "file",
        "match its checksum",
        path,
    )
    return value


def _walls_about(walls: Walls) -> dict[str, object]:
    """Fields of the walls besides the free distances."""
    about = walls._asdict()
    del about["distance"]
    return about | {"origin": walls.origin.tolist(), "discs": walls.discs.tolist()}


def _walls(about: dict[str, Any], distance: np.ndarray) -> Walls:
    """Walls from their other fields and the free distances."""
    arrays = {key: np.array(about[key], dtype=float) for key in ("origin", "discs")}
    return Walls(**{**about, **arrays, "distance": distance})


def _checksum(arrays: Iterable[np.ndarray], about: dict[str, object]) -> int:
    """Checksum of the arrays and of their description, which has no checksum yet."""
    checksum = 0
    for array in arrays:
        checksum = zlib.crc32(array.tobytes(), checksum)
    return zlib.crc32(json.dumps(about, sort_keys=True).encode(), checksum)
