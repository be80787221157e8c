"""The common agents on a homeserver: they post, and answer whoever knocks by their temperaments."""

from pathlib import Path

import numpy as np

from ...systems.numerics.errors import require, require_whole
from ...systems.numerics.social.network.acceptance import Temperaments, draw_responses
from ...systems.numerics.social.network.interface import Answer, Picture
from .accounts import SocialDirectory
from .album_keeper import AlbumKeeper
from .background import Background


class CommonAgents:
    """All agents of a directory.

    Args:
        background: Where it is waited for the server.
        directory: With every agent's token.
        temperaments: How they answer; None: somebody else answers for them.
        seed: Of their luck.
        outbox: Folder for pictures on their way; None keeps them in memory only.

    Raises:
        InvalidInput: A token is missing, or the temperaments are of another number of agents.
    """

    def __init__(
        self,
        background: Background,
        directory: SocialDirectory,
        temperaments: Temperaments | None,
        seed: int,
        outbox: Path | None,
    ) -> None:
        require_whole("seed", seed, 0)
        count = len(directory.agents)
        lacking = [agent.user for agent in directory.agents if not agent.token]
        require(not lacking, "agents", "have tokens to be run from here", ", ".join(lacking))
        if temperaments is not None:
            require(temperaments.count == count, "temperaments", f"be of {count}", temperaments)
        self._temperaments, self._generator = temperaments, np.random.default_rng(seed)
        self._keepers = [
            AlbumKeeper(
                background,
                directory.homeserver,
                agent,
                None if outbox is None else outbox / f"agent{number}",
            )
            for number, agent in enumerate(directory.agents)
        ]

    @property
    def waiting(self) -> int:
        """Errands that the server has not taken yet."""
        return sum(keeper.waiting for keeper in self._keepers)

    def post(self, agent: int, picture: Picture, run: str) -> None:
        """Put a run's picture into an agent's album."""
        self._keepers[agent].post(picture, run)

    def advance(self) -> None:
        """Let every agent act once on everybody who knocks, and on every friend."""
        if self._temperaments is None:
            return
        knocking = [keeper.visitors("knock") for keeper in self._keepers]
        inside = [keeper.visitors("join") for keeper in self._keepers]
        for user in sorted(frozenset().union(*knocking, *inside)):
            asked = {i for i, users in enumerate(knocking) if user in users}
            friends = {i for i, users in enumerate(inside) if user in users}
            drawn = draw_responses(self._temperaments, asked, friends, self._generator)
            for each in drawn:
                keeper = self._keepers[each.agent]
                if each.answer is Answer.ACCEPTED:
                    keeper.let_in(user)
                else:
                    keeper.send_away(user)

    async def close(self) -> None:
        """Hang up."""
        for keeper in self._keepers:
            await keeper.close()
