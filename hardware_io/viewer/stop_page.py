"""A page with a single button, served by the controller itself: it stops while the view is down."""

import html
import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from .operator import MODE_NAMES, Operator
from .web_guard import HEADERS, is_host, is_origin

_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><link rel="icon" href="data:,">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Sightfield: stop</title><style>
body {{ margin: 0; padding: 16px; font: 18px/1.4 system-ui, sans-serif; background: #fbfbfa; }}
h1 {{ font-size: 20px; margin: 0 0 8px; }}
button {{ width: 100%; height: 60vh; font: inherit; font-size: 36px; font-weight: 700; color: #fff;
         background: #c81e1e; border: 2px solid #8f1212; border-radius: 12px; cursor: pointer; }}
</style></head><body><h1>{title}</h1><p id="state">{state}</p>
<form method="post" action="stop"><button id="stop" autofocus>EMERGENCY STOP</button></form>
</body></html>
"""


class StopPage:
    """Serves the button until it is closed, in a thread of its own.

    Anybody on this machine may stop robots; nobody starts any here.

    Args:
        operator: Who is told.
        title: Of the run.
        view_port: Of the operator's view, whose page may ask for a stop as well.
    """

    def __init__(self, operator: Operator, title: str, view_port: int) -> None:
        class Handler(_Handler):
            pass

        Handler.operator, Handler.title = operator, title
        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        port = int(self._server.server_address[1])
        Handler.port, Handler.view_port = port, view_port
        self.url = f"http://127.0.0.1:{port}/"
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def __enter__(self) -> "StopPage":
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._server.server_close()


class _Handler(BaseHTTPRequestHandler):
    operator: Operator
    title: str
    port: int
    view_port: int
    # A caller that says nothing does not keep its thread for ever [s].
    timeout = 10

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing in the terminal."""

    def do_GET(self) -> None:
        """The page."""
        if not is_host(self.headers["Host"], self.port):
            self._answer(403, "text/plain", "not for this machine\n")
        elif self.path != "/":
            self._answer(404, "text/plain", "nothing is here\n")
        else:
            stop, state = self.operator.stopped, MODE_NAMES[self.operator.mode]
            if stop is not None:
                state = f"Stopped by {stop.who} at {stop.when}. {stop.acknowledgement}"
            page = _PAGE.format(title=html.escape(self.title), state=html.escape(state))
            self._answer(200, "text/html; charset=utf-8", page)

    def do_POST(self) -> None:
        """The stop."""
        known = is_origin(self.headers["Origin"], (self.port, self.view_port))
        if not (known and is_host(self.headers["Host"], self.port) and self.path == "/stop"):
            self._answer(403, "text/plain", "not for this machine\n")
            return
        self.operator.say("stop", "the stop page")
        if "text/html" in self.headers.get("Accept", ""):
            self._answer(303, "text/plain", "", Location="/")
        else:
            stop = self.operator.stopped
            self._answer(200, "application/json", json.dumps(stop and vars(stop)))

    def _answer(self, status: int, kind: str, text: str, **headers: str) -> None:
        data = text.encode()
        self.send_response(status)
        for name, value in (HEADERS | headers).items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)
