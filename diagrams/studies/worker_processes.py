"""Processes that work for this one: what a terminal or a service manager sends to all of them is
for this one alone, which ends them; and they end with it, however it does.
"""

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Pipe, wait
from multiprocessing.context import ForkServerContext
from typing import Any

from threadpoolctl import threadpool_limits

# What Ctrl-C, `timeout` and a terminal that is closed send to every process of a command.
_SENT_TO_ALL = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class WorkerPool(ProcessPoolExecutor):
    """Processes that take tasks, and can be dropped with what they have in hand.

    Args:
        workers: How many.
        context: What starts them: a server that has imported what they need.
    """

    def __init__(self, workers: int, context: ForkServerContext) -> None:
        held, self._leash = Pipe(duplex=False)
        super().__init__(workers, context, initializer=_stay_behind, initargs=(held,))

    def drop(self) -> None:
        """End the processes, whatever they are doing."""
        self._leash.close()


def worker_pool(workers: int, preload: Sequence[str] = ()) -> WorkerPool:
    """Processes that take tasks.

    Forked off a server that has imported everything, they are ready at once; spawned ones would
    take 2 s.

    Args:
        workers: How many.
        preload: Modules that the server imports.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(preload))
    # Whoever is started has them blocked from its first moment on, and they reach this process a
    # little later at most.
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _SENT_TO_ALL)
    try:
        resource_tracker.ensure_running()
        # That lets some of them through.
        signal.pthread_sigmask(signal.SIG_BLOCK, _SENT_TO_ALL)
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return WorkerPool(workers, context)


@contextmanager
def uninterrupted() -> Iterator[None]:
    """What would end this process reaches it at the end of the block, once.

    Half a worker that is given up cannot be ended: it looks for what its parent has put away, and
    complains.
    """
    if threading.current_thread() is not threading.main_thread():
        # Signals are handled in the main thread, whoever they come to.
        yield
        return
    came = list[int]()
    before = {number: signal.getsignal(number) for number in _SENT_TO_ALL}
    for number, handler in before.items():
        if callable(handler):
            signal.signal(number, lambda number, frame: came.append(number))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        for number in came:
            signal.raise_signal(number)


# Any: the ends of a pipe are of another class on Windows.
def _stay_behind(leash: Any) -> None:
    """In a worker: leave the group that signals are sent to, keep to one core, and end when the
    parent does.

    Args:
        leash: Whose other end the parent closes to drop the worker.
    """
    os.setsid()
    for number in _SENT_TO_ALL:
        # One that came meanwhile is forgotten.
        signal.signal(number, signal.signal(number, signal.SIG_IGN))
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _SENT_TO_ALL)
    # Threads of several workers would wait for one another, and spin.
    threadpool_limits(1, user_api="blas")
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        wait([parent.sentinel, leash])
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
