"""Whom pursuers are judged against: the evaders of a study, and how often each is played.

What a strategy is worth hangs on who plays against it. A study therefore plays each cell against
several policies of evaders, which its name ends with, and what is said of it is said against each.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...systems.numerics.errors import require, require_one_of, require_positive
from ..tracking.scenario import OPTIMAL_POLICIES
from .study import Cell, Study

# Policies that play by themselves: the best play of each corner's game, which takes corners one
# by one; plans tried against the pursuers' own rule; turns at random; and the evader's side of the
# solved visibility game, without and with the distance to where an evader is lost.
POLICIES = ("adversarial", "best_response", "random_walk", *OPTIMAL_POLICIES)

# Those that studies and variants of claims are played against, unless told otherwise.
OPPONENTS = ("adversarial", "best_response")

# Runs of each cell of a study, unless told otherwise: those of `best_response` take some four times
# as long.
RUNS, FEWER = 1000, {"best_response": 100}


def runs_against(
    opponents: Sequence[str], runs: int, opponent_runs: Mapping[str, int] | None = None
) -> dict[str, int]:
    """How many runs each cell has against each opponent.

    Args:
        opponents: Names of policies.
        runs: Against those of which nothing else is said.
        opponent_runs: Against some of them.

    Raises:
        InvalidInput: There is no opponent, a name is none or comes twice, a number is not positive,
            or a number is for an opponent that is not played.
    """
    require(runs > 0, "runs", "be positive", runs)
    require(len(opponents) > 0, "opponent", "be one at least", "none")
    for opponent in opponents:
        require_one_of("opponent", opponent, POLICIES)
    twice = sorted({each for each in opponents if opponents.count(each) > 1})
    require(not twice, "opponent", "come once each", f"{', '.join(twice)} twice")
    for opponent, number in (opponent_runs or {}).items():
        require_one_of("opponent-runs", opponent, opponents)
        require_positive("opponent-runs", number)
    return {opponent: (opponent_runs or {}).get(opponent, runs) for opponent in opponents}


def fewer_runs(
    opponents: Sequence[str], runs: int, chosen: Mapping[str, int] | None = None
) -> dict[str, int]:
    """Runs against single opponents: those chosen, else FEWER where that is less than `runs`.

    Args:
        opponents: Names of policies.
        runs: Against the others.
        chosen: By opponent.
    """
    usual = {name: min(runs, number) for name, number in FEWER.items() if name in opponents}
    return {**usual, **(chosen or {})}


def read_opponent_runs(words: Sequence[str]) -> dict[str, int]:
    """Runs by opponent from words such as "best_response=100".

    Args:
        words: Any number.

    Raises:
        InvalidInput: A word has another form, or an opponent has two.
    """
    found: dict[str, int] = {}
    for word in words:
        opponent, _, number = word.partition("=")
        require(number.isdigit(), "opponent-runs", "have the form best_response=100", word)
        once = f"be said once of {opponent}"
        require(opponent not in found, "opponent-runs", once, f"{found.get(opponent)} and {number}")
        found[opponent] = int(number)
    return found


class Match(NamedTuple):
    """Who plays whom in a cell.

    Attributes:
        pursuers, evaders: How many.
        variant: What is varied of the pursuers.
        opponent: Policy of the evaders.
    """

    pursuers: int
    evaders: int
    variant: str
    opponent: str


def cell_name(pursuers: int, evaders: int, variant: str, opponent: str) -> str:
    """Name of the cell of two team sizes, "3v4-uniform-best_response".

    Args:
        pursuers, evaders: How many.
        variant: What is varied of the pursuers.
        opponent: Policy of the evaders.
    """
    return f"{pursuers}v{evaders}-{variant}-{opponent}"


def match_of(cell: str) -> Match:
    """Who plays whom in a cell named by `cell_name`; the variant's name may have hyphens.

    Args:
        cell: Name.
    """
    sizes, _, rest = cell.partition("-")
    variant, _, opponent = rest.rpartition("-")
    pursuers, evaders = sizes.split("v")
    return Match(int(pursuers), int(evaders), variant, opponent)


def match_cell(match: Match, settings: Sequence[str], runs: Mapping[str, int]) -> Cell:
    """The cell of a match.

    Args:
        match: Who plays whom.
        settings: What makes the pursuers' variant.
        runs: By opponent, for all that the study has.
    """
    number = runs[match.opponent]
    return Cell(
        name=cell_name(*match),
        settings=(
            f"pursuers.count={match.pursuers}",
            f"evaders.count={match.evaders}",
            *settings,
            f"evaders.policies=[{match.opponent}]",
        ),
        runs=number if number < max(runs.values()) else None,
    )


def opponent_of(study: Study, cell: Cell) -> str:
    """The policy of a cell's evaders, or policies, joined by "+".

    Args:
        study: That has the cell.
        cell: One of its cells.
    """
    chosen = cell.value("evaders.policies")
    policies = chosen if isinstance(chosen, list) else study.base.evaders.policies
    return "+".join(dict.fromkeys(policies))


def runs_by_opponent(study: Study) -> dict[str, int]:
    """Runs of a cell against each opponent, in the order in which they come.

    Args:
        study: Any; where cells against one opponent differ in runs it is the most.
    """
    found: dict[str, int] = {}
    for cell in study.cells:
        opponent = opponent_of(study, cell)
        found[opponent] = max(found.get(opponent, 0), study.runs_of(cell))
    return found


def runs_in_words(study: Study) -> str:
    """How many runs a cell has, against whom.

    Args:
        study: Any.
    """
    numbers = runs_by_opponent(study)
    if len(set(numbers.values())) == 1:
        return f"{study.runs} runs a cell against {' and '.join(numbers)}"
    parts = (f"{number} against {opponent}" for opponent, number in numbers.items())
    return f"runs a cell: {', '.join(parts)}"
