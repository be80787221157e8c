"""`sightfield social`: find an evader in the pictures of friends, and go to it; a server to try."""

import signal
import tempfile
import threading
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from ...systems.numerics.errors import InvalidInput, require, require_non_negative
from ..scenario_files import builtin_scenarios, find_scenario, load_scenario
from ..social import scenarios
from ..social.networks import NetworkChoice, open_network, open_trial_server
from ..social.report import summarise_search, write_search_report
from ..social.run import run_social_search
from ..social.scenario import SocialScenario
from ..social.social_game import set_up_social_game
from .shared import (
    JsonSummaryOption,
    MeshcatOption,
    ReplayOption,
    RunByDefault,
    RunFolderOption,
    SecondsOption,
    SeedOption,
    WatchedRun,
    plain_table,
    with_options,
)


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
    console, ended = Console(highlight=False), threading.Event()
    # A terminal that is closed sends the last.
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, lambda *_: ended.set()) for number in numbers}
    try:
        with ExitStack() as stack:
            # Known to be writable before a server takes its time.
            try:
                accounts.touch(0o600, exist_ok=False)
            except OSError as error:
                got = f"{accounts} ({error.strerror})"
                raise InvalidInput(f"`--accounts` must be a new file; got {got}") from None
            stack.callback(accounts.unlink, missing_ok=True)
            folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="sightfield-synapse-"))
            console.print("Setting up Synapse and its accounts: about ten seconds.")
            opened = stack.enter_context(open_trial_server(Path(folder), port))
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


def run(
    scenario: Annotated[
        str,
        typer.Argument(help=f"YAML file, or one of: {', '.join(builtin_scenarios(scenarios))}."),
    ] = "thesis_maze",
    setting: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a key, as search.pictures=2."),
    ] = None,
    network: Annotated[str, typer.Option(help="memory, or matrix for a real server.")] = "memory",
    homeserver: Annotated[
        str | None, typer.Option(metavar="URL", help="With matrix: instead of the accounts' own.")
    ] = None,
    accounts: Annotated[
        Path | None,
        typer.Option(
            help="With matrix: YAML file of accounts and tokens (docs/social-network.md)."
        ),
    ] = None,
    outbox: Annotated[
        Path | None,
        typer.Option(help="With matrix: folder where pictures wait for the server."),
    ] = None,
    seconds: SecondsOption = None,
    seed: SeedOption = None,
    out: RunFolderOption = None,
    as_json: JsonSummaryOption = False,
    meshcat: MeshcatOption = None,
    replay: ReplayOption = True,
    realtime: Annotated[
        float | None,
        typer.Option(
            help="Simulated seconds per second, 0: as fast as possible [default: 1 with matrix, "
            "else 0]."
        ),
    ] = None,
) -> None:
    """A pursuer without a camera makes friends, reads their pictures, and goes to the evader."""
    require_non_negative("--realtime", realtime or 0.0)
    choice = NetworkChoice(kind=network, homeserver=homeserver, accounts=accounts, outbox=outbox)
    settings = with_options(setting, {"--seconds": ("seconds", seconds), "--seed": ("seed", seed)})
    path = find_scenario(scenario, scenarios)
    loaded = load_scenario(SocialScenario, path, settings)
    if loaded.maze.world is not None:
        world = loaded.maze.world.beside(path.parent)
        loaded = replace(loaded, maze=replace(loaded.maze, world=world))
    game = set_up_social_game(loaded)
    watched = WatchedRun(out, as_json=as_json, meshcat=meshcat, replay=replay)
    with watched.opened() as (folder, page):
        with open_network(game, choice) as opened, watched.bar() as bar:
            task = bar.add_task("simulated", total=loaded.seconds)
            done = run_social_search(
                game,
                opened,
                page,
                recording=watched.recording,
                # A server lives by the clock on the wall.
                realtime_rate=realtime if realtime is not None else float(network == "matrix"),
                progress=lambda time: bar.update(task, completed=time),
            )
        summary = summarise_search(done, path.stem, network)
        written = write_search_report(done, summary, folder) if folder is not None else []
    watched.tell(summary, written, plain_table(summary))
    watched.stay()


social: Any = typer.Typer(
    cls=RunByDefault,
    help=(
        "Find an evader in the pictures of friends. Without a command: run, whose options "
        "`sightfield social run --help` lists."
    ),
    invoke_without_command=True,
    rich_markup_mode=None,
)
social.command()(run)
social.command()(server)
