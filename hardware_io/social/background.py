"""A thread in which a homeserver's slowness is waited for, so that nobody else has to."""

import asyncio
import threading
from collections.abc import Callable, Coroutine
from typing import Any


class Background:
    """An event loop in a thread of its own.

    What goes wrong in it is kept, and raised in the caller's thread by `check`.

    Args:
        name: Of the thread.
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
        """Raise what ended a piece of work, if anything did."""
        if self._failure is not None:
            raise self._failure

    def close(self, finish: Callable[[], Coroutine[Any, Any, None]]) -> None:
        """Cancel all work, run the finish, and end the thread."""
        if not self._thread.is_alive():
            return

        async def end() -> None:
            # Libraries may take a cancellation for one of their own: then it takes another.
            while self._tasks:
                for task in list(self._tasks):
                    task.cancel()
                await asyncio.wait(list(self._tasks), timeout=0.2)
            await finish()

        asyncio.run_coroutine_threadsafe(end(), self.loop).result(60)
        self.loop.call_soon_threadsafe(self.loop.stop)
        self._thread.join()
        self.loop.close()
