"""`sightfield station view`: the operator's view, opened again while runs go on."""

from rich.console import Console

from ...station.hardware import open_view
from .options import DEFAULT_PORT, PortOption


def view(port: PortOption = DEFAULT_PORT) -> None:
    """Open the operator's view if it is not; runs that are under way find it by themselves."""
    console = Console(highlight=False)
    opened = open_view(port)
    console.print(f"Operator's view: [bold]{opened.url}[/]")
    console.print("It stops every run; the address that a run printed starts and pauses it.")
