"""Communication with a homeserver: retries, following its news, pictures as messages.

A call that fails is repeated, unless the homeserver refuses it for good. A background thread waits
for slow answers, so that no caller has to, and carries out errands in their order, each until it is
done.

A picture is an ordinary image message, so that any Matrix client shows it. Under
"net.sightfield.picture" the message also holds the run that the picture belongs to, its id and time
there, and a digest. Image messages from elsewhere, without that key, are pictures too: their id is
that of the event, and their time is when they were sent.
"""

import asyncio
import hashlib
import logging
import math
import threading
import time
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from typing import Any

import aiohttp
import nio

from ...systems.numerics.social.network.interface import Picture
from .accounts import ServerRefusal

_KEY = "net.sightfield.picture"


@dataclass(frozen=True)
class PostedPicture:
    """A picture that is known to be in an album, without its file.

    Attributes:
        id: As in `Picture`.
        run: Run to which id and time belong; None for a picture from elsewhere.
        time: As in `Picture`; for a picture from elsewhere, time since 1970 [s].
        address: Address of the file on the server, mxc://.
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
    """Media type of a file, by its first bytes.

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
    """Transaction id of a picture: always the same, so that the server takes it only once."""
    return hashlib.sha256(f"{len(run)} {run} {picture.id}".encode()).hexdigest()[:32]


