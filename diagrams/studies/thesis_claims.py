"""The claims about Figures 2.16 to 2.19: sizes of teams, ranking and aggregation."""

import numpy as np

from ...systems.numerics.statistics import paired_difference, run_slopes, share, spread_trend
from .claims import (
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
from .records import StudyResult
from .study import Study
from .team_studies import PURSUERS

# t1, t2, t3, and their figures.
VECTORS = {"uniform": "2.16", "majority": "2.17", "proportional": "2.18"}

# Time units of the thesis, in which v_p = 300 mm: seconds here.
FLOOR, LEAST = 50.0, 74.62


def judge_teams(result: StudyResult, horizon: float | None = None) -> tuple[Judgement, ...]:
    """Judge the claims on a `tracking_study` with the thesis's three risk vectors.

    Args:
        result: A finished study, of two sizes of the teams or more.
        horizon: Where times are cut off [s]; None: where the study ends.

    Raises:
        InvalidInput: The horizon is beyond the study's.
    """
    sizes = team_sizes(result.study)

    def judge(games: Games) -> tuple[ClaimVerdict, ...]:
        return (
            _floor(games, sizes),
            _least_cell(games, sizes),
            _least_value(games, sizes),
            *(_trend(games, sizes, vector, more="evaders") for vector in VECTORS),
            *(_trend(games, sizes, vector, more="pursuers") for vector in VECTORS),
            _spread(games, sizes),
        )

    return judge_against_each(result, horizon, judge)


def team_sizes(study: Study) -> tuple[int, ...]:
    """Numbers of evaders in a study, rising."""
    return tuple(sorted({int(str(cell.value("evaders.count"))) for cell in study.cells}))


def _floor(games: Games, sizes) -> ClaimVerdict:
    cells = [(n, m, "uniform") for n in sizes for m in sizes if n >= m]
    tests = [compare(f"{n}v{m}", games.times(n, m, t1), FLOOR) for n, m, t1 in cells]
    verdict, said = joint_verdict(tests)
    return ClaimVerdict(
        "t1 above 50",
        "2.16",
        "Where there are as many pursuers as evaders or more, every t1 exceeds 50 time units.",
        games.opponent,
        games.level(cells),
        # Times that are cut off there say nothing of means beyond.
        verdict if games.horizon > FLOOR else OPEN,
        f"Differences to 50 s: {said}.",
    )


def _least_cell(games: Games, sizes) -> ClaimVerdict:
    few, many = min(sizes), max(sizes)
    cells = [(n, m, "uniform") for n in sizes for m in sizes]
    least = games.times(few, many, "uniform")
    tests = [
        compare(f"{n}v{m} less {few}v{many}", games.times(n, m, t1), least)
        for n, m, t1 in cells
        if (n, m) != (few, many)
    ]
    verdict, said = joint_verdict(tests)
    return ClaimVerdict(
        "least at 1 against 4",
        "2.16",
        "The least average of t1 is that of one pursuer against four evaders.",
        games.opponent,
        games.level(cells),
        verdict,
        f"Every other cell less that one: {said}.",
    )


def _least_value(games: Games, sizes) -> ClaimVerdict:
    cell = min(sizes), max(sizes), "uniform"
    mean = games.mean(*cell)
    inside = mean.low <= LEAST <= mean.high
    # An interval as wide as what it is about tells nothing.
    sharp = mean.high - mean.low < 0.5 * LEAST
    verdict = FAILS if not inside else HOLDS if sharp else OPEN
    return ClaimVerdict(
        "74.62 there",
        "2.16",
        f"That least average is {LEAST} time units.",
        games.opponent,
        games.level([cell]),
        verdict if games.horizon > LEAST else OPEN,
        f"Restricted mean up to {games.horizon:g} s: {mean.value:.1f} s "
        f"[{mean.low:.1f}, {mean.high:.1f}].",
    )


def _trend(games: Games, sizes, vector: str, more: str) -> ClaimVerdict:
    tests = []
    for fixed in sizes:
        cells = [(fixed, k) if more == "evaders" else (k, fixed) for k in sizes]
        times = np.stack([games.times(n, m, vector) for n, m in cells], axis=1)
        slopes = run_slopes(times, sizes)
        name = f"{fixed} pursuers" if more == "evaders" else f"{fixed} evaders"
        tests.append(compare(name, -slopes if more == "evaders" else slopes, 0.0))
    verdict, said = joint_verdict(tests)
    number = f"t{1 + list(VECTORS).index(vector)}"
    falls = more == "evaders"
    return ClaimVerdict(
        f"{number} {'falls' if falls else 'rises'} with {more}",
        VECTORS[vector],
        "With a given number of pursuers, tracking time decreases with the number of evaders."
        if falls
        else "With a given number of evaders, tracking time increases with the number of pursuers.",
        games.opponent,
        games.level((n, m, vector) for n in sizes for m in sizes),
        verdict,
        f"Mean {'fall' if falls else 'rise'} per {more.removesuffix('s')} more: {said}.",
    )


def _spread(games: Games, sizes) -> ClaimVerdict:
    cells = [(n, m) for n in sizes for m in sizes]
    samples = np.stack(
        [np.stack([games.times(n, m, vector) for vector in VECTORS], axis=1) for n, m in cells]
    )
    agents = [n + m for n, m in cells]
    slope = spread_trend(samples, agents)
    verdict = HOLDS if slope.low > 0 else FAILS if slope.high < 0 else OPEN
    # Of single runs, whose spread between the vectors is what a player would notice.
    each = run_slopes(samples.var(axis=2, ddof=1).T, agents)
    single = paired_difference(each, np.zeros_like(each))
    return ClaimVerdict(
        "variance between t1, t2, t3 rises",
        "2.16 to 2.18",
        "The variances between t1, t2 and t3 increase with the number of agents.",
        games.opponent,
        games.level((n, m, vector) for n, m in cells for vector in VECTORS),
        verdict,
        f"Variance between the three averages: {slope.value:+.2f} s² per agent "
        f"[{slope.low:+.2f}, {slope.high:+.2f}] (bootstrap); within single runs "
        f"{single.mean:+.1f} s² [{single.low:+.1f}, {single.high:+.1f}].",
    )


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
