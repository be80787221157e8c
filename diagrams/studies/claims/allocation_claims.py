"""The claims about Figure 2.19: ranking and aggregation against pursuers for themselves."""

import numpy as np

from ....systems.numerics.errors import require
from ....systems.numerics.statistics.estimate import share
from ..assignment_study import PURSUERS
from ..records import StudyResult
from ..tracking_study import cell_name
from .claim import FAILS, HOLDS, OPEN, Verdict, capped, compare, joint_verdict
from .team_claims import team_sizes

REFERENCES = ("random_visible", "own_riskiest")
AGGREGATED = ("borda_min", "borda_max")
TEAMS = (*AGGREGATED, *REFERENCES)

# A share of runs above this is as good as all of them.
NEARLY_ALL = 0.99


def judge_allocations(result: StudyResult, horizon: float | None = None) -> tuple[Verdict, ...]:
    """Judge the claims on an `assignment_study` with its own rules.

    Args:
        result: A finished study, of 1, some more, and more than three evaders.
        horizon: Where times are cut off [s]; None: where the study ends.

    Raises:
        InvalidInput: The horizon is beyond the study's.
    """
    sizes = team_sizes(result.study)
    end = result.horizon(cell_name(PURSUERS, sizes[0], TEAMS[0]))
    horizon = end if horizon is None else horizon
    require(horizon <= end, "horizon", f"be at most the study's, {end} s", horizon)

    def times(evaders: int, rule: str) -> np.ndarray:
        return capped(result, cell_name(PURSUERS, evaders, rule), horizon)

    return (
        _single(times, horizon),
        *(_better(times, sizes, rule) for rule in AGGREGATED),
        *(_especially(times, sizes, rule) for rule in AGGREGATED),
    )


def _single(times, horizon: float) -> Verdict:
    kept = np.concatenate([times(1, rule) >= horizon for rule in TEAMS])
    found = share(int(kept.sum()), len(kept))
    verdict = FAILS if not kept.all() else HOLDS if found.low > NEARLY_ALL else OPEN
    return Verdict(
        "one evader is never lost",
        "2.19",
        "With one evader all teams reach the maximum time that is counted.",
        verdict,
        f"{kept.sum()} of {len(kept)} runs reach {horizon:g} s: {found.value:.1%} "
        f"[{found.low:.1%}, {found.high:.1%}].",
    )


def _better(times, sizes, rule: str) -> Verdict:
    tests = [
        compare(f"{PURSUERS}v{m} against {reference}", times(m, rule), times(m, reference))
        for m in sizes
        if m > 1
        for reference in REFERENCES
    ]
    verdict, said = joint_verdict(tests)
    return Verdict(
        f"{rule} is better",
        "2.19",
        "For several evaders ranking and aggregation shows a better performance than random "
        "targets and than each pursuer's own riskiest one"
        + (" (least total score, as printed)." if rule == "borda_min" else " (greatest total)."),
        verdict,
        f"{said}.",
    )


def _especially(times, sizes, rule: str) -> Verdict:
    def gain(evaders: int) -> np.ndarray:
        return times(evaders, rule) - np.mean([times(evaders, r) for r in REFERENCES], axis=0)

    enough = np.mean([gain(m) for m in sizes if 1 < m <= PURSUERS], axis=0)
    beyond = np.mean([gain(m) for m in sizes if m > PURSUERS], axis=0)
    verdict, said = joint_verdict(
        [compare("gain with enough pursuers less without", enough, beyond)]
    )
    return Verdict(
        f"{rule} gains most with enough pursuers",
        "2.19",
        "It does so especially where there are as many pursuers as evaders or more.",
        verdict,
        f"{said}.",
    )