def posted_picture(event: dict[str, Any]) -> PostedPicture | None:
    """Read a picture's data from an event of a room; None if the event is not a picture.

    Members can write anything into events, so every field is checked.
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


class Background:
    """An event loop in a separate thread.

    The first exception in it is kept, and raised in the caller's thread by `check`.

    Args:
        name: Name of the thread.
    """

    def __init__(self, name: str) -> None:
        self.loop = asyncio.new_event_loop()
        self._failure: BaseException | None = None
        self._tasks: set[asyncio.Task] = set()
        self._thread = threading.Thread(target=self.loop.run_forever, name=name, daemon=True)
        self._thread.start()

    def spawn(self, work: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Start work in the loop; from any thread."""

        def start() -> None:
            task = self.loop.create_task(work())
            self._tasks.add(task)
            task.add_done_callback(self._ended)

        self.loop.call_soon_threadsafe(start)

    def _ended(self, task: asyncio.Task) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and self._failure is None:
            self._failure = task.exception()

    def check(self) -> None:
        """Raise the exception that ended a piece of work, if one did."""
        if self._failure is not None:
            raise self._failure

    def close(self, finish: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Cancel all work, run the finish, and end the thread."""
        if not self._thread.is_alive():
            return

        async def end() -> None:
            # Libraries may swallow a cancellation, so cancel until all tasks have ended.
            while self._tasks:
                for task in list(self._tasks):
                    task.cancel()
                await asyncio.wait(list(self._tasks), timeout=0.2)
            await finish()

        asyncio.run_coroutine_threadsafe(end(), self.loop).result(60)
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join()
        self.loop.close()


class Mailbox:
    """Holds errands until the homeserver has taken them.

    Args:
        background: Where they are carried out.
    """

    def __init__(self, background: Background) -> None:
        self._background = background
        self._errands: asyncio.Queue[Callable[[], Awaitable[object]]] = asyncio.Queue()
        self._waiting, self._lock = 0, threading.Lock()
        background.spawn(self._work)

    @property
    def waiting(self) -> int:
        """How many are not done; a moment later it may be fewer."""
        return self._waiting

    def put(self, errand: Callable[[], Awaitable[object]]) -> None:
        """Put an errand behind the others; from any thread."""
        with self._lock:
            self._waiting += 1
        self._background.loop.call_soon_threadsafe(self._errands.put_nowait, errand)

    async def _work(self) -> None:
        while True:
            errand = await self._errands.get()
            await errand()
            with self._lock:
                self._waiting -= 1


_LOG = logging.getLogger(__name__)

# Waits after failures in a row [s], the last one again and again.
_WAITS = (0.1, 0.2, 0.5, 1.0, 2.0)

# A call that takes longer is taken to hang [s]; a sync waits for news for part of this time.
_LONGEST_CALL = 60.0

# Status codes of client errors after which another attempt may still succeed.
_PASSING = {408, 425, 429}


def make_client(homeserver: str, user: str, token: str) -> nio.AsyncClient:
    """Make a client that does not retry by itself: `persist` does that.

    Args:
        homeserver: Its address.
        user: Name of the account.
        token: Its access token.
    """
    config = nio.AsyncClientConfig(
        max_limit_exceeded=0, max_timeouts=0, request_timeout=30, encryption_enabled=False
    )
    client = nio.AsyncClient(homeserver, user, config=config)
    client.user_id, client.access_token = user, token
    return client


async def persist(call: Callable[[], Awaitable[Any]], what: str) -> Any:
    """Make a call until it succeeds.

    Args:
        call: Makes one attempt; must be harmless if an earlier one succeeded unnoticed.
        what: For the log and for errors.

    Returns:
        The response, never an error.

    Raises:
        ServerRefusal: The server says no for good.
    """
    failures = 0
    while True:
        wait = _WAITS[min(failures, len(_WAITS) - 1)]
        try:
            async with asyncio.timeout(_LONGEST_CALL):
                response = await call()
        # OSError covers connections refused and reset, and time-outs.
        except (aiohttp.ClientError, OSError) as error:
            reason = f"{type(error).__name__} {error}".strip()
        else:
            if not isinstance(response, nio.ErrorResponse):
                return response
            reason = f"{response.status_code} {response.message}".strip()
            if _is_final(response):
                raise ServerRefusal(f"the homeserver refuses to {what}: {reason}")
            wait = max(wait, (response.retry_after_ms or 0) / 1000)
        failures += 1
        _LOG.info("Trying to %s again in %.2f s: %s", what, wait, reason)
        await asyncio.sleep(wait)


def _is_final(response: nio.ErrorResponse) -> bool:
    """Whether an error is the client's fault, and will be the same next time."""
    transport: Any = response.transport_response
    if response.status_code == "M_LIMIT_EXCEEDED" or transport is None:
        return False
    return 400 <= transport.status < 500 and transport.status not in _PASSING


# How long the server may wait for news before it answers that there is none [ms].
_PATIENCE = 10_000

_FILTER = {
    "presence": {"types": []},
    "account_data": {"types": []},
    "room": {"timeline": {"limit": 50}, "ephemeral": {"types": []}},
}


@dataclass(frozen=True)
class Membership:
    """A change of a user's membership in a room.

    Attributes:
        user: Whose membership.
        sender: Who changed it.
        state: "knock", "invite", "join", "leave" or "ban".
    """

    user: str
    sender: str
    state: str


async def follow(
    client: nio.AsyncClient, handle: Callable[[nio.SyncResponse], Coroutine[Any, Any, None]]
) -> None:
    """Pass on all news for ever, in order; the first holds the complete state.

    News that is missed while the server is away comes when it is back.
    """
    # Synapse caches answers to first calls for two minutes, by their parameters. A first call never
    # waits, so a unique patience gets a fresh answer.
    patience = _PATIENCE + time.time_ns() // 1_000_000 % 1_000_000
    while True:
        news = await persist(
            lambda: client.sync(timeout=patience, sync_filter=_FILTER),  # noqa: B023, it is for now
            f"tell {client.user_id} the news",
        )
        patience = _PATIENCE
        await handle(news)


def memberships(room: nio.RoomInfo) -> list[Membership]:
    """Membership changes in a room's news, in order."""
    events = [*room.state, *room.timeline.events]
    return [
        Membership(event.state_key, event.sender, event.membership)
        for event in events
        if isinstance(event, nio.RoomMemberEvent)
    ]
