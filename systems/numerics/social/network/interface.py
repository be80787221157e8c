"""The pursuer's interface to a social network, and the network in memory, which is the default.

Agents are integers from 0. No call waits for a server: it is carried out when possible, and its
outcome appears in later `responses`. `scan` reads the newest pictures of every friend, each only
once; Algorithm 3 would read the same picture again and again while nothing newer is posted.

Source: Zhang 2014, 2.3.2 and Algorithm 3; the interface is ours.
"""

from collections import deque
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Protocol

import numpy as np

from ...errors import SightfieldError, require, require_whole
from .acceptance import Temperaments, draw_responses


class NotFriends(SightfieldError):
    """Pictures were asked for of an agent that is not a friend."""


class Answer(Enum):
    """What an agent does with a request, or with a friendship. Silence is no answer."""

    ACCEPTED = "accepted"
    REJECTED = "rejected"
    UNFRIENDED = "unfriended"


@dataclass(frozen=True, kw_only=True)
class Response:
    """Something an agent did.

    Attributes:
        agent: Who.
        answer: What.
    """

    agent: int
    answer: Answer


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A picture in an agent's album.

    Attributes:
        id: Its name, unlike that of any other picture of the network.
        agent: Who posted it.
        time: When it was taken [s].
        data: The encoded file. PNG or JPEG is expected, but people post anything.
    """

    id: str
    agent: int
    time: float
    data: bytes


class SocialNetwork(Protocol):
    """One pursuer's account and the albums of the common agents."""

    def agents(self) -> tuple[int, ...]:
        """All agents that have an account, rising."""
        ...

    def begin(self) -> None:
        """Start a run. In memory everything is forgotten; a server keeps what it knows."""
        ...

    def advance(self, iteration: int) -> None:
        """Let agents answer; called in each iteration between sending requests and `responses`."""
        ...

    def request(self, agent: int) -> None:
        """Ask an agent for its friendship. Asking twice is asking once."""
        ...

    def withdraw(self, agent: int) -> None:
        """Take a request back; if it was accepted meanwhile, end the friendship."""
        ...

    def responses(self) -> list[Response]:
        """What agents did since the last call, in order."""
        ...

    def friends(self) -> frozenset[int]:
        """Agents whose album the pursuer may read now."""
        ...

    def post(self, agent: int, picture: Picture) -> None:
        """Put a picture into its agent's album, behind the earlier ones."""
        ...

    def latest(self, agent: int, count: int) -> list[Picture]:
        """A friend's most recent pictures, newest first, at most `count`.

        Raises:
            NotFriends: The agent is not a friend.
        """
        ...


@dataclass(frozen=True)
class Scan:
    """One look at the friends' albums.

    Attributes:
        pictures: Those not looked at before; by friend, then the oldest first.
        seen: Ids of each friend's newest pictures at its last look, for the next scan.
    """

    pictures: tuple[Picture, ...]
    seen: Mapping[int, frozenset[str]]


def scan(
    network: SocialNetwork, friends: Collection[int], count: int, last: Scan | None = None
) -> Scan:
    """Look at the most recent pictures of every friend.

    Albums only grow at their end, so a picture that has left an album's newest ones never returns
    to them: it is enough to remember the newest ones of the last look.

    Args:
        network: The network.
        friends: Agents whose albums are to be read; one that is no longer a friend is skipped.
        count: N_img, pictures of each friend.
        last: The previous scan; by default none.
    """
    seen = dict(last.seen) if last is not None else {}
    found: list[Picture] = []
    for friend in sorted(friends):
        try:
            newest = network.latest(friend, count)
        except NotFriends:
            continue
        known = seen.get(friend, frozenset())
        found += [picture for picture in reversed(newest) if picture.id not in known]
        seen[friend] = frozenset(picture.id for picture in newest)
    return Scan(tuple(found), seen)


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
