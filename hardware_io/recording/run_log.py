"""A log, read back."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...systems.numerics.errors import InvalidInput, require
from .log_format import ABOUT, END, PICTURE, SAMPLES, records


@dataclass(frozen=True, eq=False)
class RunLog:
    """What was recorded.

    Attributes:
        about: What the writer said beside.
        times: Of the samples in the diagram, shape (T,) [s].
        samples: Of each port by name, shape (T, size).
        pictures: Of each port of pictures: time [s] and picture, as PNG, when it changed.
        complete: Whether the writer closed it; a run that crashed did not.
        unread: Bytes at the end that are no whole record.
    """

    about: dict[str, Any]
    times: np.ndarray
    samples: dict[str, np.ndarray]
    pictures: dict[str, list[tuple[float, bytes]]]
    complete: bool
    unread: int


def read_run_log(path: Path) -> RunLog:
    """Read a log, up to where it is damaged or cut off.

    Raises:
        InvalidInput: It is no log, or nothing in it is whole.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InvalidInput(
            f"`log` must be a readable file; got {path} ({error.strerror})"
        ) from None
    found = list(records(data))
    require(bool(found) and found[0].kind == ABOUT, "log", "be a log of a run", path)
    header = json.loads(found[0].body)
    ports, pictured = header["ports"], header["pictures"]
    rows = [each for each in found if each.kind == SAMPLES]
    size = sum(ports.values())
    require(all(len(row.body) == 8 * size for row in rows), "log", "have whole samples", path)
    table = np.array([np.frombuffer(row.body, dtype="<f8") for row in rows]).reshape(-1, size)
    columns = np.split(table, np.cumsum(list(ports.values()))[:-1], axis=1)
    pictures: dict[str, list[tuple[float, bytes]]] = {name: [] for name in pictured}
    for each in found:
        if each.kind == PICTURE:
            name = pictured[int.from_bytes(each.body[:2], "little")]
            pictures[name].append((each.time, each.body[2:]))
    return RunLog(
        about=header["about"],
        times=np.array([row.time for row in rows]),
        samples=dict(zip(ports, columns, strict=True)),
        pictures=pictures,
        complete=found[-1].kind == END,
        unread=len(data) - found[-1].end,
    )
