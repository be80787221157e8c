"""The social network on a real server: Matrix.

Each agent has an account and an album, a private room. A friend request is a knock at the album,
acceptance an invitation, rejection a declined knock, unfriending a kick; pictures are posted to the
album, and only members read it. It runs against any homeserver, by its address and tokens.

Only `begin`, `flush` and `close` wait for the server, each for a limited time. While the server is
down, slow, limits the rate, or breaks off in the middle of a file, everything is tried again, and
comes later. Iterations follow each other as fast as they are called, so a simulation should run in
real time.
"""

import time
import uuid
from pathlib import Path
from types import TracebackType
from typing import Self

from ...systems.numerics.errors import require, require_whole
from ...systems.numerics.social.network.acceptance import Temperaments
from ...systems.numerics.social.network.interface import NotFriends, Picture, Response
from .accounts import SocialDirectory
from .common_agents import CommonAgents
from .matrix_client import Background
from .pursuer_account import PursuerAccount, Run

# Pictures of each album whose files are held.
_NEWEST = 16


class MatrixNetwork:
    """A `SocialNetwork` on a Matrix homeserver, from construction until `close`.

    Args:
        directory: The homeserver and its accounts.
        temperaments: How the common agents answer, if this program is to answer for them.
        seed: Seed of the agents' random answers.
        outbox: A folder in which pictures are kept until they are posted, so that they survive
            this program; None keeps them in memory.
        run: Name of the run to which the pictures belong; pictures of other runs are not shown. By
            default each `begin` starts a new run. Give a name to continue a run in another program,
            or to share it with agents run by another program.
        run_agents: Whether this program posts for the agents, and answers if it has temperaments.

    Raises:
        InvalidInput: A token is missing, or the temperaments are of another number of agents.
    """

    def __init__(
        self,
        directory: SocialDirectory,
        temperaments: Temperaments | None = None,
        *,
        seed: int = 0,
        outbox: Path | None = None,
        run: str | None = None,
        run_agents: bool = True,
    ) -> None:
        self._count, self._name = len(directory.agents), run
        self._run = self._new_run()
        self._background = Background("matrix")
        try:
            self._agents = (
                CommonAgents(self._background, directory, temperaments, seed, outbox)
                if run_agents
                else None
            )
            self._pursuer = PursuerAccount(
                self._background,
                directory.homeserver,
                directory.pursuer,
                [agent.album for agent in directory.agents],
                _NEWEST,
            )
        except BaseException:
            self._background.close(_nothing)
            raise

    def agents(self) -> tuple[int, ...]:
        """All agents, rising."""
        return tuple(range(self._count))

    def begin(self, patience: float = 10.0) -> None:
        """Start a run: wait for the first news, which tells the present friends.

        Args:
            patience: After this time, start without the news [s].

        Raises:
            ServerRefusal: The server does not take a token.
        """
        self._run = self._new_run()
        deadline = time.monotonic() + patience
        while not self._pursuer.informed.wait(0.05) and time.monotonic() < deadline:
            self._background.check()
        self._pursuer.responses()

    def advance(self, iteration: int) -> None:
        """Let the agents answer.

        Args:
            iteration: Its number.

        Raises:
            ServerRefusal: The server takes a token no more.
        """
        self._background.check()
        if self._agents is not None:
            self._agents.advance()

    def request(self, agent: int) -> None:
        """Knock at an agent's album."""
        self._require_agent(agent)
        self._pursuer.request(agent)

    def withdraw(self, agent: int) -> None:
        """Take a knock back, or leave a friend's album."""
        self._require_agent(agent)
        self._pursuer.withdraw(agent)

    def responses(self) -> list[Response]:
        """What agents did since the last call, in order."""
        return self._pursuer.responses()

    def friends(self) -> frozenset[int]:
        """Agents whose album the pursuer is a member of."""
        return self._pursuer.friends()

    def post(self, agent: int, picture: Picture) -> None:
        """Put a picture into an agent's album, behind the earlier ones.

        Raises:
            InvalidInput: The agents are run by somebody else.
        """
        self._require_agent(agent)
        require(picture.agent == agent, "picture.agent", f"be {agent}", picture.agent)
        require(self._agents is not None, "run_agents", "be true to post for an agent", False)
        if self._agents is not None:
            self._agents.post(agent, picture, self._run.name)

    def latest(self, agent: int, count: int) -> list[Picture]:
        """A friend's most recent pictures whose files have come, newest first, at most 16.

        Args:
            agent: Whose.
            count: How many, at most.

        Raises:
            InvalidInput: There is no such agent.
            NotFriends: The agent is not a friend.
        """
        self._require_agent(agent)
        require_whole("count", count, 0)
        if agent not in self._pursuer.friends():
            raise NotFriends(f"agent {agent} is not a friend: its album cannot be read")
        return self._pursuer.latest(agent, count, self._run)

    def flush(self, patience: float) -> bool:
        """Wait until the server has taken everything; returns whether it has.

        Args:
            patience: How long to wait at most [s].
        """
        deadline = time.monotonic() + patience
        while self._waiting() > 0 and time.monotonic() < deadline:
            self._background.check()
            time.sleep(0.02)
        return self._waiting() == 0

    def close(self) -> None:
        """Close the connections; what is not posted stays in the outbox, if there is one."""
        self._background.close(self._hang_up)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _new_run(self) -> Run:
        return Run(self._name or uuid.uuid4().hex, time.time())

    def _waiting(self) -> int:
        return self._pursuer.waiting + (0 if self._agents is None else self._agents.waiting)

    async def _hang_up(self) -> None:
        await self._pursuer.close()
        if self._agents is not None:
            await self._agents.close()

    def _require_agent(self, agent: int) -> None:
        require(agent in self.agents(), "agent", f"be below {self._count}", agent)


async def _nothing() -> None:
    """There is nothing to hang up."""
