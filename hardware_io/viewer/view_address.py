"""Addresses of the operator's view: its sockets, its process, and which requests it accepts.

Sockets lie in a private folder of the user, so that no other account of the machine can listen or
send there. Their names depend only on the page's port, so that running controllers find a view that
was restarted.

By DNS rebinding a page of another site can reach this machine under that site's name, so `Host` is
checked; other pages in the same browser are refused by their `Origin`; and none may frame ours.
"""

import contextlib
import json
import os
import stat
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from ...systems.numerics.errors import InvalidInput, SightfieldError, require


class Endpoints(NamedTuple):
    """Socket addresses of one view.

    Attributes:
        states: Address to which controllers tell states.
        words: Address from which the operator's words come.
    """

    states: str
    words: str


def endpoints(port: int) -> Endpoints:
    """Socket addresses of the view whose page is on a port.

    Raises:
        InvalidInput: The folder belongs to another user, or others have access to it.
    """
    folder = Path(tempfile.gettempdir()) / f"sightfield-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    own = stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid()
    require(own and not found.st_mode & 0o077, "folder of sockets", "be yours alone", folder)
    return Endpoints(f"ipc://{folder}/{port}.states", f"ipc://{folder}/{port}.words")


# Pages load only what is served here, and connect only to this machine, as to the stop page.
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'self' data: blob: 'unsafe-inline' 'unsafe-eval'; "
        "connect-src 'self' data: blob: ws://127.0.0.1:* ws://localhost:* http://127.0.0.1:*; "
        "object-src 'none'; base-uri 'none'; frame-ancestors 'none'"
    ),
    "X-Frame-Options": "DENY",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
_NAMES = ("127.0.0.1", "localhost")


def is_host(host: str | None, port: int) -> bool:
    """Whether a request was meant for a page on this machine.

    Args:
        host: Its `Host`.
        port: Of the page.
    """
    return host in [f"{name}:{port}" for name in _NAMES]


def is_origin(origin: str | None, ports: Iterable[int]) -> bool:
    """Whether a request comes from our own pages, or from no page at all.

    Args:
        origin: Its `Origin`, if it has one.
        ports: Of the pages.
    """
    return not origin or origin in [f"http://{n}:{port}" for port in ports for n in _NAMES]


# How long a view may take to come up [s].
_PATIENCE = 20.0


@dataclass(frozen=True)
class View:
    """A view that is up.

    Attributes:
        url: Of its page.
        states: Address to which controllers tell states.
        words: Address from which the operator's words come.
        pid: Of its process.
    """

    url: str
    states: str
    words: str
    pid: int


def find_view(port: int) -> View | None:
    """The view on a port of this machine, or None if there is none.

    Raises:
        InvalidInput: Something else answers there.
    """
    url = f"http://127.0.0.1:{port}/"
    # Connect directly: a proxy cannot reach this machine.
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    report: Any = None
    try:
        with opener.open(f"{url}state", timeout=2.0) as answer:
            text = answer.read()
    except ConnectionError:
        return None
    except OSError as error:
        # urllib wraps a refused connection in an error of its own.
        if isinstance(getattr(error, "reason", None), ConnectionError):
            return None
        text = b""
    with contextlib.suppress(ValueError):
        report = json.loads(text)
    ours = isinstance(report, dict) and report.get("program") == "sightfield viewer"
    ours = ours and report.get("user") == os.getuid() and isinstance(report.get("pid"), int)
    require(ours, "--port", "be free, or that of a viewer of yours that is open", port)
    # Use addresses from `endpoints`, not from the report, to reach only the user's own viewer.
    return View(url, *endpoints(port), report["pid"])


def open_view(port: int) -> View:
    """Return the view on a port, started as a separate process if there is none.

    The view keeps running when this process ends, even by a crash or by Ctrl-C in its terminal.

    Raises:
        InvalidInput: The port is out of range, or something else is there.
        SightfieldError: It does not come up.
    """
    require(1024 <= port <= 65535, "--port", "be from 1024 to 65535", port)
    view = find_view(port)
    if view is not None:
        return view
    process = subprocess.Popen(
        [sys.executable, "-m", f"{__package__}.server", str(port)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    deadline = time.monotonic() + _PATIENCE
    while time.monotonic() < deadline and process.poll() is None:
        with contextlib.suppress(InvalidInput):
            view = find_view(port)
            if view is not None:
                return view
        time.sleep(0.05)
    process.kill()
    raise SightfieldError(f"the viewer on port {port} did not come up; ended {process.wait()}")
