"""Where controllers and the operator's view meet: sockets in a folder that is the user's alone.

They depend on the page's port and nothing else, so a view that was started again is found by
controllers that run, and no other account of the machine can listen or speak there.
"""

import os
import stat
import tempfile
from pathlib import Path
from typing import NamedTuple

from ...systems.numerics.errors import require


class Endpoints(NamedTuple):
    """Of one view.

    Attributes:
        states: Address to which controllers tell states.
        words: Address from which the operator's words come.
    """

    states: str
    words: str


def endpoints(port: int) -> Endpoints:
    """Those of the view whose page is on a port.

    Raises:
        InvalidInput: Somebody else made the folder, or may write there.
    """
    folder = Path(tempfile.gettempdir()) / f"sightfield-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    require(own and not found.st_mode & 0o077, "folder of sockets", "be yours alone", folder)
    return Endpoints(f"ipc://{folder}/{port}.states", f"ipc://{folder}/{port}.words")
