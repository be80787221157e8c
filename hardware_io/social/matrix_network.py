"""The social network on a real server: Matrix.

Each agent has an account and an album, a private room. A friend request is a knock at the album,
acceptance an invitation, rejection a declined knock, unfriending a kick; pictures are posted to the
album, and only members read it. It runs against any homeserver, by its address and tokens.

Nothing here waits for the server but `begin`, `flush` and `close`, and those not for ever. While
the server is down, slow, limits the rate, or breaks off in the middle of a file, everything is
tried again, and comes later. Iterations come as fast as they are called for, so a simulation should
run at the rate of the real clock.
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
        seed: Of the agents' luck.
        outbox: A folder in which pictures are kept until they are posted, so that they survive
            this program; None keeps them in memory.
        run: Name of the run to which the pictures belong. Others' are not shown, nor are those of
            earlier runs. By default each `begin` starts a new one; name it to go on with it in
            another program, or with agents that run in one.
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
        """Start a run: hear who is a friend already, or go on without after a while [s].

        Args:
            patience: How long to wait [s].

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
        """Wait until the server has taken everything, at most so long [s]: whether it has.

        Args:
            patience: How long to wait [s].
        """
        deadline = time.monotonic() + patience
        while self._waiting() > 0 and time.monotonic() < deadline:
            self._background.check()
            time.sleep(0.02)
        return self._waiting() == 0

    def close(self) -> None:
        """Hang up. What the server has not taken stays in the outbox, if there is one."""
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
