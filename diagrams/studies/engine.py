"""Runs studies: in this process, in several, or on a Dask cluster, with the same table.

Drake keeps the Python systems of every diagram for as long as the process lives (0.6 MB a game of
tracking). A player therefore ends its process after so many games: memory stays flat, however
many runs a study has.
"""

import multiprocessing
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ...systems.numerics.errors import InvalidInput, require, require_extra, require_type
from . import records
from .play import Rows, play_block
from .records import StudyResult, load_study
from .study import Study
from .worker_processes import WorkerPool, uninterrupted, worker_pool

# After so many games a process has grown by some 300 MB.
GAMES_PER_PROCESS = 500


class Player:
    """Plays one block at a time in a process of its own."""

    def __init__(self) -> None:
        self._workers: WorkerPool | None = None
        self._games = 0

    def submit(self, study: Study, start: int, stop: int) -> Future:
        """Play the runs from start to stop of the cells; the result is of `play_block`.

        The block before must be done.
        """
        if self._games >= GAMES_PER_PROCESS:
            self.close()
        if self._workers is None:
            self._workers = worker_pool(1, preload=[play_block.__module__])
        self._games += study.games(start, stop)
        return self._workers.submit(play_block, study, start, stop)

    def close(self) -> None:
        """End the process once it has played what it was given."""
        if self._workers is not None:
            self._workers.shutdown(wait=False)
        self._workers, self._games = None, 0

    def drop(self) -> None:
        """End the process, whatever it is playing."""
        if self._workers is not None:
            self._workers.drop()
        self.close()


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


# About how many games are written to disk at once: a few seconds' work.
GAMES_PER_BLOCK = 64

# Blocks that wait at each thread of a cluster, so that it never idles.
_QUEUED = 2

# How long a scheduler may take to answer [s].
CLUSTER_TIMEOUT = 10

Block = tuple[int, int]

# What takes a block and its rows when they are there.
Keep = Callable[[Block, Rows], None]


def blocks_of(study: Study) -> list[Block]:
    """The runs of a study in blocks (start, stop), the same however it is played."""
    size = max(1, GAMES_PER_BLOCK // len(study.cells))
    return [(start, min(start + size, study.runs)) for start in range(0, study.runs, size)]


def run_study(
    study: Study,
    folder: Path,
    *,
    workers: int = 1,
    cluster: str | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
    interrupted: Callable[[], None] = lambda: None,
) -> StudyResult:
    """Play a study, or what is left of it, into a folder.

    Blocks that the folder holds already are not played again. When the caller is interrupted
    (KeyboardInterrupt), those that other processes have in hand are played to their end and kept
    first.

    Args:
        study: What is played.
        folder: Where it is kept; made if need be.
        workers: Number of processes; 0 plays in this one, whose memory then grows.
        cluster: Address of a Dask scheduler, which is used instead.
        progress: Told the number of games done and the number in all.
        interrupted: Told when an interruption waits for what is being played.

    Raises:
        InvalidInput: The folder holds another study or cannot be written; a game cannot be set
            up; there is no cluster at the address.
    """
    require_type("study", study, Study)
    require(workers >= 0, "workers", "be zero or positive", workers)
    records.open_records(study, folder)
    blocks = blocks_of(study)
    if not records.is_finished(folder):
        left = [block for block in blocks if not records.has_block(study, folder, *block)]
        total = study.games(0, study.runs)
        remaining = {block: study.games(*block) for block in left}

        def keep(block: Block, rows: Rows) -> None:
            records.write_block(folder, *block, rows)
            remaining.pop(block, None)
            progress(total - sum(remaining.values()), total)

        progress(total - sum(remaining.values()), total)
        if cluster is not None:
            _play_on_cluster(study, left, cluster, keep, interrupted)
        elif workers == 0:
            for block in left:
                keep(block, play_block(study, *block))
        else:
            _play_in_processes(study, left, workers, keep, interrupted)
        records.finish_records(study, folder, blocks)
    return load_study(folder)


def _play_in_processes(
    study: Study, blocks: list[Block], workers: int, keep: Keep, interrupted: Callable[[], None]
) -> None:
    """Play blocks in processes of this machine."""
    players = [Player() for _ in range(min(workers, len(blocks)))]
    try:
        slots = [partial(player.submit, study) for player in players]
        wait_for_one = partial(wait, return_when=FIRST_COMPLETED)
        _play_all(slots, blocks, lambda some: wait_for_one(some).done, keep, interrupted)
    except BaseException:
        # Nobody waits any more for what is being played.
        for player in players:
            player.drop()
        raise
    for player in players:
        player.close()


def _play_on_cluster(
    study: Study, blocks: list[Block], address: str, keep: Keep, interrupted: Callable[[], None]
) -> None:
    """Play blocks on a Dask cluster, on whose machines Sightfield is installed too."""
    require_extra("`cluster`", "cluster", ["distributed"])
    # Imported here, because only clusters need it. Any: the stubs take its clients for those of
    # asynchronous programs.
    distributed: Any = import_module("distributed")
    try:
        client = distributed.Client(address, timeout=CLUSTER_TIMEOUT)
    except (OSError, ValueError) as error:
        raise InvalidInput(
            f"`cluster` must be the address of a Dask scheduler; got {address} ({error})"
        ) from None
    with client:
        threads = sum(client.nthreads().values())
        require(threads > 0, "cluster", "have workers", f"none at {address}")
        slots = [partial(client.submit, play_on_cluster, study, pure=False)] * (_QUEUED * threads)
        wait_for_one = partial(distributed.wait, return_when="FIRST_COMPLETED")
        _play_all(slots, blocks, lambda some: wait_for_one(some).done, keep, interrupted)


def _play_all(
    slots: Sequence[Callable[[int, int], Any]],
    blocks: list[Block],
    wait_for_one: Callable[[list[Any]], set[Any]],
    keep: Keep,
    interrupted: Callable[[], None],
) -> None:
    """Keep every slot busy until all blocks are played.

    Args:
        slots: Each takes a block when the last one it was given is done, and returns a future.
        blocks: To be played.
        wait_for_one: Given futures, returns those that are done once there are any.
        keep: Takes a block and its rows.
        interrupted: Told when an interruption waits for what is being played.
    """
    waiting, playing, idle = iter(blocks), {}, list(slots)
    interruption: KeyboardInterrupt | None = None
    while idle or playing:
        try:
            while idle:
                with uninterrupted():
                    slot = idle.pop(0)
                    block = next(waiting, None)
                    if block is not None:
                        playing[slot(*block)] = slot, block
            for future in wait_for_one(list(playing)) if playing else ():
                slot, block = playing[future]
                keep(block, future.result())
                del playing[future]
                idle.append(slot)
        except KeyboardInterrupt as error:
            if interruption is not None:
                raise
            # What is being played is worth keeping; a second interruption does not wait for it.
            waiting, interruption = iter(()), error
            interrupted()
    if interruption is not None:
        raise interruption
