"""A common agent's side of the network: its album, who knocks at it, and who is let in."""

import io
import logging
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path

import nio

from ...systems.numerics.social.network.interface import Picture
from .accounts import AgentAccount
from .background import Background
from .following import follow, memberships
from .mailbox import Mailbox
from .outbox import Outbox
from .persistence import make_client, persist
from .picture_events import media_type, message_of, transaction_of
from .provisioning import ServerRefusal

_LOG = logging.getLogger(__name__)


class AlbumKeeper:
    """One agent's account.

    Pictures are posted in their order, each until the server has it: the file first, then the
    message, under a transaction id that makes a repetition harmless. Answers to knocks do not
    wait for pictures.

    Args:
        background: Where it is waited for the server.
        homeserver: Its address.
        account: The agent's, with its token.
        outbox: Folder for pictures on their way; None keeps them in memory only.
    """

    def __init__(
        self,
        background: Background,
        homeserver: str,
        account: AgentAccount,
        outbox: Path | None,
    ) -> None:
        self._client = make_client(homeserver, account.user, account.token or "")
        self._user, self._album = account.user, account.album
        self._answers, self._pictures = Mailbox(background), Mailbox(background)
        self._outbox = Outbox(outbox)
        self._lock = threading.Lock()
        self._visitors: dict[str, str] = {}
        background.spawn(lambda: follow(self._client, self._take))
        for picture, run in self._outbox.waiting():
            self._enqueue(picture, run)

    @property
    def waiting(self) -> int:
        """Errands that the server has not taken yet."""
        return self._answers.waiting + self._pictures.waiting

    def visitors(self, state: str) -> frozenset[str]:
        """Users who "knock", or are in by a "join"; none whose answer is under way.

        Args:
            state: Of membership, as the server calls it.
        """
        with self._lock:
            return frozenset(user for user, now in self._visitors.items() if now == state)

    def let_in(self, user: str) -> None:
        """Accept a knock, by an invitation.

        Args:
            user: Who knocked.
        """
        self._answer(user, "invite", lambda: self._client.room_invite(self._album, user))

    def send_away(self, user: str) -> None:
        """Reject a knock, or end a friendship.

        Args:
            user: Who knocked, or is in.
        """
        self._answer(user, "remove", lambda: self._client.room_kick(self._album, user))

    def post(self, picture: Picture, run: str) -> None:
        """Put a run's picture into the album as soon as may be."""
        self._outbox.keep(picture, run)
        self._enqueue(picture, run)

    async def close(self) -> None:
        """Hang up."""
        await self._client.close()

    async def _take(self, news: nio.SyncResponse) -> None:
        if self._album not in news.rooms.join:
            return
        with self._lock:
            for each in memberships(news.rooms.join[self._album]):
                if each.user != self._user:
                    self._visitors[each.user] = each.state

    def _answer(self, user: str, what: str, call: Callable[[], Awaitable[object]]) -> None:
        with self._lock:
            self._visitors[user] = "answered"

        async def errand() -> None:
            try:
                await persist(call, f"{what} {user}")
            except ServerRefusal as refusal:
                # Gone meanwhile, by itself: the news tells.
                _LOG.info("%s", refusal)

        self._answers.put(errand)

    def _enqueue(self, picture: Picture, run: str) -> None:
        self._pictures.put(lambda: self._post(picture, run))

    async def _post(self, picture: Picture, run: str) -> None:
        what, transaction = f"take picture {picture.id}", transaction_of(picture, run)
        data, kind = picture.data, media_type(picture.data)

        async def upload() -> object:
            answer, _ = await self._client.upload(
                io.BytesIO(data), kind, transaction, filesize=len(data)
            )
            return answer

        try:
            stored = await persist(upload, what)
            message = message_of(picture, run, stored.content_uri)
            await persist(
                lambda: self._client.room_send(self._album, "m.room.message", message, transaction),
                what,
            )
        except ServerRefusal as refusal:
            # Too large, say. One picture less must not keep the others back.
            _LOG.warning("%s", refusal)
        self._outbox.done(picture, run)
