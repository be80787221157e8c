"""Network evolution: whom to ask, in turn or by information; whom to pass over, who is a friend.

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

Of several agents the one is worth most whose picture tells most. The pursuer believes the evader to
be in cell x with probability b(x). If it is there, agent i's next picture shows it with probability
v_i(x). A picture that shows the evader gives its cell; one that does not makes the cells in view
less likely. The expected loss of entropy is

    I = H(b) - P H(b | not shown),    P = sum b (1 - v),    b(x | not shown) = b (1 - v) / P.

The value of asking the agent is I times the probability that it accepts.

Source: Zhang 2014, Algorithm 2; information: ours (4.4 asks for it); the entropy is Shannon's.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np

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


def entropy(distribution: np.ndarray) -> float:
    """Entropy of a probability distribution [nats]; weights of any shape, summing to one."""
    positive = distribution[distribution > 0]
    return float(-(positive * np.log(positive)).sum())


def expected_information(belief: np.ndarray, view: np.ndarray) -> float:
    """I of one picture [nats], never negative.

    Args:
        belief: b(x), shape (cells,), summing to one.
        view: v_i(x), same shape, from 0 to 1.

    Raises:
        InvalidInput: The belief is no distribution, or the view has values that are not
            probabilities.
    """
    proper = bool((belief >= 0).all()) and abs(float(belief.sum()) - 1) < 1e-9
    require(proper, "belief", "be probabilities that sum to one", belief.sum())
    allowed = view.shape == belief.shape and bool(((view >= 0) & (view <= 1)).all())
    require(allowed, "view", f"be {belief.size} numbers from 0 to 1", view)
    missed = belief * (1 - view)
    total = float(missed.sum())
    left = total * entropy(missed / total) if total > 0 else 0.0
    return max(entropy(belief) - left, 0.0)


def interest(
    beliefs: np.ndarray, views: np.ndarray, accepting: np.ndarray, patience: int
) -> np.ndarray:
    """Expected information of asking each agent [nats], shape (agents,).

    Args:
        beliefs: b(x), shape (cells,).
        views: v_i(x), shape (agents, cells).
        accepting: Probability of each agent of accepting in one iteration, shape (agents,).
        patience: T_wait; an agent has T_wait + 1 chances to accept.
    """
    each = np.array([expected_information(beliefs, view) for view in views])
    return each * (1 - (1 - accepting) ** (patience + 1))


def update_tallies(tallies: np.ndarray, iteration: Iteration) -> np.ndarray:
    """Count the answers of the agents that were asked in an iteration.

    Args:
        tallies: Acceptances and everything else so far, shape (agents, 2).
        iteration: Result of the iteration.
    """
    counted = tallies.copy()
    for agent in iteration.asked:
        counted[agent, 0 if iteration.known.status[agent] == FRIEND else 1] += 1
    return counted


def estimated_acceptance(tallies: np.ndarray) -> np.ndarray:
    """Mean of each agent's probability given its tallies and no prior knowledge, shape (agents,).

    From a uniform prior: (accepted + 1) / (asked + 2), Laplace's rule.
    """
    return (tallies[:, 0] + 1) / (tallies.sum(axis=1) + 2)
