"""`sightfield standoff analyse`: equilibria, poles, singularities, regions, margins."""

from ...standoff.make_standoff import StandoffScenario
from .answer import analyse_and_answer
from .options import JsonOption, OutOption, takes_scenario


@takes_scenario
def analyse(scenario: StandoffScenario, out: OutOption = None, as_json: JsonOption = False) -> None:
    """Equilibria, poles, singularities, regions of attraction and margins of a loop.

    Of the ideal loop, and of the loop with this clock, filter, delay and limit.
    """
    analyse_and_answer(scenario, out, as_json)
