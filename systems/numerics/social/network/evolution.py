"""Network evolution: whom to ask, whom to pass over, who is a friend.

Algorithm 2, one iteration: ask new agents, while at most N_req answers are awaited and friends and
requests together stay within N_f; let the agents answer; then, for each agent that was asked: a
friend if it accepted, else its counter goes up, and beyond T_wait it is passed over, or, if it
rejected, asked again. Deviations from the printed lines:

- The counter is compared with T_wait after a rejection too (2.3.2 says so in words).
- An agent that unfriends, or is passed over, is a new common agent again (2.3.2), the last in line.
- Line 5 has "length(F) + length(A) <= N_f", by which N_f + 1 friends can come about: here "<".
- A request is withdrawn when its agent is passed over. If the agent accepts at the same moment, it
  becomes a friend if there is room, and is left again if not.

All agents asked are in A, so between two readings of the answers at most N_req requests are sent,
repeated ones included.

Source: Zhang 2014, Algorithm 2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from ...checked import Checked, whole
from ...errors import require, require_whole
from .interface import Answer, Response, SocialNetwork

STRANGER, FRIEND = -2, -1


@dataclass(frozen=True, kw_only=True)
class EvolutionLimits(Checked):
    """Parameters of Algorithm 2; the defaults are Table 2.3's, which has no N_f.

    Attributes:
        requests: N_req, most answers awaited at once.
        patience: T_wait, iterations without acceptance after which the next one gives up.
        friends: N_f, most friends.

    Raises:
        InvalidInput: A number is not whole, or out of its range.
    """

    requests: Annotated[int, whole(1)] = 3
    patience: Annotated[int, whole(0)] = 10
    friends: Annotated[int, whole(1)] = 3


@dataclass(frozen=True)
class Acquaintances:
    """What the pursuer knows of all agents between two iterations.

    Attributes:
        status: For each agent STRANGER, FRIEND, or its counter c >= 0 while an answer is awaited.
        queue: All agents, those asked longest ago first.
    """

    status: tuple[int, ...]
    queue: tuple[int, ...]

    @property
    def friends(self) -> tuple[int, ...]:
        """The set F, rising."""
        return tuple(i for i, status in enumerate(self.status) if status == FRIEND)

    @property
    def waiting(self) -> tuple[int, ...]:
        """The set A, rising."""
        return tuple(i for i, status in enumerate(self.status) if status >= 0)


@dataclass(frozen=True)
class Errands:
    """Requests to send, and to withdraw, after the answers are read.

    Attributes:
        again: Agents to ask again.
        withdrawn: Agents whose request is to be withdrawn.
    """

    again: tuple[int, ...]
    withdrawn: tuple[int, ...]


@dataclass(frozen=True)
class Iteration:
    """One iteration of Algorithm 2.

    Attributes:
        known: What is known after it.
        asked: Agents whose answer was awaited in it; those that are friends now accepted.
        requests_sent: How many went out, repeated ones included.
    """

    known: Acquaintances
    asked: tuple[int, ...]
    requests_sent: int


def strangers(count: int) -> Acquaintances:
    """Agents 0 to count - 1, none of them asked yet.

    Raises:
        InvalidInput: The count is no whole number from 0.
    """
    require_whole("count", count, 0)
    return Acquaintances((STRANGER,) * count, tuple(range(count)))


def with_friends(count: int, friends: Sequence[int]) -> Acquaintances:
    """As `strangers`, but some are friends already.

    Args:
        count: Number of agents.
        friends: Numbers of those that are.

    Raises:
        InvalidInput: A friend is none of the agents.
    """
    require(set(friends) <= set(range(count)), "friends", f"be agents below {count}", friends)
    status = tuple(FRIEND if i in friends else STRANGER for i in range(count))
    return Acquaintances(status, tuple(range(count)))


def choose_new(
    known: Acquaintances, limits: EvolutionLimits, interest: Sequence[float] | None = None
) -> tuple[Acquaintances, tuple[int, ...]]:
    """Lines 4 to 10: choose new agents to ask; returns the updated knowledge and the agents.

    Args:
        known: What is known before.
        limits: N_req and N_f.
        interest: Interest in each agent; greater interest is asked first. At equal interest, and by
            default, those asked longest ago come first.
    """
    waiting = len(known.waiting)
    room = min(limits.requests - waiting, limits.friends - len(known.friends) - waiting)
    line = [i for i in known.queue if known.status[i] == STRANGER]
    if interest is not None:
        line.sort(key=lambda i: -interest[i])
    chosen = tuple(line[: max(room, 0)])
    status = tuple(0 if i in chosen else each for i, each in enumerate(known.status))
    queue = tuple(i for i in known.queue if i not in chosen) + chosen
    return Acquaintances(status, queue), chosen


def take_answers(
    known: Acquaintances, limits: EvolutionLimits, responses: Sequence[Response]
) -> tuple[Acquaintances, Errands]:
    """Lines 11 to 27, and unfriending: what is known after the answers, and what to send."""
    status, again, withdrawn = list(known.status), [], []
    taken = len(known.friends) + len(known.waiting)
    for agent in range(len(status)):
        answers = [each.answer for each in responses if each.agent == agent]
        # An agent can accept and unfriend between two readings: the last answer counts.
        lasting = [answer for answer in answers if answer is not Answer.REJECTED]
        if lasting:
            late = lasting[-1] is Answer.ACCEPTED and status[agent] == STRANGER
            if late and taken >= limits.friends:
                withdrawn.append(agent)
            else:
                taken += late
                status[agent] = FRIEND if lasting[-1] is Answer.ACCEPTED else STRANGER
        elif status[agent] >= 0:
            status[agent] += 1
            rejected = Answer.REJECTED in answers
            if status[agent] > limits.patience:
                status[agent] = STRANGER
                if not rejected:
                    withdrawn.append(agent)
            elif rejected:
                again.append(agent)
    return Acquaintances(tuple(status), known.queue), Errands(tuple(again), tuple(withdrawn))


def evolve(
    network: SocialNetwork,
    known: Acquaintances,
    limits: EvolutionLimits,
    iteration: int,
    interest: Sequence[float] | None = None,
) -> Iteration:
    """One iteration of Algorithm 2 on a network.

    Args:
        network: Network with agents 0 to n - 1.
        known: What is known before.
        limits: N_req, N_f and T_wait.
        iteration: Number of the iteration.
        interest: Interest in asking each agent; None: agents are asked in turn.
    """
    known, chosen = choose_new(known, limits, interest)
    for agent in chosen:
        network.request(agent)
    asked = known.waiting
    network.advance(iteration)
    known, errands = take_answers(known, limits, network.responses())
    for agent in errands.withdrawn:
        network.withdraw(agent)
    for agent in errands.again:
        network.request(agent)
    return Iteration(known, asked, len(chosen) + len(errands.again))
