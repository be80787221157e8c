"""How agents answer: how likely each is to accept a request, and what it does in an iteration.

There are two models of acceptance: a fixed probability for each agent, as in Table 2.4, and one
that grows with the number of friends that the agent and the pursuer have in common (the future work
of Zhang 2014, 4.4).
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Annotated, Protocol

import numpy as np

from ...checked import Chance, Checked
from ...errors import require, require_chances
from .interface import Answer, Response


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
