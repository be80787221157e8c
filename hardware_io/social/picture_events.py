"""Pictures as messages of a room, there and back.

A picture is an ordinary image message, so that any Matrix client shows it. Beside it stands, under
"net.sightfield.picture", what a message lacks: the run that it belongs to, its id and time there,
and a digest. Messages from elsewhere, without that, are pictures too: named by their event, taken
when they were sent.
"""

import hashlib
import math
from dataclasses import dataclass
from typing import Any

from ...systems.numerics.social.network.interface import Picture

_KEY = "net.sightfield.picture"


@dataclass(frozen=True)
class PostedPicture:
    """A picture that is known to be in an album, without its file.

    Attributes:
        id: As in `Picture`.
        run: To which id and time belong; None for a picture from elsewhere.
        time: As in `Picture`; from elsewhere, since 1970 [s].
        address: Of the file on the server, mxc://.
        digest: SHA-256 of the file, in hexadecimal; None if unknown.
    """

    id: str
    run: str | None
    time: float
    address: str
    digest: str | None

    def fits(self, data: bytes) -> bool:
        """Whether a file is the whole of this picture, as far as that is known.

        Args:
            data: The file.
        """
        return self.digest in (None, _digest(data))


def media_type(data: bytes) -> str:
    """Of a file, by its first bytes.

    Args:
        data: The file.
    """
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "image/png"
    return "image/jpeg" if data.startswith(b"\xff\xd8\xff") else "application/octet-stream"


def message_of(picture: Picture, run: str, address: str) -> dict[str, Any]:
    """The message that posts a run's picture whose file is at an address of the server."""
    own = {"id": picture.id, "run": run, "time": repr(picture.time)}
    return {
        "msgtype": "m.image",
        "body": picture.id,
        "url": address,
        "info": {"mimetype": media_type(picture.data), "size": len(picture.data)},
        # A message holds no fractions.
        _KEY: own | {"sha256": _digest(picture.data)},
    }


def transaction_of(picture: Picture, run: str) -> str:
    """The same for the same picture, so that the server takes it once however often it is sent."""
    return hashlib.sha256(f"{len(run)} {run} {picture.id}".encode()).hexdigest()[:32]


def posted_picture(event: dict[str, Any]) -> PostedPicture | None:
    """What an event of a room says of a picture; None if it is not about one.

    Members write what they like into events: nothing is taken for granted.
    """
    content, event_id, sent = (
        event.get(name) for name in ("content", "event_id", "origin_server_ts")
    )
    if event.get("type") != "m.room.message" or not isinstance(content, dict):
        return None
    address = content.get("url")
    if content.get("msgtype") != "m.image" or not isinstance(address, str):
        return None
    if not address.startswith("mxc://") or not isinstance(event_id, str):
        return None
    seconds = sent / 1000 if isinstance(sent, int) else 0.0
    own = content.get(_KEY)
    fields = own if isinstance(own, dict) else {}
    name, run, digest = (fields.get(each) for each in ("id", "run", "sha256"))
    if not isinstance(name, str) or not isinstance(run, str):
        return PostedPicture(event_id, None, seconds, address, None)
    digest = digest if isinstance(digest, str) else None
    return PostedPicture(name, run, _finite(fields.get("time"), seconds), address, digest)


def _finite(text: object, otherwise: float) -> float:
    try:
        value = float(text)  # type: ignore[arg-type]  # anything may come, and is tried
    except (TypeError, ValueError):
        return otherwise
    return value if math.isfinite(value) else otherwise


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
