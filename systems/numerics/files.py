"""Files that users name: read whole, never without end, and written whole or not at all; YAML."""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import yaml

from .errors import InvalidInput, require

# No picture, calibration or table is larger [bytes].
MOST_BYTES = 100_000_000


def read_input(name: str, path: str | Path) -> bytes:
    """What is in a file.

    Args:
        name: Of the parameter, for the message.
        path: Of the file.

    Raises:
        InvalidInput: Nothing there that can be read, a folder, a pipe or a device, or more than
            MOST_BYTES.
    """
    path = Path(path)
    try:
        about = path.stat()
        # Opening a pipe waits for whoever writes into it.
        require(stat.S_ISREG(about.st_mode), name, "be a file", path)
        size = f"{path}, which has {about.st_size:,}"
        require(about.st_size <= MOST_BYTES, name, f"have at most {MOST_BYTES:,} bytes", size)
        return path.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        reason = getattr(error, "strerror", None) or error
        raise InvalidInput(f"`{name}` must be readable; got {path} ({reason})") from None


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


class _EachKeyOnce(yaml.SafeLoader):
    """Refuses a mapping that has a key twice, of which PyYAML takes the last without a word."""

    def compose_mapping_node(self, anchor: Any) -> Any:
        """A mapping, as it stands in the text: before what `<<` merges into it."""
        node = super().compose_mapping_node(anchor)
        lines: dict[tuple[str, str], int] = {}
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode):
                name, line = (key.tag, key.value), key.start_mark.line + 1
                if name in lines:
                    said = f"line {lines[name]} and line {line} both say `{key.value}`"
                    raise yaml.YAMLError(said)
                lines[name] = line
        return node


def read_yaml(text: str) -> Any:
    """What a text in YAML says: mappings, lists, words, numbers.

    PyYAML reports its own faults as such, but lets through what readers of numbers and dates raise,
    and what comes of a thousand brackets.

    Args:
        text: All of it.

    Raises:
        yaml.YAMLError: It is none, a number or date in it is none, a key is in it twice, or it is
            nested too deep.
    """
    try:
        # A safe loader, with one more thing that it refuses.
        return yaml.load(text, Loader=_EachKeyOnce)
    except (ValueError, KeyError, AttributeError) as error:
        raise yaml.YAMLError(f"a number, date or truth value is none: {error}") from None
    except RecursionError:
        raise yaml.YAMLError("nested too deep") from None
