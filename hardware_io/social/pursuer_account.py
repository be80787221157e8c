"""The pursuer's side of the network: it knocks, joins, mirrors albums and leaves.

A friend request is a knock at the agent's album. An invitation means acceptance, and the pursuer
then joins. Being removed means a rejection before joining, and an unfriending after. Friends are
known only from the server's news, so that they survive restarts on either side.
"""

import asyncio
import logging
import threading
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass
from typing import Any

import nio

from ...systems.numerics.social.network.interface import Answer, Picture, Response
from .accounts import Account, ServerRefusal
from .matrix_client import (
    Background,
    Mailbox,
    PostedPicture,
    follow,
    make_client,
    memberships,
    persist,
    posted_picture,
)

_LOG = logging.getLogger(__name__)

# Attempts to download a file that arrives damaged, and the wait between them [s].
_ATTEMPTS, _WAIT = 5, 0.2

# How many earlier messages of an album are read when the news has left some out.
_PAGE = 50


@dataclass(frozen=True)
class Run:
    """One run on a server, which may hold pictures of others.

    Attributes:
        name: Unique name of the run; the same again only if it is continued.
        began: Start, time since 1970 [s].
    """

    name: str
    began: float


class AlbumMirror:
    """Copy of one agent's album, as far as the pursuer has seen it.

    It only grows at its end, and holds the files of the newest pictures.

    Args:
        client: The pursuer's client.
        agent: Number of the album's owner.
        room: Id of the album's room.
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
        """Return the newest pictures whose files have come, newest first; from any thread.

        Pictures from elsewhere count, too; their time is given relative to the start of the run.

        Args:
            count: How many, at most.
            run: Run whose pictures are wanted.
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
        """Store the pictures in a room's news, and earlier ones that the news left out."""
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
        """Events before a place, oldest first: one page, more than is ever needed."""
        try:
            page = await persist(
                lambda: self._client.room_messages(self._room, end, limit=_PAGE),
                f"show the album of agent {self._agent}",
            )
        except ServerRefusal as refusal:
            # The agent is no longer a friend.
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
        """Download a picture's file; None if the server refuses, or the file stays damaged."""
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


