"""`sightfield standoff run`, or without `run`: what becomes of one start; `--analyse`: why."""

from typing import Annotated

import typer

from ...standoff.make_standoff import StandoffScenario
from ...standoff.report import standoff_report
from .answer import analyse_and_answer, answer
from .options import JsonOption, OutOption, takes_scenario


@takes_scenario
def run(
    scenario: StandoffScenario,
    analyse: Annotated[bool, typer.Option("--analyse", help="As the command `analyse`.")] = False,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """A pursuer keeps its distance to an evader that it sees with error e(y) = a y^2 + b y + c."""
    if analyse:
        analyse_and_answer(scenario, out, as_json)
    else:
        answer(standoff_report(scenario), None, out, as_json)
