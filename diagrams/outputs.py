"""Where files go: folders of results that are complete or not there at all, and the user's cache;
files that grow while a run goes on; and what is said of a full disk."""

import errno
import hashlib
import json
import os
import shutil
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from io import BufferedRandom, FileIO
from pathlib import Path
from typing import Literal, NoReturn, Self, overload

from ..systems.numerics.errors import InvalidInput, require

# What the system answers when a disk, a quota or the largest size of a file is used up.
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


# Lists what each run has written into a folder of results: its files, each with its SHA-256.
MANIFEST = ".written.json"


class NoRoom(InvalidInput):
    """Results do not fit where they are to go: the disk is full, or a quota is used up."""


def lacks_room(error: BaseException) -> bool:
    """Whether an error says that nothing more can be written, whoever raised it."""
    return isinstance(error, NoRoom) or (isinstance(error, OSError) and error.errno in _NO_ROOM)


def refuse(path: str | Path, error: OSError) -> NoReturn:
    """Say that results cannot be written.

    Args:
        path: Where they were to go.
        error: What the system said.

    Raises:
        InvalidInput: Always; a `NoRoom` if there is no room for them.
    """
    if lacks_room(error):
        raise NoRoom(
            f"`out` must have room for the results; got {path} ({error.strerror})"
        ) from None
    raise InvalidInput(f"`out` must be a writable folder; got {path} ({error.strerror})") from None


class RunRecord(ABC):
    """What is written down while a run goes on; a context manager.

    A run that is over ends its record; one that an error breaks off leaves what there is of it.
    """

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self.leave()

    @abstractmethod
    def close(self) -> None:
        """Say that nothing follows."""

    @abstractmethod
    def leave(self) -> None:
        """Let go of what was written of a run that failed, without an end."""


@overload
def open_record(path: Path) -> BufferedRandom: ...


@overload
def open_record(path: Path, *, buffered: Literal[False]) -> FileIO: ...


def open_record(path: Path, *, buffered: bool = True) -> BufferedRandom | FileIO:
    """A new file for a run's record, which none but the user may read: a camera sees who is there.

    Args:
        path: Of the file; must not exist.
        buffered: Whether what is written may wait in memory.

    Raises:
        InvalidInput: The file exists, or cannot be written.
    """
    try:
        path.touch(0o600, exist_ok=False)
        return path.open("r+b") if buffered else path.open("r+b", buffering=0)
    except OSError as error:
        raise InvalidInput(f"`log` must be a new file; got {path} ({error.strerror})") from None


def cache_folder() -> Path:
    """Where what took long to make is kept for the next time; need not exist.

    In $XDG_CACHE_HOME, or ~/.cache.

    Raises:
        RuntimeError: The user has no home.
    """
    base = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(base) if os.path.isabs(base) else Path.home() / ".cache") / "sightfield"


@contextmanager
def new_files(path: str | Path) -> Iterator[Path]:
    """A temporary folder whose files move into `path` when the block ends without an exception.

    Files of the same name are replaced, others are left alone; each file appears whole. After an
    exception nothing has changed. Missing parents are made, but only at the end.

    Args:
        path: Where the files go; need not exist.

    Yields:
        A folder on the same filesystem to write into, subfolders included.

    Raises:
        InvalidInput: `path` begins with --; it, or something on the way to it, is not a folder or
            not writable (before the block), a file in the folder cannot be written (within it; a
            `NoRoom` if the disk is full), or a folder stands where a file is to go (after it;
            nothing has been moved then).
    """
    with _scratch_folder(path) as scratch:
        yield scratch
        _move(scratch, Path(path), _files(scratch))