class PursuerAccount:
    """One account that makes friends with the owners of albums.

    Args:
        background: Runs all calls to the server.
        homeserver: Its address.
        account: The pursuer's account.
        albums: Rooms of agents 0, 1, ...
        newest: How many pictures of each album are held.
    """

    def __init__(
        self,
        background: Background,
        homeserver: str,
        account: Account,
        albums: Sequence[str],
        newest: int,
    ) -> None:
        self._client = make_client(homeserver, account.user, account.token)
        self._user, self._albums = account.user, tuple(albums)
        self._agents = {room: agent for agent, room in enumerate(albums)}
        self._mailbox = Mailbox(background)
        self._lock = threading.Lock()
        self._asked: set[int] = set()
        self._friends: set[int] = set()
        # Agents whose invitation has come, whose album is to be left, and whose errand is queued.
        self._invited: set[int] = set()
        self._parting: set[int] = set()
        self._due: set[int] = set()
        self._responses: list[Response] = []
        self.informed = threading.Event()
        self._mirrors = [
            AlbumMirror(self._client, agent, room, newest) for agent, room in enumerate(albums)
        ]
        background.spawn(lambda: follow(self._client, self._take))
        for mirror in self._mirrors:
            background.spawn(mirror.fetch)

    @property
    def waiting(self) -> int:
        """Errands that the server has not taken yet."""
        return self._mailbox.waiting

    def request(self, agent: int) -> None:
        """Knock at an agent's album, unless it is a friend."""
        with self._lock:
            if agent in self._friends:
                return
            self._asked.add(agent)
        self._see_to(agent)

    def withdraw(self, agent: int) -> None:
        """Take a knock back, or leave the album."""
        with self._lock:
            self._asked.discard(agent)
            self._friends.discard(agent)
            self._parting.add(agent)
            self._responses = [each for each in self._responses if each.agent != agent]
        self._see_to(agent)

    def responses(self) -> list[Response]:
        """What agents did since the last call, in order."""
        with self._lock:
            found, self._responses = self._responses, []
        return found

    def friends(self) -> frozenset[int]:
        """Agents whose album the pursuer is a member of."""
        with self._lock:
            return frozenset(self._friends)

    def latest(self, agent: int, count: int, run: Run) -> list[Picture]:
        """An agent's newest pictures of a run that are here, newest first.

        Args:
            agent: Whose.
            count: How many, at most.
            run: Whose pictures.
        """
        return self._mirrors[agent].latest(count, run)

    async def close(self) -> None:
        """Hang up."""
        await self._client.close()

    async def _take(self, news: nio.SyncResponse) -> None:
        """Update friends, rejections and albums from news."""
        for room in news.rooms.invite:
            if room in self._agents:
                with self._lock:
                    self._invited.add(self._agents[room])
                self._see_to(self._agents[room])
        for room, info in news.rooms.leave.items():
            own = [each for each in memberships(info) if each.user == self._user]
            # The first news reports memberships that ended earlier: ignore them.
            if room in self._agents and own and self.informed.is_set():
                self._note_leaving(self._agents[room], own[-1].sender)
        for room, info in news.rooms.join.items():
            if room in self._agents:
                own = [each for each in memberships(info) if each.user == self._user]
                if own and own[-1].state == "join":
                    self._note_joining(self._agents[room])
                await self._mirrors[self._agents[room]].take(info)
        self.informed.set()

    def _note_joining(self, agent: int) -> None:
        with self._lock:
            self._asked.discard(agent)
            if agent not in self._friends:
                self._friends.add(agent)
                self._responses.append(Response(agent=agent, answer=Answer.ACCEPTED))

    def _note_leaving(self, agent: int, sender: str) -> None:
        with self._lock:
            if agent in self._friends:
                # Also if the pursuer itself left, since the friendship was reported: it may have
                # joined while its withdrawal was under way.
                self._friends.discard(agent)
                self._responses.append(Response(agent=agent, answer=Answer.UNFRIENDED))
            elif agent in self._asked and sender != self._user:
                self._note_rejection(agent)

    def _note_rejection(self, agent: int) -> None:
        """Record a rejection; the caller must hold the lock."""
        self._asked.discard(agent)
        self._responses.append(Response(agent=agent, answer=Answer.REJECTED))

    def _see_to(self, agent: int) -> None:
        """Queue one errand for an agent, which acts on what is wanted by the time it runs.

        So errands do not pile up while the server is away and requests come and go.
        """
        with self._lock:
            if agent in self._due:
                return
            self._due.add(agent)
        self._mailbox.put(lambda: self._attend(agent))

    async def _attend(self, agent: int) -> None:
        with self._lock:
            parting, asked = agent in self._parting, agent in self._asked
            invited = agent in self._invited and not parting
            for due in (self._due, self._parting, self._invited):
                due.discard(agent)
        if parting or (invited and not asked):
            await self._leave(agent)
        if asked:
            # If the knock is refused, an invitation may be there already; without one, the join
            # fails, too, and that is a rejection.
            welcome = not invited and await self._knock(agent)
            if not welcome and not await self._join(agent):
                with self._lock:
                    if agent in self._asked:
                        self._note_rejection(agent)

    async def _knock(self, agent: int) -> bool:
        return await self._try(lambda: self._client.room_knock(self._albums[agent]), "knock", agent)

    async def _join(self, agent: int) -> bool:
        return await self._try(lambda: self._client.join(self._albums[agent]), "join", agent)

    async def _leave(self, agent: int) -> bool:
        return await self._try(lambda: self._client.room_leave(self._albums[agent]), "leave", agent)

    async def _try(self, call: Callable[[], Awaitable[object]], what: str, agent: int) -> bool:
        """Make a call until the server answers; returns whether it did not refuse."""
        try:
            await persist(call, f"let the pursuer {what} at agent {agent}'s")
        except ServerRefusal as refusal:
            _LOG.info("%s", refusal)
            return False
        return True
