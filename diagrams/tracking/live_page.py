"""The page on which a run is watched while it goes on."""

from pydrake.geometry import Meshcat, MeshcatParams

from ...systems.numerics.errors import require


def open_live_page(*, host: str = "localhost", port: int | None = None) -> Meshcat:
    """Start Meshcat for the tracking scene; its address is `web_url()`.

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
    # Meshcat's plot of the real-time rate would cover the clock.
    return Meshcat(MeshcatParams(host=host, port=port, show_stats_plot=False))
