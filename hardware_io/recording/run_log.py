"""A run in a log: written tick by tick from the ports of a diagram, and read back."""

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from pydrake.systems.framework import InputPort, LeafSystem
from pydrake.systems.sensors import ImageRgba8U

from ...systems.drake_parts import AbstractValue, read
from ...systems.numerics.errors import InvalidInput, require, require_non_negative, require_positive
from .log_records import (
    ABOUT,
    END,
    LONGEST,
    MAGIC,
    MEMORY,
    PICTURE,
    SAMPLES,
    Record,
    RunWriter,
    lost_records,
    records,
)
from .mcap_log import McapRunWriter, is_mcap, read_mcap_records


class PortRecorder(LeafSystem):
    """Writes a sample of every port at each tick, and a picture whenever it has changed.

    There is an input port for each port of the writer, with `_` for the dots in its name. The
    ports below are those of a recorder of `pursuer.poses` (3 N) and `omni_camera.image`.

    .. pydrake_system::

        name: PortRecorder
        input_ports:
        - pursuer_poses
        - omni_camera_image
        output_ports: []

    =================  ===========  =========  =======
    port               size         unit       frame
    =================  ===========  =========  =======
    pursuer_poses      3 N          m, m, rad  world
    omni_camera_image  ImageRgba8U  -          picture
    =================  ===========  =========  =======

    Source: ours.

    Args:
        writer: Writer of the log.
        period: Time between ticks [s].
        offset: Delay after a tick, until all other systems have sampled [s].

    Raises:
        InvalidInput: The period is not positive, or the offset negative.
    """

    def __init__(self, writer: RunWriter | McapRunWriter, *, period: float, offset: float = 0.0):
        super().__init__()
        require_positive("period", period)
        require_non_negative("offset", offset)
        self._writer = writer
        self._ports = [
            self.DeclareVectorInputPort(port_name(name), size)
            for name, size in writer.ports.items()
        ]
        blank = AbstractValue.Make(ImageRgba8U())
        self._pictures: list[tuple[str, InputPort]] = [
            (name, self.DeclareAbstractInputPort(port_name(name), blank))
            for name in writer.pictures
        ]
        # Last written pictures; not a declared state, as it only avoids writing one twice.
        self._written: dict[str, np.ndarray] = {}
        self.DeclarePeriodicPublishEvent(period, offset, self._record)

    def _record(self, context):
        time = context.get_time()
        self._writer.samples(time, np.concatenate([read(port, context) for port in self._ports]))
        for name, port in self._pictures:
            image: Any = port.Eval(context)
            last = self._written.get(name)
            if last is None or not np.array_equal(image.data, last):
                self._written[name] = np.array(image.data)
                blue_first = cv2.cvtColor(image.data, cv2.COLOR_RGBA2BGRA)
                _, png = cv2.imencode(".png", blue_first, [cv2.IMWRITE_PNG_COMPRESSION, 1])
                self._writer.picture(time, name, png.tobytes())


def port_name(name: str) -> str:
    """Name of a recorder's input port for a port of the station.

    Args:
        name: Of the station's port.
    """
    return name.replace(".", "_")


# Longer gaps are reported as this [ticks].
_MOST_TICKS = 1e12


@dataclass(frozen=True, eq=False)
class RunLog:
    """A recorded run.

    Attributes:
        about: The writer's further information on the run.
        times: Times of the samples in the diagram, rising, shape (T,) [s].
        samples: Samples of each port by name, shape (T, size).
        pictures: For each picture port, time [s] and PNG of each picture, when it changed.
        complete: Whether the writer closed the log; after a crash it did not.
        unread: Bytes of an unfinished record at the end.
        lost: Number of damaged records (in MCAP, chunks) or of missing ticks, whichever is greater.
        memory: States of the diagram after ticks: time [s], and state of each system by name,
            shape (size,).
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
    """Read all intact parts of a log, in our format or in MCAP.

    Raises:
        InvalidInput: It is no log, nothing in it is intact, its header is invalid, or it is MCAP
            and the extra is not installed.
    """
    # A device or a pipe may have no end.
    endless = path.exists() and not (path.is_file() or path.is_dir())
    require(not endless, "log", "be a readable file", path)
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
    """Decode and check the header of a log."""
    header: Any = None
    try:
        header = json.loads(body)
        # Refuse lone surrogates, which could not be printed.
        json.dumps(header, ensure_ascii=False).encode()
    # RecursionError: the JSON is nested too deeply.
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
    """Times of records, and their values by name."""
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
    """Number of missing ticks between samples, by the median interval."""
    if len(times) < 2:
        return 0
    gaps = np.diff(times)
    ticks = np.rint(np.clip(gaps / np.median(gaps), 1, _MOST_TICKS))
    return int((ticks - 1).sum())
