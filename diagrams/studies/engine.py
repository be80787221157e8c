"""Runs studies: in this process, in several, or on a Dask cluster, with the same table."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

from ...systems.numerics.errors import InvalidInput, require
from . import records
from .play import Rows, play_block
from .player import Player, play_on_cluster
from .records import StudyResult, load_study
from .study import Study

# About how many games are written to disk at once: a few seconds' work.
GAMES_PER_BLOCK = 64

# Blocks that wait at each thread of a cluster, so that it never idles.
_QUEUED = 2

# How long a scheduler may take to answer [s].
CLUSTER_TIMEOUT = 10

Block = tuple[int, int]


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

    Raises:
        InvalidInput: The folder holds another study or cannot be written; a game cannot be set
            up; there is no cluster at the address.
    """
    require(workers >= 0, "workers", "be zero or positive", workers)
    records.open_records(study, folder)
    blocks = blocks_of(study)
    if not records.is_finished(folder):
        left = [block for block in blocks if not records.has_block(study, folder, *block)]
        cells, total = len(study.cells), study.runs * len(study.cells)
        done = total - cells * sum(stop - start for start, stop in left)
        progress(done, total)
        if cluster is not None:
            played = _on_cluster(study, left, cluster)
        elif workers == 0:
            played = ((block, play_block(study, *block)) for block in left)
        else:
            played = _in_processes(study, left, workers)
        for (start, stop), rows in played:
            records.write_block(folder, start, stop, rows)
            done += cells * (stop - start)
            progress(done, total)
        records.finish_records(study, folder, blocks)
    return load_study(folder)


def _in_processes(study: Study, blocks: list[Block], workers: int) -> Iterator[tuple[Block, Rows]]:
    """Play blocks in processes of this machine."""
    players = [Player() for _ in range(min(workers, len(blocks)))]
    try:
        slots = [partial(player.submit, study) for player in players]
        yield from _played(slots, blocks, lambda some: wait(some, None, FIRST_COMPLETED).done)
    finally:
        for player in players:
            player.close()


def _on_cluster(study: Study, blocks: list[Block], address: str) -> Iterator[tuple[Block, Rows]]:
    """Play blocks on a Dask cluster, on whose machines Sightfield is installed too."""
    try:
        # Imported here, because only clusters need it. Any: the stubs take its clients for those
        # of asynchronous programs.
        distributed: Any = import_module("distributed")
    except ImportError:
        raise InvalidInput(
            "`cluster` must find dask.distributed (pip install 'sightfield[cluster]'); got none"
        ) from None
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
        yield from _played(
            slots, blocks, lambda some: distributed.wait(some, return_when="FIRST_COMPLETED").done
        )


def _played(
    slots: Sequence[Callable[[int, int], Any]],
    blocks: list[Block],
    wait_for_one: Callable[[list[Any]], set[Any]],
) -> Iterator[tuple[Block, Rows]]:
    """Keep every slot busy until all blocks are played; yield them as they are done.

    Args:
        slots: Each takes a block when the last one it was given is done, and returns a future.
        blocks: To be played.
        wait_for_one: Given futures, returns those that are done once there are any.
    """
    waiting, playing = iter(blocks), {}
    interruption: KeyboardInterrupt | None = None

    def give(slot: Callable[[int, int], Any]) -> None:
        block = next(waiting, None)
        if block is not None:
            playing[slot(*block)] = slot, block

    for slot in slots:
        give(slot)
    while playing:
        try:
            done = wait_for_one(list(playing))
        except KeyboardInterrupt as error:
            if interruption is not None:
                raise
            # What is being played is worth keeping; a second interruption does not wait for it.
            waiting, interruption = iter(()), error
            continue
        for future in done:
            slot, block = playing.pop(future)
            give(slot)
            yield block, future.result()
    if interruption is not None:
        raise interruption
