"""A process that plays blocks of games, and is replaced by a fresh one now and then.

Drake keeps the Python systems of every diagram for as long as the process lives (0.6 MB a game of
tracking). A player therefore ends its process after so many games: memory stays flat, however
many runs a study has.
"""

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor

from .play import Rows, play_block
from .study import Study

# After so many games a process has grown by some 300 MB.
GAMES_PER_PROCESS = 500


class Player:
    """Plays one block at a time in a process of its own."""

    def __init__(self) -> None:
        self._executor: ProcessPoolExecutor | None = None
        self._games = 0

    def submit(self, study: Study, start: int, stop: int) -> Future:
        """Play the runs from start to stop of the cells; the result is of `play_block`.

        The block before must be done.
        """
        if self._games >= GAMES_PER_PROCESS:
            self.close()
        if self._executor is None:
            # Forked off a server that has imported all this, it is ready at once; a spawned one
            # would take 2 s.
            context = multiprocessing.get_context("forkserver")
            context.set_forkserver_preload([play_block.__module__])
            self._executor = ProcessPoolExecutor(1, context, initializer=_stay_behind)
        self._games += study.games(start, stop)
        return self._executor.submit(play_block, study, start, stop)

    def close(self) -> None:
        """End the process once it has played what it was given."""
        if self._executor is not None:
            self._executor.shutdown(wait=False)
        self._executor, self._games = None, 0


def _stay_behind() -> None:
    """In the process: leave Ctrl-C to the parent, and end when the parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


_own = threading.local()


def play_on_cluster(study: Study, start: int, stop: int) -> Rows:
    """What a Dask worker runs: each of its threads has a player.

    Args:
        study: Which.
        start, stop: Numbers of the runs.
    """
    # Dask's nanny makes its workers daemons, which may have no children. Ours end with them.
    multiprocessing.current_process().daemon = False
    if not hasattr(_own, "player"):
        _own.player = Player()
    return _own.player.submit(study, start, stop).result()
