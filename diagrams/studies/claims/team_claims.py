"""The claims about Figures 2.16 to 2.18: tracking times over the sizes of the teams."""

import numpy as np

from ....systems.numerics.errors import require
from ....systems.numerics.statistics.paired import paired_difference
from ....systems.numerics.statistics.survival import restricted_mean
from ....systems.numerics.statistics.trend import run_slopes, spread_trend
from ..records import StudyResult
from ..study import Study
from ..tracking_study import cell_name
from .claim import FAILS, HOLDS, OPEN, Verdict, capped, compare, joint_verdict

# t1, t2, t3, and their figures.
VECTORS = {"uniform": "2.16", "majority": "2.17", "proportional": "2.18"}

# Time units of the thesis, in which v_p = 300 mm: seconds here.
FLOOR, LEAST = 50.0, 74.62


def judge_teams(result: StudyResult, horizon: float | None = None) -> tuple[Verdict, ...]:
    """Judge the claims on a `tracking_study` with the thesis's three risk vectors.

    Args:
        result: A finished study, of two sizes of the teams or more.
        horizon: Where times are cut off [s]; None: where the study ends.

    Raises:
        InvalidInput: The horizon is beyond the study's.
    """
    sizes = team_sizes(result.study)
    end = result.horizon(cell_name(sizes[0], sizes[0], "uniform"))
    horizon = end if horizon is None else horizon
    require(horizon <= end, "horizon", f"be at most the study's, {end} s", horizon)

    def times(pursuers: int, evaders: int, vector: str = "uniform") -> np.ndarray:
        return capped(result, cell_name(pursuers, evaders, vector), horizon)

    return (
        _floor(times, sizes, horizon),
        _least_cell(times, sizes),
        _least_value(result, sizes, horizon),
        *(_trend(times, sizes, vector, more="evaders") for vector in VECTORS),
        *(_trend(times, sizes, vector, more="pursuers") for vector in VECTORS),
        _spread(times, sizes),
    )


def team_sizes(study: Study) -> tuple[int, ...]:
    """Numbers of evaders in a study, rising."""
    return tuple(sorted({int(str(cell.value("evaders.count"))) for cell in study.cells}))


def _floor(times, sizes, horizon: float) -> Verdict:
    tests = [compare(f"{n}v{m}", times(n, m), FLOOR) for n in sizes for m in sizes if n >= m]
    verdict, said = joint_verdict(tests)
    return Verdict(
        "t1 above 50",
        "2.16",
        "Where there are as many pursuers as evaders or more, every t1 exceeds 50 time units.",
        # Times that are cut off there say nothing of means beyond.
        verdict if horizon > FLOOR else OPEN,
        f"Differences to 50 s: {said}.",
    )


def _least_cell(times, sizes) -> Verdict:
    few, many = min(sizes), max(sizes)
    least = times(few, many)
    tests = [
        compare(f"{n}v{m} less {few}v{many}", times(n, m), least)
        for n in sizes
        for m in sizes
        if (n, m) != (few, many)
    ]
    verdict, said = joint_verdict(tests)
    return Verdict(
        "least at 1 against 4",
        "2.16",
        "The least average of t1 is that of one pursuer against four evaders.",
        verdict,
        f"Every other cell less that one: {said}.",
    )


def _least_value(result: StudyResult, sizes, horizon: float) -> Verdict:
    cell = cell_name(min(sizes), max(sizes), "uniform")
    mean = restricted_mean(result.times(cell), result.lost(cell), horizon)
    inside = mean.low <= LEAST <= mean.high
    # An interval as wide as what it is about tells nothing.
    sharp = mean.high - mean.low < 0.5 * LEAST
    verdict = OPEN if horizon <= LEAST else FAILS if not inside else HOLDS if sharp else OPEN
    return Verdict(
        "74.62 there",
        "2.16",
        f"That least average is {LEAST} time units.",
        verdict,
        f"Restricted mean up to {horizon:g} s: {mean.value:.1f} s "
        f"[{mean.low:.1f}, {mean.high:.1f}].",
    )


def _trend(times, sizes, vector: str, more: str) -> Verdict:
    tests = []
    for fixed in sizes:
        cells = [(fixed, k) if more == "evaders" else (k, fixed) for k in sizes]
        slopes = run_slopes(np.stack([times(n, m, vector) for n, m in cells], axis=1), sizes)
        name = f"{fixed} pursuers" if more == "evaders" else f"{fixed} evaders"
        tests.append(compare(name, -slopes if more == "evaders" else slopes, 0.0))
    verdict, said = joint_verdict(tests)
    number = f"t{1 + list(VECTORS).index(vector)}"
    falls = more == "evaders"
    return Verdict(
        f"{number} {'falls' if falls else 'rises'} with {more}",
        VECTORS[vector],
        "With a given number of pursuers, tracking time decreases with the number of evaders."
        if falls
        else "With a given number of evaders, tracking time increases with the number of pursuers.",
        verdict,
        f"Mean {'fall' if falls else 'rise'} per {more.removesuffix('s')} more: {said}.",
    )


def _spread(times, sizes) -> Verdict:
    cells = [(n, m) for n in sizes for m in sizes]
    samples = np.stack(
        [np.stack([times(n, m, vector) for vector in VECTORS], axis=1) for n, m in cells]
    )
    agents = [n + m for n, m in cells]
    slope = spread_trend(samples, agents)
    verdict = HOLDS if slope.low > 0 else FAILS if slope.high < 0 else OPEN
    # Of single runs, whose spread between the vectors is what a player would notice.
    each = run_slopes(samples.var(axis=2, ddof=1).T, agents)
    single = paired_difference(each, np.zeros_like(each))
    return Verdict(
        "variance between t1, t2, t3 rises",
        "2.16 to 2.18",
        "The variances between t1, t2 and t3 increase with the number of agents.",
        verdict,
        f"Variance between the three averages: {slope.value:+.2f} s² per agent "
        f"[{slope.low:+.2f}, {slope.high:+.2f}] (bootstrap); within single runs "
        f"{single.mean:+.1f} s² [{single.low:+.1f}, {single.high:+.1f}].",
    )
