"""Folders of results that are complete or not there at all."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..systems.numerics.errors import InvalidInput


@contextmanager
def output_folder(path: str | Path) -> Iterator[Path]:
    """A temporary folder whose files move into `path` when the block ends without an exception.

    Files of the same name are replaced, others are left alone; each file appears whole. After an
    exception nothing has changed. Missing parents are made, but only at the end.

    Args:
        path: Where the results go; need not exist.

    Yields:
        A folder on the same filesystem to write into, subfolders included.

    Raises:
        InvalidInput: `path`, or something on the way to it, is not a folder or not writable
            (before the block), or a folder stands where a file is to go (after it; nothing has
            been moved then).
    """
    path = Path(path)
    try:
        # Beside the destination, so that moving is renaming; inside it if it is there, because
        # it may be the root of a filesystem.
        home = path.resolve()
        while not home.exists():
            home = home.parent
        scratch = Path(tempfile.mkdtemp(prefix=".unfinished-", dir=home))
    except OSError as error:
        raise _unusable(path, error) from None
    try:
        yield scratch
        _move(scratch, path)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _move(scratch: Path, path: Path) -> None:
    """Move every file of one folder to the same place in another."""
    files = [file.relative_to(scratch) for file in sorted(scratch.rglob("*")) if file.is_file()]
    for file in files:
        if (path / file).is_dir():
            raise InvalidInput(f"`out` must not have a folder named {file}; got {path}")
    try:
        path.mkdir(parents=True, exist_ok=True)
        for file in files:
            (path / file).parent.mkdir(parents=True, exist_ok=True)
        for file in files:
            os.replace(scratch / file, path / file)
    except OSError as error:
        raise _unusable(path, error) from None


def _unusable(path: Path, error: OSError) -> InvalidInput:
    return InvalidInput(f"`out` must be a writable folder; got {path} ({error.strerror})")
