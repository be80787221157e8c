"""Pictures on their way to a homeserver, kept in a folder so that a restart loses none."""

import json
import logging
from pathlib import Path

from ...systems.numerics.social.network.interface import Picture
from .picture_events import transaction_of

_LOG = logging.getLogger(__name__)


class Outbox:
    """Files of pictures that are not posted yet.

    A file is a line of JSON and then the picture's own bytes. It is written under another name
    and moved, so that a file that is there is whole.

    Args:
        folder: Where they are; made if need be. None: nothing is kept.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder, self._last = folder, 0
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            numbers = [int(file.name.split("-")[0]) for file in self._files()]
            self._last = max(numbers, default=0)

    def keep(self, picture: Picture, run: str) -> None:
        """Keep a run's picture until it is done, behind the earlier ones."""
        if self._folder is None:
            return
        self._last += 1
        head = {"id": picture.id, "run": run, "agent": picture.agent, "time": picture.time}
        name = f"{self._last:010d}-{transaction_of(picture, run)}"
        new = self._folder / f"{name}.new"
        new.write_bytes(json.dumps(head).encode() + b"\n" + picture.data)
        new.replace(self._folder / f"{name}.picture")

    def done(self, picture: Picture, run: str) -> None:
        """A picture is posted: forget it.

        Args:
            picture: Which.
            run: It belongs to.
        """
        if self._folder is not None:
            for file in self._folder.glob(f"*-{transaction_of(picture, run)}.picture"):
                file.unlink()

    def waiting(self) -> list[tuple[Picture, str]]:
        """Pictures that are there, each with its run, in their order.

        Files that are none are left alone.
        """
        found = []
        for file in self._files():
            head, _, data = file.read_bytes().partition(b"\n")
            try:
                fields = json.loads(head)
                picture = Picture(
                    id=str(fields["id"]),
                    agent=int(fields["agent"]),
                    time=float(fields["time"]),
                    data=data,
                )
                found.append((picture, str(fields["run"])))
            except (ValueError, KeyError, TypeError):
                _LOG.warning("%s holds no picture", file)
        return found

    def _files(self) -> list[Path]:
        if self._folder is None:
            return []
        return sorted(self._folder.glob("[0-9]*-*.picture"))
