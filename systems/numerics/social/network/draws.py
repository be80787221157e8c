"""What agents do in an iteration, drawn by lot."""

from collections.abc import Collection

import numpy as np

from .acceptance import Temperaments
from .interface import Answer, Response


def draw_responses(
    temperaments: Temperaments,
    asked: Collection[int],
    friends: Collection[int],
    generator: np.random.Generator,
) -> list[Response]:
    """One iteration's responses, rising by agent.

    Two numbers are drawn for each agent whatever it does, so that one agent's luck does not hang
    on another's.

    Args:
        temperaments: Of all agents.
        asked: Agents with an open request.
        friends: The pursuer's friends at the beginning of the iteration.
        generator: Source of luck.
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
