"""Figures 2.16 to 2.19 with pursuers and evaders that know the solved visibility game."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ....systems.numerics.geometry.random_arena import Arena
from ....systems.numerics.statistics import (
    Estimate,
    paired_difference,
    ratio_of_means,
    run_slopes,
    share,
)
from ...studies.opponents import cell_name, match_of
from ...studies.play import guarantees_of_study
from ...studies.records import StudyResult
from ...studies.report import draw_curves, draw_matrix, draw_means
from ...studies.study import Study
from ...studies.summary import StudyGrid, StudyPanel, matrix_of, mean_matrix, worst_of
from ...studies.team_studies import REFERENCE, SECONDS, policies_study, thesis_base
from .evidence import SHOWN, Evidence, Exhibit, Finding, Picture, Table, Workshop, played

PURSUERS = (REFERENCE, "margin", "guarantee", "certified")

# In full as many as end in minutes; `--runs` and `--opponent-runs` ask for more.
RUNS = {"adversarial": 10, "best_response": 5, "optimal": 10, "optimal_distance": 10}
QUICK_RUNS = {"adversarial": 2, "best_response": 2, "optimal": 2, "optimal_distance": 2}
SIZES, QUICK_SIZES = (1, 2, 3, 4), (1, 2)

# Each arena has two starts, or more where there are more arenas than this.
STARTS, MOST_ARENAS = 2, 50

# Between the pursuers' nodes [m], and the horizon [s], where it has to be quick; all runs share an
# arena there, whose game is then solved once.
QUICK_GRID, QUICK_SECONDS = 0.25, 10.0

# How many pursuers Figure 2.19 has.
ALLOCATED = 3


def solved_game_study(
    runs: Mapping[str, int],
    sizes: Sequence[int],
    grid: float = 0.1,
    seconds: float = SECONDS,
    arenas: int = MOST_ARENAS,
) -> Study:
    """Four kinds of pursuers against evaders of four kinds, teams of all sizes.

    Args:
        runs: Of each cell, by opponent.
        sizes: Of both teams.
        grid: Between the pursuers' nodes of the solved game [m].
        seconds: Horizon [s].
        arenas: At most so many.
    """
    base = thesis_base(seconds)
    most = max(runs.values())
    return policies_study(
        runs=most,
        base=replace(base, pursuers=replace(base.pursuers, grid=grid)),
        arena=Arena(),
        sizes=tuple(f"{n}v{m}" for n in sizes for m in sizes),
        opponents=tuple(runs),
        opponent_runs=runs,
        starts=max(STARTS, most // arenas),
        pursuers=PURSUERS,
    )


def solved_game_grid(study: Study) -> StudyGrid:
    """How to show the cells: means over evaders for each strategy, curves of equal teams."""
    matches = [match_of(cell.name) for cell in study.cells]
    opponents = list(dict.fromkeys(match.opponent for match in matches))
    sizes = list(dict.fromkeys(match.pursuers for match in matches))
    means = tuple(
        StudyPanel(
            title=f"{name}, against {opponent}",
            series={
                f"{n} pursuer{'s' if n > 1 else ''}": {
                    m: cell_name(n, m, name, opponent) for m in sizes
                }
                for n in sizes
            },
        )
        for opponent in opponents
        for name in PURSUERS
    )
    curves = tuple(
        StudyPanel(
            title=f"{n} against {n} {opponent}",
            series={name: {n: cell_name(n, n, name, opponent)} for name in PURSUERS},
        )
        for n in sizes
        for opponent in opponents
    )
    return StudyGrid(means=means, curves=curves, matrix=matrix_of(study), columns=len(PURSUERS))


@dataclass(frozen=True, eq=False)
class WorstGames:
    """The games of a study against the evaders that are worst for each pursuers.

    Attributes:
        result: A finished study, its cells named by `cell_name`.
        grid: Whose matrix tells pursuers from evaders.
        promised: What is guaranteed at the starts of its runs, by sizes of the teams, shape
            (runs,) each [s].
    """

    result: StudyResult
    grid: StudyGrid
    promised: Mapping[str, np.ndarray]

    def opponent(self, size: str, name: str) -> str:
        """The evaders that are worst, the first of several (`worst_of`).

        Args:
            size: Of the teams, "3v4".
            name: Of the pursuers.
        """
        return worst_of(self.result, self.grid.matrix[size][name])[0]

    def times(self, size: str, name: str) -> np.ndarray:
        """Tracking times on the runs that there are against all evaders, shape (runs,) [s].

        Args:
            size, name: As of `opponent`.
        """
        row = self.grid.matrix[size][name]
        shared = min(len(self.result.times(cell)) for cell in row.values())
        return self.result.times(row[self.opponent(size, name)])[:shared]

    def arenas(self, count: int) -> np.ndarray:
        """The number of the arena of each of the first runs, shape (count,)."""
        return np.arange(count) // self.result.study.starts_per_arena

    def over_reference(self, size: str, name: str) -> Estimate:
        """Mean over the mean of the thesis's pursuers, worst against worst.

        Args:
            size, name: As of `opponent`.
        """
        times = self.times(size, name)
        return ratio_of_means(times, self.times(size, REFERENCE), self.arenas(len(times)))

    def regret(self, size: str, name: str) -> tuple[float, int, int]:
        """What was guaranteed at the start and not kept.

        Args:
            size, name: As of `opponent`.

        Returns:
            Its mean, of times up to the horizon [s]; in how many runs all evaders were kept to the
            horizon of those where that was guaranteed; how many these are.
        """
        times, end = self.times(size, name), self.result.study.base.seconds
        promised = np.minimum(self.promised[size][: len(times)], end)
        winnable = promised >= end
        kept = int((times[winnable] >= end).sum())
        return float(np.maximum(promised - times, 0.0).mean()), kept, int(winnable.sum())


def _make(workshop: Workshop) -> Evidence:
    runs = workshop.runs_against(RUNS, QUICK_RUNS)
    sizes = QUICK_SIZES if workshop.quick else SIZES
    options = {"grid": QUICK_GRID, "seconds": QUICK_SECONDS, "arenas": 1} if workshop.quick else {}
    result = played(workshop, solved_game_study(runs, sizes, **options))
    grid = solved_game_grid(result.study)
    games = WorstGames(result, grid, guarantees_of_study(result.study, min(runs.values())))
    drawn = {"means": draw_means, "matrix": draw_matrix, "curves": draw_curves}
    files = [workshop.pictures / f"beyond_solved_game_{name}.png" for name in drawn]
    for file, draw in zip(files, drawn.values(), strict=True):
        draw(result, grid).savefig(file, dpi=100)
    captions = (
        "Restricted means of the tracking time, as in Figures 2.16 to 2.18, a column for each "
        "pursuers and a row for each evaders.",
        "The same means, pursuers against evaders, for each pair of teams.",
        "Kaplan-Meier curves of teams of the same size.",
    )
    return Evidence(
        tuple(map(Picture, files, captions)),
        findings(games, sizes),
        (means_table(games), regret_table(games)),
    )


def findings(games: WorstGames, sizes: Sequence[int]) -> tuple[Finding, ...]:
    """The questions of the figures, answered against the worst evaders.

    Args:
        games: Of a study of all sizes.
        sizes: Of both teams.
    """
    pairs = [(n, m) for n in sizes for m in sizes]
    enough = [f"{n}v{m}" for n, m in pairs if n >= m]
    few = [f"{n}v{m}" for n, m in pairs if n < m]
    # Three where there are as many.
    n = min(ALLOCATED, max(sizes))
    found = [
        (
            f"`{name}` over the thesis's pursuers, worst evaders of each",
            f"With enough pursuers {_least_and_most(games, enough, name)}; with too few "
            f"{_least_and_most(games, few, name)}.",
        )
        for name in PURSUERS[1:]
    ]
    found += [
        (
            "Figures 2.16 to 2.18: less time with each evader more",
            _slopes(games, [[f"{k}v{m}" for m in sizes] for k in sizes], sizes, -1.0),
        ),
        (
            "Figures 2.16 to 2.18: more time with each pursuer more",
            _slopes(games, [[f"{k}v{m}" for k in sizes] for m in sizes], sizes, 1.0),
        ),
        (f"Figure 2.19: {n} pursuers never lose one evader", _kept_shares(games, f"{n}v1")),
        ("Regret, one against one", _regrets(games, "1v1")),
    ]
    return tuple(Finding(subject, "", ours, SHOWN) for subject, ours in found)


def _least_and_most(games: WorstGames, sizes: Sequence[str], name: str) -> str:
    ratios = {size: games.over_reference(size, name) for size in sizes}
    ends = (min(ratios, key=lambda s: ratios[s].value), max(ratios, key=lambda s: ratios[s].value))
    return " to ".join(f"{_ratio(ratios[size])} times ({size})" for size in ends)


def _slopes(
    games: WorstGames, lines: Sequence[Sequence[str]], sizes: Sequence[int], sign: float
) -> str:
    """Mean over lines of the slopes of time over the size of a team, in words."""
    said = []
    for name in PURSUERS:
        slopes = np.mean(
            [
                sign * run_slopes(np.stack([games.times(size, name) for size in line], 1), sizes)
                for line in lines
            ],
            axis=0,
        )
        d = paired_difference(slopes, np.zeros_like(slopes))
        said.append(f"`{name}` {d.mean:+.1f} s [{d.low:+.1f}, {d.high:+.1f}]")
    return "; ".join(said) + "."


def _kept_shares(games: WorstGames, size: str) -> str:
    """How often nobody was lost before the horizon, in words."""
    end, said = games.result.study.base.seconds, []
    for name in PURSUERS:
        times = games.times(size, name)
        found = share(int((times >= end).sum()), len(times))
        said.append(f"`{name}` {found.value:.0%} [{found.low:.0%}, {found.high:.0%}]")
    return f"Runs to {end:g} s: {', '.join(said)}."


def _regrets(games: WorstGames, size: str) -> str:
    """What was guaranteed and not kept, in words."""
    said = []
    for name in PURSUERS:
        seconds, kept, winnable = games.regret(size, name)
        said.append(f"`{name}` {seconds:.1f} s, {kept} of {winnable} winnable starts kept in full")
    return "; ".join(said) + "."


def means_table(games: WorstGames) -> Table:
    """Restricted means against the worst evaders of each, with intervals.

    Args:
        games: Of the study.
    """
    means = mean_matrix(games.result, games.grid)
    rows = []
    for size, row in means.items():
        entries = []
        for name in PURSUERS:
            worst = games.opponent(size, name)
            mean = row[name][worst]
            entries.append(f"{mean.value:.1f} [{mean.low:.1f}, {mean.high:.1f}], {worst}")
        rows.append((size, *entries, _ratio(games.over_reference(size, "guarantee"))))
    return Table(
        "Restricted means [s] against the worst evaders of each pursuers, 95% intervals; ratios "
        "are of the runs against all evaders, with intervals from a bootstrap of the arenas",
        ("teams", *PURSUERS, "guarantee over thesis"),
        tuple(rows),
    )


def regret_table(games: WorstGames) -> Table:
    """What was guaranteed at the start and not kept, against the worst evaders of each.

    Args:
        games: Of the study.
    """
    rows = []
    for size in games.grid.matrix:
        entries = []
        for name in PURSUERS:
            seconds, kept, winnable = games.regret(size, name)
            entries.append(f"{seconds:.1f} s, {kept} of {winnable}")
        rows.append((size, *entries))
    return Table(
        "Regret: mean of the time that the middle bound guarantees at the start, up to the "
        "horizon, less the time kept where that is less; and how many of the starts that can be "
        "kept for ever were kept to the horizon. Of a team it is the best matching's, or with too "
        "few pursuers the best way to share evaders out, by the games of one and of two evaders",
        ("teams", *PURSUERS),
        tuple(rows),
    )


def _ratio(found: Estimate) -> str:
    if not np.isfinite(found.high):
        return f"{found.value:.2f}"
    return f"{found.value:.2f} [{found.low:.2f}, {found.high:.2f}]"


SOLVED_GAME = Exhibit(
    id="beyond-solved-game",
    covers=(),
    title="Figures 2.16 to 2.19 with the solved visibility game",
    states="The thesis asks how tracking time depends on the sizes of the teams, and whether it "
    "pays to agree. Here its pursuers (`thesis`: Table 2.2, Hungarian method at every step) play "
    "beside three others: `margin`, this project's field; `guarantee`, which plays by the solved "
    "visibility game and is matched by it; `certified`, which keeps what its lower bound promises. "
    "Evaders play the corner games, know the pursuers' rule, or play the evader's side of the "
    "solved game, without and with the distance to where they are lost.",
    command="sightfield reproduce --only beyond-solved-game --runs 100 "
    "--opponent-runs best_response=30 --out out/beyond",
    make=_make,
)
