"""The page on which a run is watched while it goes on.

Drake's own page cuts off what an orthographic camera is to show where the window is narrow. So a
server stands before Drake's that hands out a page which shows all of it in every window, and passes
on whatever else a browser asks for, at the same address.
"""

import http.client
import logging
import socket
import threading
import urllib.request
import weakref
from collections.abc import Callable
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import cast

from pydrake.geometry import Meshcat, MeshcatParams

from ...systems.numerics.errors import require
from .replay import SHOW_WHOLE_WORLD
from .stage import end_on_this_thread

# Where Drake looks for a free port, too.
_PORTS = range(7000, 7100)
# What in Drake's page follows the viewer.
_AFTER_VIEWER = "<!-- CONNECTION BLOCK BEGIN -->"
# One piece of what is passed on [bytes].
_PIECE = 65536


class LivePage(Meshcat):
    """Meshcat, behind a page that shows the whole world however narrow it is.

    Args:
        host, port: As of `open_live_page`.

    Raises:
        RuntimeError: The port is taken.
    """

    def __init__(self, *, host: str = "localhost", port: int | None = None):
        # Drake tells an address that nobody needs.
        log = logging.getLogger("drake")
        level = log.level
        log.setLevel(logging.WARNING)
        try:
            # Meshcat's plot of the real-time rate would cover the clock.
            super().__init__(MeshcatParams(host="localhost", port=0, show_stats_plot=False))
        finally:
            log.setLevel(level)
        end_on_this_thread(self)
        front = _Front(host, port, Meshcat.port(self))
        self._port = front.server_port
        threading.Thread(target=front.serve_forever, daemon=True).start()
        weakref.finalize(self, _close, front).atexit = False

    def port(self) -> int:
        """Of the page."""
        return self._port

    def web_url(self) -> str:
        """Address of the page."""
        return f"http://localhost:{self._port}"

    def ws_url(self) -> str:
        """Address of the web socket behind the page."""
        return f"ws://localhost:{self._port}"


def open_live_page(*, host: str = "localhost", port: int | None = None) -> LivePage:
    """Start Meshcat for a scene; its address is `web_url()`.

    Args:
        host: The name that the page answers to; "*" opens it to other machines.
        port: From 1024 up; 0 lets the system choose, None takes the first free one from 7000.

    Raises:
        InvalidInput: The port is out of range.
        RuntimeError: The port is taken.
    """
    require(
        port is None or port == 0 or 1024 <= port <= 65535,
        "port",
        "be 0 or from 1024 to 65535",
        port,
    )
    return LivePage(host=host, port=port)


class _Front(ThreadingHTTPServer):
    """Hands out the page, and passes everything else on to Drake's server."""

    daemon_threads = True

    def __init__(self, host: str, port: int | None, behind: int):
        self.behind = behind
        with urllib.request.urlopen(f"http://localhost:{behind}") as answer:
            page = answer.read().decode()
        page = page.replace("<title>Drake MeshCat</title>", "<title>Sightfield</title>", 1)
        self.page = page.replace(_AFTER_VIEWER, SHOW_WHOLE_WORLD + _AFTER_VIEWER, 1).encode()
        for each in _PORTS if port is None else (port,):
            try:
                super().__init__(("" if host == "*" else host, each), _Answer)
            except OSError:
                continue
            return
        asked = "from 7000 to 7099" if port is None else f"{port}"
        raise RuntimeError(f"no live page at port {asked}: it is taken, or the host is not ours")


class _Answer(BaseHTTPRequestHandler):
    """One request of a browser."""

    def do_GET(self) -> None:
        front = cast("_Front", self.server)
        if self.headers.get("Upgrade", "").lower() == "websocket":
            self._connect(front.behind)
        elif self.path.partition("?")[0] in ("/", "/index.html", "/meshcat.html"):
            self._send(200, "text/html", front.page)
        else:
            behind = http.client.HTTPConnection("localhost", front.behind, timeout=10.0)
            try:
                behind.request("GET", self.path)
                answer = behind.getresponse()
                kind = answer.getheader("Content-Type", "application/octet-stream")
                self._send(answer.status, kind, answer.read())
            finally:
                behind.close()

    def _send(self, status: int, kind: str, body: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def _connect(self, port: int) -> None:
        """Join a web socket to Drake's until either side ends it."""
        head = f"{self.requestline}\r\n" + "".join(
            f"{name}: {value}\r\n" for name, value in self.headers.items()
        )
        with socket.create_connection(("localhost", port)) as behind:
            behind.sendall(f"{head}\r\n".encode("latin-1"))
            back = threading.Thread(
                target=_pass_on, args=(behind.recv, self.connection), daemon=True
            )
            back.start()
            _pass_on(self.rfile.read1, behind)
            back.join()

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing on the terminal."""


def _pass_on(read: Callable[[int], bytes], to: socket.socket) -> None:
    """Pass on what comes until it ends, and then say so."""
    try:
        while piece := read(_PIECE):
            to.sendall(piece)
        to.shutdown(socket.SHUT_WR)
    except OSError:
        # One side is gone: so is the connection.
        pass


def _close(front: _Front) -> None:
    """Stop a server without waiting for it."""

    def close() -> None:
        front.shutdown()
        front.server_close()

    threading.Thread(target=close, daemon=True).start()
