"""`sightfield social server`: a social network of one's own on this machine, to try a search on."""

import signal
import tempfile
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ...systems.numerics.errors import require
from ..social.networks import open_trial_server


def server(
    agents: Annotated[int, typer.Option(help="Common agents; the thesis's maze has three.")] = 3,
    port: Annotated[int, typer.Option(help="Of this machine, where the server listens.")] = 8008,
    accounts: Annotated[
        Path, typer.Option(help="New file of accounts and tokens; it goes with the server.")
    ] = Path("accounts.yaml"),
) -> None:
    """Run a Matrix homeserver (Synapse) with accounts for trying, until Ctrl-C.

    It listens on this machine alone, knows no other server, and forgets everything at its end.
    """
    require(agents >= 1, "--agents", "be at least 1", agents)
    require(1024 <= port <= 65535, "--port", "be from 1024 to 65535", port)
    require(not accounts.exists(), "--accounts", "be a new file", accounts)
    console, ended = Console(highlight=False), threading.Event()
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.signal(number, lambda *_: ended.set()) for number in numbers}
    try:
        with ExitStack() as stack:
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="sightfield-synapse-"))
            console.print("Setting up Synapse and its accounts: about ten seconds.")
            opened = stack.enter_context(open_trial_server(Path(folder), port))
            stack.callback(accounts.unlink, missing_ok=True)
            opened.make_accounts(agents, accounts)
            console.print(f"The server is up at [bold]{opened.url}[/]. In another terminal:")
            console.print(
                f"sightfield social --network matrix --accounts {accounts}", soft_wrap=True
            )
            console.print("Ctrl-C ends it, and its accounts with it.")
            while not ended.wait(0.5):
                opened.check()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
