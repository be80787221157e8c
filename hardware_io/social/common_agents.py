"""The common agents on a homeserver: they post pictures, and answer knocks by their temperaments.

Each has an `AlbumKeeper`, which knows who knocks and who is a member, and an outbox, which keeps
unposted pictures in a folder, so that a restart loses none.
"""

import io
import json
import logging
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path

import nio
import numpy as np

from ...systems.numerics.errors import require, require_whole
from ...systems.numerics.social.network.acceptance import Temperaments, draw_responses
from ...systems.numerics.social.network.interface import Answer, Picture
from .accounts import AgentAccount, ServerRefusal, SocialDirectory
from .matrix_client import (
    Background,
    Mailbox,
    follow,
    make_client,
    media_type,
    memberships,
    message_of,
    persist,
    transaction_of,
)

_LOG = logging.getLogger(__name__)


class Outbox:
    """Files of pictures that are not posted yet.

    A file is a line of JSON and then the picture's own bytes. It is written under another name
    and moved, so that a file that is there is whole.

    Args:
        folder: Folder of the files, made if need be; None: nothing is kept.
    """

    def __init__(self, folder: Path | None) -> None:
        self._folder, self._last = folder, 0
        if folder is not None:
            folder.mkdir(parents=True, exist_ok=True)
            numbers = [int(file.name.split("-")[0]) for file in self._files()]
            self._last = max(numbers, default=0)

    def keep(self, picture: Picture, run: str) -> None:
        """Store a run's picture behind the earlier ones, until `done`."""
        if self._folder is None:
            return
        self._last += 1
        head = {"id": picture.id, "run": run, "agent": picture.agent, "time": picture.time}
        name = f"{self._last:010d}-{transaction_of(picture, run)}"
        new = self._folder / f"{name}.new"
        new.write_bytes(json.dumps(head).encode() + b"\n" + picture.data)
        new.replace(self._folder / f"{name}.picture")

    def done(self, picture: Picture, run: str) -> None:
        """Delete a picture that was posted.

        Args:
            picture: The picture.
            run: Run that it belongs to.
        """
        if self._folder is not None:
            for file in self._folder.glob(f"*-{transaction_of(picture, run)}.picture"):
                file.unlink()

    def waiting(self) -> list[tuple[Picture, str]]:
        """Return the stored pictures in order, each with its run.

        Files that hold no picture are left alone.
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


class AlbumKeeper:
    """One agent's account.

    Pictures are posted in their order, each until the server has it: the file first, then the
    message, under a transaction id that makes a repetition harmless. Answers to knocks do not
    wait for pictures.

    Args:
        background: Runs all calls to the server.
        homeserver: Its address.
        account: The agent's account, with its token.
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
        """Users with a membership of "knock" or "join", without those already answered.

        Args:
            state: The membership, as the server calls it.
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
                # The user has left in the meantime; the news will say so.
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
            # For example, it is too large. Skip it, so that it does not block the others.
            _LOG.warning("%s", refusal)
        self._outbox.done(picture, run)


class CommonAgents:
    """All agents of a directory.

    Args:
        background: Runs all calls to the server.
        directory: Accounts, with every agent's token.
        temperaments: How they answer; None: this program does not answer for them.
        seed: Seed of their random answers.
        outbox: Folder for pictures on their way; None keeps them in memory only.

    Raises:
        InvalidInput: A token is missing, or the temperaments are of another number of agents.
    """

    def __init__(
        self,
        background: Background,
        directory: SocialDirectory,
        temperaments: Temperaments | None,
        seed: int,
        outbox: Path | None,
    ) -> None:
        require_whole("seed", seed, 0)
        count = len(directory.agents)
        lacking = [agent.user for agent in directory.agents if not agent.token]
        require(not lacking, "agents", "have tokens to be run from here", ", ".join(lacking))
        if temperaments is not None:
            require(temperaments.count == count, "temperaments", f"be of {count}", temperaments)
        self._temperaments, self._generator = temperaments, np.random.default_rng(seed)
        self._keepers = [
            AlbumKeeper(
                background,
                directory.homeserver,
                agent,
                None if outbox is None else outbox / f"agent{number}",
            )
            for number, agent in enumerate(directory.agents)
        ]

    @property
    def waiting(self) -> int:
        """Errands that the server has not taken yet."""
        return sum(keeper.waiting for keeper in self._keepers)

    def post(self, agent: int, picture: Picture, run: str) -> None:
        """Put a run's picture into an agent's album."""
        self._keepers[agent].post(picture, run)

    def advance(self) -> None:
        """Let every agent act once on everybody who knocks, and on every friend."""
        if self._temperaments is None:
            return
        knocking = [keeper.visitors("knock") for keeper in self._keepers]
        inside = [keeper.visitors("join") for keeper in self._keepers]
        for user in sorted(frozenset().union(*knocking, *inside)):
            asked = {i for i, users in enumerate(knocking) if user in users}
            friends = {i for i, users in enumerate(inside) if user in users}
            drawn = draw_responses(self._temperaments, asked, friends, self._generator)
            for each in drawn:
                keeper = self._keepers[each.agent]
                if each.answer is Answer.ACCEPTED:
                    keeper.let_in(user)
                else:
                    keeper.send_away(user)

    async def close(self) -> None:
        """Hang up."""
        for keeper in self._keepers:
            await keeper.close()
