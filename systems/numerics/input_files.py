"""Files that users name are read whole, and so never those that have no end."""

import stat
from pathlib import Path

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
