"""A log that is written while the run goes on, and is whole up to the moment of a crash."""

import json
import os
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ...diagrams.outputs import RunRecord, open_record
from ...systems.numerics.errors import InvalidInput
from .log_format import ABOUT, END, MAGIC, MEMORY, PICTURE, SAMPLES, pack

# What the disk may lose when the machine itself fails [s].
_SYNC_PERIOD = 1.0


class RunWriter(RunRecord):
    """Writes a log, each record at once: a crash of the program loses none of them.

    Args:
        path: Of the log; must not exist.
        ports: Sizes of the ports by name, in the order of the samples.
        pictures: Names of the ports of pictures.
        memory: Sizes of what the diagram keeps from tick to tick, by the names of its systems.
        about: What else is to be known, ready for JSON.

    Raises:
        InvalidInput: The file exists, or cannot be written.
    """

    def __init__(
        self,
        path: Path,
        *,
        ports: Mapping[str, int],
        pictures: tuple[str, ...] = (),
        memory: Mapping[str, int] | None = None,
        about: Mapping[str, Any] | None = None,
    ) -> None:
        self.path = path
        self.ports = dict(ports)
        self.pictures = tuple(pictures)
        self._size = sum(self.ports.values())
        self._synced = time.monotonic()
        self._file = open_record(path, buffered=False)
        self._memory_size = sum((memory or {}).values())
        header = {
            "ports": self.ports,
            "pictures": self.pictures,
            "memory": dict(memory or {}),
            "about": about or {},
        }
        # Twice: without it the samples are mere numbers.
        self._write(MAGIC + 2 * pack(ABOUT, 0.0, json.dumps(header).encode()))

    def samples(self, time: float, values: np.ndarray) -> None:
        """Write a sample of every port, joined in order, shape (sum of the sizes,).

        Args:
            time: [s].
            values: Shape (sum of the sizes,).
        """
        assert values.shape == (self._size,)
        self._write(pack(SAMPLES, time, values.astype("<f8").tobytes()))

    def picture(self, time: float, port: str, png: bytes) -> None:
        """Write a picture that a port has shown from now on, as PNG.

        Args:
            time: [s].
            port: Its name.
            png: The picture's file.
        """
        number = self.pictures.index(port).to_bytes(2, "little")
        self._write(pack(PICTURE, time, number + png))

    def memory(self, time: float, values: np.ndarray) -> None:
        """Write what the diagram keeps after a tick: a replay goes on from it after damage.

        Args:
            time: [s].
            values: Shape (sum of the sizes,).
        """
        assert values.shape == (self._memory_size,)
        self._write(pack(MEMORY, time, values.astype("<f8").tobytes()))

    def close(self) -> None:
        """See `RunRecord`."""
        if not self._file.closed:
            self._write(pack(END, 0.0, b""))
            os.fsync(self._file.fileno())
            self._file.close()

    def leave(self) -> None:
        """See `RunRecord`."""
        self._file.close()

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        try:
            # A file without a buffer may take a part.
            while view:
                view = view[self._file.write(view) :]
            if time.monotonic() - self._synced > _SYNC_PERIOD:
                os.fsync(self._file.fileno())
                self._synced = time.monotonic()
        except OSError as error:
            raise InvalidInput(
                f"`log` must be on a disk with room; got {self.path} ({error.strerror})"
            ) from None
