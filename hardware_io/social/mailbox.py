"""Errands in their order, each carried out until it is done."""

import asyncio
import threading
from collections.abc import Awaitable, Callable

from .background import Background


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
