"""The newest pictures of an album, fetched as they become known."""

import asyncio
import logging
import threading
from dataclasses import dataclass
from typing import Any

import nio

from ...systems.numerics.social.network.interface import Picture
from .accounts import ServerRefusal
from .persistence import persist
from .picture_events import PostedPicture, posted_picture

_LOG = logging.getLogger(__name__)

# Attempts at a file that comes, but not as it was posted, and the wait between them [s].
_ATTEMPTS, _WAIT = 5, 0.2

# How far back an album is read that was out of sight [messages].
_PAGE = 50


@dataclass(frozen=True)
class Run:
    """One run on a server that may have seen others.

    Attributes:
        name: Of the run, and of no other, unless it is continued.
        began: Since 1970 [s].
    """

    name: str
    began: float


class AlbumMirror:
    """One agent's album as far as the pursuer has been shown it.

    It only grows at its end, and holds the files of the newest pictures.

    Args:
        client: The pursuer's.
        agent: Whose album.
        room: Its id.
        newest: How many files are held.
    """

    def __init__(self, client: nio.AsyncClient, agent: int, room: str, newest: int) -> None:
        self._client, self._agent, self._room, self._newest = client, agent, room, newest
        self._lock = threading.Lock()
        self._posted: list[PostedPicture] = []
        self._known: set[tuple[str | None, str]] = set()
        self._files: dict[PostedPicture, bytes] = {}
        self._given_up: set[PostedPicture] = set()
        self._news = asyncio.Event()

    def latest(self, count: int, run: Run) -> list[Picture]:
        """The newest pictures whose files are here, newest first; from any thread.

        They are a run's, and those from elsewhere, whose time is that since the run began.

        Args:
            count: How many, at most.
            run: Whose pictures.
        """
        with self._lock:
            here = [
                each
                for each in reversed(self._posted)
                if each.run in (None, run.name) and each in self._files
            ]
            return [
                Picture(
                    id=each.id,
                    agent=self._agent,
                    time=each.time - (run.began if each.run is None else 0.0),
                    data=self._files[each],
                )
                for each in here[:count]
            ]

    async def take(self, room: nio.RoomInfo) -> None:
        """Note the pictures in a room's news, and those from before that were left out of it."""
        timeline: Any = room.timeline
        events = [event.source for event in timeline.events]
        if timeline.limited and timeline.prev_batch:
            events = [*await self._earlier(timeline.prev_batch), *events]
        with self._lock:
            for event in events:
                posted = posted_picture(event)
                if posted is not None and (posted.run, posted.id) not in self._known:
                    self._known.add((posted.run, posted.id))
                    self._posted.append(posted)
        self._news.set()

    async def _earlier(self, end: str) -> list[dict[str, Any]]:
        """Events before a place, oldest first; one page, which holds more than is ever read."""
        try:
            page = await persist(
                lambda: self._client.room_messages(self._room, end, limit=_PAGE),
                f"show the album of agent {self._agent}",
            )
        except ServerRefusal as refusal:
            # No friend any more.
            _LOG.info("%s", refusal)
            return []
        return [event.source for event in reversed(page.chunk)]

    async def fetch(self) -> None:
        """Fetch files for ever, the newest picture's first."""
        while True:
            missing = self._next_missing()
            if missing is None:
                self._news.clear()
                await self._news.wait()
                continue
            data = await self._download(missing)
            with self._lock:
                if data is None:
                    self._given_up.add(missing)
                else:
                    self._files[missing] = data
                for each in self._posted[: -self._newest]:
                    self._files.pop(each, None)

    def _next_missing(self) -> PostedPicture | None:
        with self._lock:
            for each in reversed(self._posted[-self._newest :]):
                if each not in self._files and each not in self._given_up:
                    return each
        return None

    async def _download(self, posted: PostedPicture) -> bytes | None:
        """A picture's file; None if the server has not got it as it was posted."""
        what = f"send picture {posted.id}"
        for _ in range(_ATTEMPTS):
            try:
                answer = await persist(lambda: self._client.download(posted.address), what)
            except ServerRefusal as refusal:
                _LOG.warning("%s", refusal)
                return None
            if posted.fits(answer.body):
                return answer.body
            _LOG.info("Picture %s came damaged, with %d bytes", posted.id, len(answer.body))
            await asyncio.sleep(_WAIT)
        _LOG.warning("Picture %s is not what was posted", posted.id)
        return None
