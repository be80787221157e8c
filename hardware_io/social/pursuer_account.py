"""The pursuer's side of the network: it knocks, joins, reads and leaves.

An agent is asked by a knock at its album. An invitation is acceptance, and is followed by joining;
being made to leave is a rejection before, and an unfriending after. What is known of friends is
what the server says in its news, so it survives restarts on either side.
"""

import logging
import threading
from collections.abc import Awaitable, Callable, Sequence

import nio

from ...systems.numerics.social.network.interface import Answer, Picture, Response
from .accounts import Account, ServerRefusal
from .album_mirror import AlbumMirror, Run
from .persistence import Background, Mailbox, follow, make_client, memberships, persist

_LOG = logging.getLogger(__name__)


class PursuerAccount:
    """One account that makes friends with the owners of albums.

    Args:
        background: Where it is waited for the server.
        homeserver: Its address.
        account: The pursuer's.
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
        # Agents whose invitation has come, who are to be left, and who are to be seen to.
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
        """Learn from news who is a friend, who was and who refuses, and what is posted."""
        for room in news.rooms.invite:
            if room in self._agents:
                with self._lock:
                    self._invited.add(self._agents[room])
                self._see_to(self._agents[room])
        for room, info in news.rooms.leave.items():
            own = [each for each in memberships(info) if each.user == self._user]
            # Before the first news, what is over is over.
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
                # Also when the pursuer left: it was told of a friendship, and is told of its end.
                # It may have joined while its withdrawal was under way.
                self._friends.discard(agent)
                self._responses.append(Response(agent=agent, answer=Answer.UNFRIENDED))
            elif agent in self._asked and sender != self._user:
                self._note_rejection(agent)

    def _note_rejection(self, agent: int) -> None:
        """With the lock held."""
        self._asked.discard(agent)
        self._responses.append(Response(agent=agent, answer=Answer.REJECTED))

    def _see_to(self, agent: int) -> None:
        """Have what is wanted of an agent brought about, whatever it is by then.

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
            # Who may not knock may have been invited already. If not, that is a rejection.
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
        """Whether the server did it, once it has an opinion."""
        try:
            await persist(call, f"let the pursuer {what} at agent {agent}'s")
        except ServerRefusal as refusal:
            _LOG.info("%s", refusal)
            return False
        return True
