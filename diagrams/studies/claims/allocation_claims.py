"""The claims about Figure 2.19: ranking and aggregation against pursuers for themselves."""

import numpy as np

from ....systems.numerics.statistics import share
from ..assignment_study import PURSUERS
from ..records import StudyResult
from .claim import (
    FAILS,
    HOLDS,
    OPEN,
    ClaimVerdict,
    Games,
    Judgement,
    compare,
    joint_verdict,
    judge_against_each,
)
from .team_claims import team_sizes

REFERENCES = ("random_visible", "own_riskiest")
AGGREGATED = ("borda_min", "borda_max")
TEAMS = (*AGGREGATED, *REFERENCES)

# A share of runs above this is as good as all of them.
NEARLY_ALL = 0.99


def judge_allocations(result: StudyResult, horizon: float | None = None) -> tuple[Judgement, ...]:
    """Judge the claims on an `assignment_study` with its own rules.

    Args:
        result: A finished study, of 1, some more, and more than three evaders.
        horizon: Where times are cut off [s]; None: where the study ends.

    Raises:
        InvalidInput: The horizon is beyond the study's.
    """
    sizes = team_sizes(result.study)

    def judge(games: Games) -> tuple[ClaimVerdict, ...]:
        return (
            _single(games),
            *(_better(games, sizes, rule) for rule in AGGREGATED),
            *(_especially(games, sizes, rule) for rule in AGGREGATED),
        )

    return judge_against_each(result, horizon, judge)


def _single(games: Games) -> ClaimVerdict:
    cells = [(PURSUERS, 1, rule) for rule in TEAMS]
    kept = np.concatenate([games.times(*cell) >= games.horizon for cell in cells])
    found = share(int(kept.sum()), len(kept))
    verdict = FAILS if not kept.all() else HOLDS if found.low > NEARLY_ALL else OPEN
    return ClaimVerdict(
        "one evader is never lost",
        "2.19",
        "With one evader all teams reach the maximum time that is counted.",
        games.opponent,
        games.level(cells),
        verdict,
        f"{kept.sum()} of {len(kept)} runs reach {games.horizon:g} s: {found.value:.1%} "
        f"[{found.low:.1%}, {found.high:.1%}].",
    )


def _better(games: Games, sizes, rule: str) -> ClaimVerdict:
    several = [m for m in sizes if m > 1]
    tests = [
        compare(
            f"{PURSUERS}v{m} against {reference}",
            games.times(PURSUERS, m, rule),
            games.times(PURSUERS, m, reference),
        )
        for m in several
        for reference in REFERENCES
    ]
    verdict, said = joint_verdict(tests)
    return ClaimVerdict(
        f"{rule} is better",
        "2.19",
        "For several evaders ranking and aggregation shows a better performance than random "
        "targets and than each pursuer's own riskiest one"
        + (" (least total score, as printed)." if rule == "borda_min" else " (greatest total)."),
        games.opponent,
        _level(games, several, rule),
        verdict,
        f"{said}.",
    )


def _especially(games: Games, sizes, rule: str) -> ClaimVerdict:
    several = [m for m in sizes if m > 1]

    def gain(evaders: int) -> np.ndarray:
        others = [games.times(PURSUERS, evaders, reference) for reference in REFERENCES]
        return games.times(PURSUERS, evaders, rule) - np.mean(others, axis=0)

    enough = np.mean([gain(m) for m in several if m <= PURSUERS], axis=0)
    beyond = np.mean([gain(m) for m in several if m > PURSUERS], axis=0)
    verdict, said = joint_verdict(
        [compare("gain with enough pursuers less without", enough, beyond)]
    )
    return ClaimVerdict(
        f"{rule} gains most with enough pursuers",
        "2.19",
        "It does so especially where there are as many pursuers as evaders or more.",
        games.opponent,
        _level(games, several, rule),
        verdict,
        f"{said}.",
    )


def _level(games: Games, sizes, rule: str) -> float:
    return games.level((PURSUERS, m, each) for m in sizes for each in (rule, *REFERENCES))
