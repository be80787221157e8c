"""Which social network a search uses: one in memory, or a real server.

The one place where diagrams know `hardware_io`, as its station swaps simulation for the real thing.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from ...hardware_io.social.local_server import LocalServer
from ...systems.numerics.errors import require, require_extra, require_one_of
from ...systems.numerics.social.network.acceptance import MemoryNetwork
from ...systems.numerics.social.network.interface import SocialNetwork
from .social_game import SocialGame

KINDS = ("memory", "matrix")
# How long the end of a run waits until a server has taken everything [s].
_PATIENCE = 20.0


@dataclass(frozen=True, kw_only=True)
class NetworkChoice:
    """Which network, and where.

    Attributes:
        kind: One of KINDS.
        accounts: YAML file of accounts on a homeserver, as `hardware_io.social.accounts` has it.
        homeserver: Its address, instead of the file's.
        outbox: A folder in which pictures wait until the server has them; None: in memory.

    Raises:
        InvalidInput: The kind is none, or accounts are missing, or given for nothing.
    """

    kind: str = "memory"
    accounts: Path | None = None
    homeserver: str | None = None
    outbox: Path | None = None

    def __post_init__(self) -> None:
        require_one_of("--network", self.kind, KINDS)
        if self.kind == "matrix":
            require(self.accounts is not None, "--accounts", "name a file of accounts", "nothing")
        for name in ("accounts", "homeserver", "outbox"):
            value = getattr(self, name)
            require(
                self.kind == "matrix" or value is None,
                f"--{name}",
                "be given with --network matrix alone",
                value,
            )


@contextmanager
def open_network(game: SocialGame, choice: NetworkChoice) -> Iterator[SocialNetwork]:
    """A network whose common agents answer as the game's do.

    Raises:
        InvalidInput: The accounts are not those of the game, the server does not answer or refuses
            a token, or matrix-nio is not installed.
    """
    if choice.kind == "memory":
        yield MemoryNetwork(game.temperaments, game.scenario.seed)
        return
    require_extra("`--network` matrix", "social", ["nio"])
    from ...hardware_io.social.accounts import check_accounts, load_directory
    from ...hardware_io.social.matrix_network import MatrixNetwork

    assert choice.accounts is not None
    directory = load_directory(choice.accounts)
    if choice.homeserver is not None:
        directory = replace(directory, homeserver=choice.homeserver)
    require(
        len(directory.agents) == game.scenario.agents.size,
        "--accounts",
        f"have {game.scenario.agents.size} common agents",
        len(directory.agents),
    )
    # A server that goes away later is waited for; one that was never there is a mistake.
    check_accounts(directory)
    network = MatrixNetwork(
        directory, game.temperaments, seed=game.scenario.seed, outbox=choice.outbox
    )
    with network:
        yield network
        network.flush(_PATIENCE)


def open_trial_server(folder: Path, port: int) -> LocalServer:
    """A homeserver on this machine, a context manager that starts and stops it.

    Args:
        folder: For everything that it keeps.
        port: Where it listens.

    Raises:
        InvalidInput: Synapse is not installed.
    """
    return LocalServer(folder, port)
