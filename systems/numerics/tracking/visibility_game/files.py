"""Solved visibility games on disk: one NumPy archive with a version and checksums.

An archive holds the arrays of a `GuaranteedTimes` as they are, and a description of all other
values. The description comes last because it holds the checksums of the arrays. The archive
contains no code.
"""

import json
import os
import typing
import zipfile
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from ...errors import InvalidInput, require
from ...files import written_whole
from .guaranteed_times import GuaranteedTimes
from .planes import TILE

FORMAT = "sightfield visibility game"
VERSION = 3

# Name of the description in the archive, and of its entry with the checksums.
ABOUT, SUMS = "about.json", "checksums"


def save_guaranteed_times(table: GuaranteedTimes, path: str | os.PathLike[str]) -> None:
    """Write a table to a temporary file and rename it, so that a file is never incomplete.

    Args:
        table: What to save.
        path: Where; no suffix is added to the name.

    Raises:
        InvalidInput: The folder does not exist or cannot be written to, or the path is a folder.
        OSError: The disk is full.
    """
    with written_whole(path) as file:
        _write(table, file)


def load_guaranteed_times(path: str | os.PathLike[str]) -> GuaranteedTimes:
    """Read what `save_guaranteed_times` wrote.

    Args:
        path: The file.

    Raises:
        InvalidInput: The file is missing, truncated, changed, foreign or of another version.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            return _read(archive, path)
    except InvalidInput:
        raise
    except OSError as error:
        raise InvalidInput(f"`file` must be readable; got {path}: {error.strerror}") from None
    except zipfile.BadZipFile as error:
        raise InvalidInput(f"`file` must be a whole {FORMAT}; got {path}: {error}") from None
    except (ValueError, KeyError, TypeError, AttributeError, EOFError, RuntimeError, MemoryError):
        raise InvalidInput(f"`file` must be a whole {FORMAT}; got {path}") from None


def _write(table: GuaranteedTimes, file: typing.BinaryIO) -> None:
    about: dict[str, Any] = {"format": FORMAT, "version": VERSION, "tile": TILE}
    with zipfile.ZipFile(file, "w") as archive:
        for name, value in _entries(table):
            if isinstance(value, np.ndarray):
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    np.lib.format.write_array(member, value, allow_pickle=False)
            else:
                about[name] = value
        about[SUMS] = {info.filename: info.CRC for info in archive.infolist()}
        archive.writestr(ABOUT, json.dumps(about))


def _read(archive: zipfile.ZipFile, path: object) -> GuaranteedTimes:
    infos = {info.filename: info for info in archive.infolist()}
    require(ABOUT in infos, "file", f"be a {FORMAT}", path)
    about = json.loads(archive.read(ABOUT))
    is_ours = isinstance(about, dict) and about.get("format") == FORMAT
    require(is_ours, "file", f"be a {FORMAT}", path)
    version = about.get("version"), about.get("tile")
    require(version == (VERSION, TILE), "file", f"have version {VERSION} of the format", version[0])
    sums = {name: info.CRC for name, info in infos.items() if name != ABOUT}
    require(about[SUMS] == sums, "file", "match its checksums", path)

    def value_of(name: str, kind: Any) -> Any:
        if hasattr(kind, "_fields"):
            kinds = typing.get_type_hints(kind)
            return kind(*(value_of(f"{name}.{each}", kinds[each]) for each in kind._fields))
        if kind is np.ndarray:
            with archive.open(f"{name}.npy") as member:
                array = np.lib.format.read_array(member, allow_pickle=False)
                # The checksum is verified when the end of the entry is read.
                require(member.read(1) == b"", "file", "match its checksums", path)
            return array
        return kind(about[name])

    kinds = typing.get_type_hints(GuaranteedTimes)
    return GuaranteedTimes(**{each: value_of(each, kinds[each]) for each in _names()})


def _entries(table: GuaranteedTimes) -> Iterator[tuple[str, Any]]:
    """Name and value of every field of a table, with named tuples taken apart."""

    def parts(name: str, value: Any) -> Iterator[tuple[str, Any]]:
        if hasattr(value, "_fields"):
            for each in value._fields:
                yield from parts(f"{name}.{each}", getattr(value, each))
        else:
            yield name, value

    for each in _names():
        yield from parts(each, getattr(table, each))


def _names() -> list[str]:
    return [field.name for field in fields(GuaranteedTimes)]
