"""Finding the operator's view, or starting it."""

import contextlib
import json
import os
import subprocess
import sys
import time
import urllib.request
from dataclasses import dataclass
from typing import Any

from ...systems.numerics.errors import InvalidInput, SightfieldError, require
from .endpoints import endpoints

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
    # No proxy knows the way to this machine.
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
    # Not what the report says: controllers speak to no one but the user's own viewer.
    return View(url, *endpoints(port), report["pid"])


def open_view(port: int) -> View:
    """The view on a port, started in a process of its own if there is none.

    It stays when this process ends, even by a crash or by Ctrl-C in its terminal.

    Raises:
        InvalidInput: The port is out of range, or something else is there.
        SightfieldError: It does not come up.
    """
    require(1024 <= port <= 65535, "--port", "be from 1024 to 65535", port)
    view = find_view(port)
    if view is not None:
        return view
    process = subprocess.Popen(
        [sys.executable, "-m", __package__ or "", str(port)],
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