@contextmanager
def output_folder(path: str | Path) -> Iterator[Path]:
    """A folder for the results of a run: `new_files`, in place of those of a run before.

    Where one of them replaces a file of an earlier run, what else that run left would be taken for
    a result of this one. It is deleted if it is still as it was written; what a user put there or
    changed is left alone, and so are results of runs of which nothing is replaced.

    Args:
        path: Where the results go; need not exist.

    Yields:
        A folder on the same filesystem to write into, subfolders included.

    Raises:
        InvalidInput: See `new_files`.
    """
    path = Path(path)
    with _scratch_folder(path) as scratch:
        yield scratch
        files = _files(scratch)
        new, before = {str(file): _digest(scratch / file) for file in files}, _runs_in(path)
        # Paths and not words, since a list may have been made on another system.
        replaced = [run for run in before if not set(map(Path, run)).isdisjoint(files)]
        stale = {
            Path(name)
            for run in replaced
            for name, digest in run.items()
            if _has(path, name, digest)
        }
        if new:
            write_json(scratch / MANIFEST, [*(run for run in before if run not in replaced), new])
            # Moved last: it says of no file that is not there that a run wrote it.
            files.append(Path(MANIFEST))
        _move(scratch, path, files, sorted(stale.difference(files)))


def optional_folder(path: Path | None) -> AbstractContextManager[Path | None]:
    """`output_folder`, or None within the block where nothing is to be kept.

    Args:
        path: Where the results go, if anywhere.

    Raises:
        InvalidInput: See `output_folder`.
    """
    return nullcontext() if path is None else output_folder(path)


def write_json(path: Path, thing: object) -> None:
    """Write a file of one JSON object for people and programs.

    Args:
        path: Of the file.
        thing: What json knows.
    """
    path.write_text(json.dumps(thing, indent=2) + "\n", encoding="utf-8")


@contextmanager
def _scratch_folder(path: str | Path) -> Iterator[Path]:
    """A folder beside a destination for the time of the block; errors name that."""
    # An option that took the place of the folder's name: `--out --help`.
    require(not str(path).startswith("--"), "out", "not begin with --", path)
    try:
        # Beside the destination, so that moving is renaming; inside it if it is there, because
        # it may be the root of a filesystem.
        home = Path(path).resolve()
        while not home.exists():
            home = home.parent
        scratch = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=home))
    except OSError as error:
        refuse(path, error)
    try:
        yield scratch
    except OSError as error:
        # Other things than results fail with an OSError too, a radio for instance.
        if lacks_room(error) or _is_below(scratch, error.filename):
            refuse(path, error)
        raise
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _files(folder: Path) -> list[Path]:
    """Every file below a folder, by its way from there."""
    return [file.relative_to(folder) for file in sorted(folder.rglob("*")) if file.is_file()]


def _runs_in(path: Path) -> list[dict[str, str]]:
    """What runs have left in a folder: of each its files, and their digests."""
    try:
        found = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        # No run has been here, or its list cannot be read: nothing is known to be ours.
        return []
    runs = found if isinstance(found, list) else []
    return [run for run in runs if isinstance(run, dict)]


def _has(folder: Path, name: str, digest: object) -> bool:
    """Whether a folder has a file, with what a run wrote into it."""
    file = folder / name
    # A list from elsewhere may name what is not in the folder.
    there = file.is_file() and file.resolve().is_relative_to(folder.resolve())
    return there and _digest(file) == digest


def _digest(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def _move(scratch: Path, path: Path, files: Sequence[Path], stale: Sequence[Path] = ()) -> None:
    """Move files of one folder to the same place in another, where others make room for them."""
    for file in files:
        if (path / file).is_dir():
            raise InvalidInput(f"`out` must not have a folder named {file}; got {path}")
    try:
        path.mkdir(parents=True, exist_ok=True)
        for file in files:
            (path / file).parent.mkdir(parents=True, exist_ok=True)
        for file in stale:
            (path / file).unlink()
        for file in files:
            os.replace(scratch / file, path / file)
        # A folder that only held what is gone; below those that are left.
        for folder in sorted({path / each for file in stale for each in file.parents[:-1]})[::-1]:
            if not any(folder.iterdir()):
                folder.rmdir()
    except OSError as error:
        refuse(path, error)


def _is_below(folder: Path, file: object) -> bool:
    return isinstance(file, (str, os.PathLike)) and folder in Path(file).parents
