"""Network evolution as an exact Markov chain.

The state between iterations is `Acquaintances`: status, counters, and who is next in line. In an
iteration every friend may unfriend, and every asked agent may accept, independently of each other;
rejection and silence have the same effect on the state. So the transitions follow from the steps of
Algorithm 2, applied to all combinations of these answers.

With room for all (N_req and N_f at least the number of agents) and a fixed probability for each
agent, the agents are independent chains of two states: an agent passed over is asked again at once,
T_wait drops out, and agent i is a friend in the fraction p_i / (p_i + q_i) of all iterations.
`docs/social-network.md` has the derivation.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array, eye_array
from scipy.sparse.linalg import splu

from ...errors import require_chance, require_type
from .acceptance import Temperaments
from .evolution import Acquaintances, EvolutionLimits, choose_new, strangers, take_answers
from .interface import Answer, Response


@dataclass(frozen=True)
class FriendshipChain:
    """The chain of network evolution, from its start among strangers.

    Attributes:
        states: All that can be reached; the first is the start.
        transition: Probability of going from state i to j, shape (n, n).
        stationary: Fraction of iterations in each state in the long run, shape (n,).
    """

    states: tuple[Acquaintances, ...]
    transition: csr_array
    stationary: np.ndarray

    def fraction(self, holds: Callable[[Acquaintances], bool]) -> float:
        """Long-run fraction of iterations after which a statement on the state holds."""
        return float(self.stationary @ self._indicator(holds))

    def standard_error(self, holds: Callable[[Acquaintances], bool], iterations: int) -> float:
        """Standard deviation of that fraction over a run of many iterations.

        Successive iterations are dependent. With f the indicator less its mean and g the solution
        of (I - P) g = f, the variance of the mean over N iterations is pi (2 f g - f^2) / N.
        Source: e.g. Asmussen and Glynn, Stochastic Simulation, IV.
        """
        deviation = self._indicator(holds) - self.fraction(holds)
        # I - P is singular: g is known up to a constant, so it is set to 0 in a recurrent state.
        others = np.arange(len(self.states)) != np.argmax(self.stationary)
        system = (eye_array(len(self.states)) - self.transition).tocsr()[others][:, others]
        solved = np.zeros(len(self.states))
        solved[others] = splu(system.tocsc()).solve(deviation[others])
        variance = self.stationary @ (2 * deviation * solved - deviation**2)
        return float(np.sqrt(max(variance, 0.0) / iterations))

    def chance_throughout(self, holds: Callable[[Acquaintances], bool], iterations: int) -> float:
        """Probability that a statement, true at the start, holds after each of some iterations.

        The start is drawn from the stationary distribution, among the states where it holds.
        """
        true = self._indicator(holds)
        weight = self.stationary * true
        weight = weight / weight.sum()
        for _ in range(iterations):
            weight = (weight @ self.transition) * true
        return float(weight.sum())

    def _indicator(self, holds: Callable[[Acquaintances], bool]) -> np.ndarray:
        return np.array([float(holds(state)) for state in self.states])


def friendship_chain(temperaments: Temperaments, limits: EvolutionLimits) -> FriendshipChain:
    """The chain of Algorithm 2 on a network in memory, new agents asked in turn.

    The number of states grows as (T_wait + 2) to the power of the agents that can be asked at once:
    it is for a handful of agents.

    Raises:
        InvalidInput: An argument is of another type.
    """
    require_type("temperaments", temperaments, Temperaments)
    require_type("limits", limits, EvolutionLimits)
    start = _settle(strangers(temperaments.count), limits)
    numbers, states = {start: 0}, [start]
    rows, columns, chances = [], [], []
    # The list grows while it is gone through.
    for row, state in enumerate(states):
        for following, chance in _outcomes(state, temperaments, limits):
            if following not in numbers:
                numbers[following] = len(states)
                states.append(following)
            rows.append(row)
            columns.append(numbers[following])
            chances.append(chance)
    transition = csr_array((chances, (rows, columns)), shape=(len(states), len(states)))
    return FriendshipChain(tuple(states), transition, _stationary(transition, len(states)))


def connected_fraction(friending: float, unfriending: float) -> float:
    """p / (p + q): long-run share of iterations in which an agent that is always asked is a friend.

    NaN where both are zero: then it stays what it is.

    Args:
        friending: Probability p of acceptance, per iteration.
        unfriending: Probability q of leaving, per iteration.

    Raises:
        InvalidInput: One is no probability.
    """
    require_chance("friending", friending)
    require_chance("unfriending", unfriending)
    total = friending + unfriending
    return friending / total if total > 0 else float("nan")


def _outcomes(
    state: Acquaintances, temperaments: Temperaments, limits: EvolutionLimits
) -> Iterator[tuple[Acquaintances, float]]:
    """Possible acquaintances after an iteration, and their chances; some are listed twice."""
    asked, _ = choose_new(state, limits)
    events = [(i, Answer.UNFRIENDED, temperaments.unfriending[i]) for i in asked.friends]
    events += [
        (i, Answer.ACCEPTED, temperaments.acceptance.probability(i, asked.friends))
        for i in asked.waiting
    ]
    for happening in range(2 ** len(events)):
        chance, responses = 1.0, []
        for k, (agent, answer, probability) in enumerate(events):
            happens = bool(happening >> k & 1)
            chance *= probability if happens else 1 - probability
            if happens:
                responses.append(Response(agent=agent, answer=answer))
        if chance > 0:
            following, _ = take_answers(asked, limits, responses)
            yield _settle(following, limits), chance


def _settle(state: Acquaintances, limits: EvolutionLimits) -> Acquaintances:
    """The state with a sorted queue if all agents are asked anyway, to merge equal states."""
    count = len(state.status)
    if count <= min(limits.requests, limits.friends):
        return Acquaintances(state.status, tuple(range(count)))
    return state


def _stationary(transition: csr_array, size: int) -> np.ndarray:
    """Stationary distribution reached from the start; transient states have probability zero.

    The chain is made lazy (each step is skipped with probability 1/2), which keeps the distribution
    and removes periodicity.
    """
    weight = np.zeros(size)
    weight[0] = 1.0
    lazy = (transition + eye_array(size)).tocsr() / 2
    for _ in range(1_000_000):
        following = weight @ lazy
        if np.abs(following - weight).sum() < 1e-15:
            break
        weight = following
    return weight / weight.sum()
