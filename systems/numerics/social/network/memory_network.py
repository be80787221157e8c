"""A social network in memory: the embedded default."""

from collections import deque

import numpy as np

from ...errors import require, require_whole
from .acceptance import Temperaments, draw_responses
from .interface import Answer, NotFriends, Picture, Response

# Pictures of each album that are held.
_NEWEST = 100


class MemoryNetwork:
    """The social network of a simulation; a `SocialNetwork`.

    In each iteration every agent with an open request accepts, rejects or is silent, and every
    friend may unfriend, with the probabilities of its temperament. A run repeats exactly from
    `begin`. Of an album the newest 100 pictures are held.

    Args:
        temperaments: How the agents answer.
        seed: Of the generator.

    Raises:
        InvalidInput: The seed is not a whole number from 0.
    """

    def __init__(self, temperaments: Temperaments, seed: int):
        require_whole("seed", seed, 0)
        self._temperaments, self._seed = temperaments, seed
        self.begin()

    def agents(self) -> tuple[int, ...]:
        """All agents, rising."""
        return tuple(range(self._temperaments.count))

    def begin(self) -> None:
        """Forget everything, and restart the same random numbers."""
        self._generator = np.random.default_rng(self._seed)
        self._asked: set[int] = set()
        self._friends: set[int] = set()
        self._responses: list[Response] = []
        self._albums: list[deque[Picture]] = [deque(maxlen=_NEWEST) for _ in self.agents()]

    def advance(self, iteration: int) -> None:
        """Let every agent act once."""
        drawn = draw_responses(self._temperaments, self._asked, self._friends, self._generator)
        for each in drawn:
            self._asked.discard(each.agent)
            if each.answer is Answer.ACCEPTED:
                self._friends.add(each.agent)
            elif each.answer is Answer.UNFRIENDED:
                self._friends.discard(each.agent)
        self._responses += drawn

    def request(self, agent: int) -> None:
        """Ask an agent, unless it is a friend."""
        self._require_agent(agent)
        if agent not in self._friends:
            self._asked.add(agent)

    def withdraw(self, agent: int) -> None:
        """Take a request back, or leave a friend."""
        self._require_agent(agent)
        self._asked.discard(agent)
        self._friends.discard(agent)

    def responses(self) -> list[Response]:
        """What agents did since the last call, in order."""
        found, self._responses = self._responses, []
        return found

    def friends(self) -> frozenset[int]:
        """Agents whose album the pursuer may read now."""
        return frozenset(self._friends)

    def post(self, agent: int, picture: Picture) -> None:
        """Put a picture into an album, behind the earlier ones.

        Raises:
            InvalidInput: There is no such agent, or the picture is not its own.
        """
        self._require_agent(agent)
        require(picture.agent == agent, "picture.agent", f"be {agent}", picture.agent)
        self._albums[agent].append(picture)

    def latest(self, agent: int, count: int) -> list[Picture]:
        """A friend's most recent pictures, newest first.

        Args:
            agent: Whose.
            count: How many, at most.

        Raises:
            InvalidInput: There is no such agent, or the count is no whole number from 0.
            NotFriends: The agent is not a friend.
        """
        self._require_agent(agent)
        require_whole("count", count, 0)
        if agent not in self._friends:
            raise NotFriends(f"agent {agent} is not a friend: its album cannot be read")
        return list(reversed(self._albums[agent]))[:count]

    def _require_agent(self, agent: int) -> None:
        require(agent in self.agents(), "agent", f"be below {len(self.agents())}", agent)
