"""A log, read back."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...systems.numerics.errors import InvalidInput, require
from .log_format import (
    ABOUT,
    END,
    LONGEST,
    MAGIC,
    MEMORY,
    PICTURE,
    SAMPLES,
    Record,
    lost_records,
    records,
)
from .mcap_log import is_mcap, read_mcap_records

# No gap is said to be longer [ticks].
_MOST_TICKS = 1e12


@dataclass(frozen=True, eq=False)
class RunLog:
    """What was recorded.

    Attributes:
        about: What the writer said beside.
        times: Of the samples in the diagram, rising, shape (T,) [s].
        samples: Of each port by name, shape (T, size).
        pictures: Of each port of pictures: time [s] and picture, as PNG, when it changed.
        complete: Whether the writer closed it; a run that crashed did not.
        unread: Bytes at the end of a record that was never finished.
        lost: Records that are damaged, chunks in MCAP, or ticks between others that are not there.
        memory: What the diagram kept after ticks: time [s] and state of each of its systems by
            name, each of shape (size,).
    """

    about: dict[str, Any]
    times: np.ndarray
    samples: dict[str, np.ndarray]
    pictures: dict[str, list[tuple[float, bytes]]]
    complete: bool
    unread: int
    lost: int = 0
    memory: list[tuple[float, dict[str, np.ndarray]]] = field(default_factory=list)


def read_run_log(path: Path) -> RunLog:
    """Read everything of a log that is whole, of ours or in MCAP.

    Raises:
        InvalidInput: It is no log, nothing in it is whole, its header is not one, or it is MCAP and
            the extra is not installed.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InvalidInput(
            f"`log` must be a readable file; got {path} ({error.strerror})"
        ) from None
    mcap = not data.startswith(MAGIC) and is_mcap(data)
    there = read_mcap_records(data) if mcap else None
    found = list(records(data)) if there is None else there.records
    require(bool(found) and found[0].kind == ABOUT, "log", "be a log of a run", path)
    header = _header(found[0].body, path)
    ports, pictured = header["ports"], header["pictures"]
    times, columns = _vectors([each for each in found if each.kind == SAMPLES], ports, path)
    pictures: dict[str, list[tuple[float, bytes]]] = {name: [] for name in pictured}
    for each in found:
        if each.kind == PICTURE:
            number = int.from_bytes(each.body[:2], "little")
            require(number < len(pictured), "log", "have pictures of its own ports", path)
            pictures[pictured[number]].append((each.time, each.body[2:]))
    kept = [each for each in found if each.kind == MEMORY]
    kept_times, kept_columns = _vectors(kept, header["memory"], path)
    sizes = {
        ABOUT: len(found[0].body),
        SAMPLES: 8 * sum(ports.values()),
        MEMORY: 8 * sum(header["memory"].values()),
    }
    if there is None:
        complete, (damaged, unread) = found[-1].kind == END, lost_records(data, found, sizes)
    else:
        complete, damaged, unread = there.complete, there.damaged, there.unread
    return RunLog(
        about=header["about"],
        times=times,
        samples=columns,
        pictures=pictures,
        complete=complete,
        unread=unread,
        lost=max(damaged, _missing(times)),
        memory=[
            (float(time), {name: column[row] for name, column in kept_columns.items()})
            for row, time in enumerate(kept_times)
        ],
    )


def _header(body: bytes, path: Path) -> dict[str, Any]:
    """What a log says of itself, checked."""
    header: Any = None
    try:
        header = json.loads(body)
        # Halves of characters are no text: nothing could print them.
        json.dumps(header, ensure_ascii=False).encode()
    # What is nested a thousand deep is no header either.
    except (ValueError, RecursionError):
        header = None
    require(isinstance(header, dict), "log", "have a header in JSON", path)
    header = {"memory": {}, **header}
    for key in ("ports", "memory"):
        sizes: Any = header.get(key)
        good = isinstance(sizes, dict) and all(
            name.isprintable() and type(size) is int and size >= 0 for name, size in sizes.items()
        )
        good = good and 8 * sum(sizes.values()) <= LONGEST
        require(good, "log", f"have {key} with their sizes in its header", path)
    names = header.get("pictures")
    good = isinstance(names, list) and all(isinstance(n, str) and n.isprintable() for n in names)
    require(good, "log", "have names of pictures in its header", path)
    require(isinstance(header.get("about"), dict), "log", "say in its header what it is of", path)
    return header


def _vectors(
    rows: list[Record], sizes: dict[str, int], path: Path
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times of records and what they hold of each name."""
    size = sum(sizes.values())
    require(all(len(row.body) == 8 * size for row in rows), "log", "have whole samples", path)
    times = np.array([row.time for row in rows])
    steps = np.diff(times)
    rising = bool(np.isfinite(times).all() and np.isfinite(steps).all() and (steps > 0).all())
    require(rising, "log", "have samples whose times rise", path)
    table = np.array([np.frombuffer(row.body, dtype="<f8") for row in rows])
    table = table.reshape(len(rows), size)
    columns = np.split(table, np.cumsum(list(sizes.values()))[:-1], axis=1) if sizes else []
    return times, dict(zip(sizes, columns, strict=True))


def _missing(times: np.ndarray) -> int:
    """How many ticks are not there: before others, as all are equally far apart."""
    if len(times) < 2:
        return 0
    gaps = np.diff(times)
    ticks = np.rint(np.clip(gaps / np.median(gaps), 1, _MOST_TICKS))
    return int((ticks - 1).sum())
