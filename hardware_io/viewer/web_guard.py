"""What a page of the laboratory asks of whoever calls, and tells browsers to forbid.

By DNS rebinding a page of another site reaches this machine under a name of that site, so the name
is looked at; another page of the same browser is known by its origin; and none may frame ours.
"""

from collections.abc import Iterable

# Only what is served here is loaded, and pages of this machine are asked, the stop page among them.
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
