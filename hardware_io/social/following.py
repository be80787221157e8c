"""News from a homeserver, as long as there is any, and what it says of memberships."""

import time
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any

import nio

from .persistence import persist

# How long the server may wait for news before it answers that there is none [ms].
_PATIENCE = 10_000

_FILTER = {
    "presence": {"types": []},
    "account_data": {"types": []},
    "room": {"timeline": {"limit": 50}, "ephemeral": {"types": []}},
}


@dataclass(frozen=True)
class Membership:
    """A change of what somebody is to a room.

    Attributes:
        user: Whose.
        sender: Who changed it.
        state: "knock", "invite", "join", "leave" or "ban".
    """

    user: str
    sender: str
    state: str


async def follow(
    client: nio.AsyncClient, handle: Callable[[nio.SyncResponse], Coroutine[Any, Any, None]]
) -> None:
    """Hand on all news for ever, in order; the first has everything that there is.

    What is missed while the server is away comes when it is back.
    """
    # Synapse keeps first answers for two minutes, and gives an old one to whoever asks with the
    # same words; the first call does not wait, so it can name a patience that nobody else names.
    patience = _PATIENCE + time.time_ns() // 1_000_000 % 1_000_000
    while True:
        news = await persist(
            lambda: client.sync(timeout=patience, sync_filter=_FILTER),  # noqa: B023, it is for now
            f"tell {client.user_id} the news",
        )
        patience = _PATIENCE
        await handle(news)


def memberships(room: nio.RoomInfo) -> list[Membership]:
    """Changes of memberships in a room's news, in order."""
    events = [*room.state, *room.timeline.events]
    return [
        Membership(event.state_key, event.sender, event.membership)
        for event in events
        if isinstance(event, nio.RoomMemberEvent)
    ]
