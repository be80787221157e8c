"""Files that are whole or are not there."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from .errors import InvalidInput, require


@contextmanager
def written_whole(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """A file to write to, under a temporary name; it is moved when all is written.

    Args:
        path: Where; the name is kept as it is.

    Raises:
        InvalidInput: The folder does not exist or cannot be written to, or the path is a folder.
    """
    target = Path(path)
    require(target.parent.is_dir(), "path", "be in a folder that exists", target)
    require(not target.is_dir(), "path", "be a file", target)
    try:
        handle, name = tempfile.mkstemp(dir=target.parent, prefix=target.name, suffix=".part")
    except OSError as error:
        raise InvalidInput(f"`path` must be writable; got {target}: {error.strerror}") from None
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
        os.replace(name, target)
    except BaseException:
        os.unlink(name)
        raise
