"""How agents answer: how likely each is to accept a request, and the network in memory that asks.

There are two models of acceptance: a fixed probability for each agent, as in Table 2.4, and one
that grows with the number of friends that the agent and the pursuer have in common (the future work
of Zhang 2014, 4.4). The network in memory is the embedded default.
"""

from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from ...checked import Chance, Checked
from ...errors import require, require_chances, require_whole
from .interface import Answer, NotFriends, Picture, Response


class Acceptance(Protocol):
    """An acceptance model of a fixed number of agents."""

    def count(self) -> int:
        """Number of agents."""
        ...

    def probability(self, agent: int, friends: Collection[int]) -> float:
        """Probability that an asked agent accepts in one iteration, given the pursuer's friends."""
        ...


@dataclass(frozen=True)
class OwnAcceptance(Checked):
    """Each agent has its own probability, whoever the pursuer's friends are.

    Attributes:
        friending: Probability of each agent, per iteration.

    Raises:
        InvalidInput: A probability is none.
    """

    friending: Annotated[tuple[float, ...], require_chances]

    def count(self) -> int:
        """How many agents there are."""
        return len(self.friending)

    def probability(self, agent: int, friends: Collection[int]) -> float:
        """The agent's own probability, whoever the friends are."""
        return self.friending[agent]


@dataclass(frozen=True)
class MutualFriendsAcceptance(Checked):
    """Each friend in common gives the request one more chance.

    With m friends of the pursuer among the agent's acquaintances, each of whom persuades it with
    probability w independently, p(m) = 1 - (1 - p) (1 - w)^m.

    Attributes:
        friending: p of each agent, per iteration, without friends in common.
        acquaintances: Pairs of agents that know each other.
        persuasion: w, a probability.

    Raises:
        InvalidInput: A probability is none, or a pair is not of two agents.
    """

    friending: Annotated[tuple[float, ...], require_chances]
    acquaintances: frozenset[tuple[int, int]]
    persuasion: Chance = 0.2

    def __post_init__(self):
        super().__post_init__()
        for pair in self.acquaintances:
            two = len(pair) == 2 and pair[0] != pair[1] and set(pair) <= set(range(self.count()))
            require(two, "acquaintances", f"be pairs of two agents below {self.count()}", pair)

    def count(self) -> int:
        """How many agents there are."""
        return len(self.friending)

    def mutual_friends(self, agent: int, friends: Collection[int]) -> int:
        """How many of the friends know the agent."""
        return sum(
            (agent, friend) in self.acquaintances or (friend, agent) in self.acquaintances
            for friend in friends
        )

    def probability(self, agent: int, friends: Collection[int]) -> float:
        """Probability that the agent accepts in one iteration, p(m)."""
        refusal = (1 - self.persuasion) ** self.mutual_friends(agent, friends)
        return 1 - (1 - self.friending[agent]) * refusal


@dataclass(frozen=True, kw_only=True)
class Temperaments:
    """How the common agents answer.

    Attributes:
        acceptance: Model of acceptance.
        unfriending: Probability of each agent, per iteration, of ending a friendship.
        rejection: Probability of each agent, per iteration, of saying no if it does not accept;
            otherwise it is silent.

    Raises:
        InvalidInput: A probability is none, or the numbers of agents differ.
    """

    acceptance: Acceptance
    unfriending: tuple[float, ...]
    rejection: tuple[float, ...]

    def __post_init__(self):
        count = self.acceptance.count()
        for name, values in (("unfriending", self.unfriending), ("rejection", self.rejection)):
            require(len(values) == count, name, f"have {count} values", len(values))
            require_chances(name, values)

    @property
    def count(self) -> int:
        """Number of agents."""
        return self.acceptance.count()


def thesis_temperaments(rejection: Sequence[float] = (0.2, 0.2, 0.2)) -> Temperaments:
    """Table 2.4's three agents. The table has no rejections, so their share is ours."""
    return Temperaments(
        acceptance=OwnAcceptance((0.4, 0.5, 0.3)),
        unfriending=(0.05, 0.02, 0.04),
        rejection=tuple(rejection),
    )


def draw_responses(
    temperaments: Temperaments,
    asked: Collection[int],
    friends: Collection[int],
    generator: np.random.Generator,
) -> list[Response]:
    """One iteration's responses, rising by agent.

    Two random numbers are drawn for each agent whatever it does, so that one agent's answers do not
    affect another's numbers.

    Args:
        temperaments: Temperaments of all agents.
        asked: Agents with an open request.
        friends: The pursuer's friends at the beginning of the iteration.
        generator: Random generator.
    """
    first, second = generator.random((2, temperaments.count))
    found = []
    for agent in range(temperaments.count):
        if agent in friends:
            if first[agent] < temperaments.unfriending[agent]:
                found.append(Response(agent=agent, answer=Answer.UNFRIENDED))
        elif agent in asked:
            if first[agent] < temperaments.acceptance.probability(agent, friends):
                found.append(Response(agent=agent, answer=Answer.ACCEPTED))
            elif second[agent] < temperaments.rejection[agent]:
                found.append(Response(agent=agent, answer=Answer.REJECTED))
    return found


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
