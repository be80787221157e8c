"""A study in numbers: which cells belong together, their intervals, and comparisons of cells."""

from dataclasses import asdict, dataclass, field
from typing import Any

from ...systems.numerics.statistics import Estimate, holm, paired_difference, restricted_mean, share
from .opponents import match_of, opponent_of, runs_by_opponent
from .records import StudyResult
from .study import Study

CONFIDENCE = 0.95
# In place of the worst opponent, where several are.
UNDECIDED = "undecided"


@dataclass(frozen=True, kw_only=True)
class StudyPanel:
    """One pair of axes.

    Attributes:
        title: What it shows.
        series: By label, names of cells over the number of evaders.
    """

    title: str
    series: dict[str, dict[int, str]]


@dataclass(frozen=True, kw_only=True)
class StudyGrid:
    """The panels of a study, and its comparisons.

    Attributes:
        means: Panels of restricted means over the number of evaders.
        curves: Panels of survival curves; a cell's number of evaders is not drawn there.
        pairs: Names of cells to compare run by run.
        matrix: Pursuers against evaders: by sizes of the teams ("3v4"), by what the pursuers do,
            by what the evaders do, the name of the cell.
        columns: Panels of means side by side; 0: all.
    """

    means: tuple[StudyPanel, ...] = ()
    curves: tuple[StudyPanel, ...] = ()
    pairs: tuple[tuple[str, str], ...] = ()
    matrix: dict[str, dict[str, dict[str, str]]] = field(default_factory=dict)
    columns: int = 0


def matrix_of(study: Study) -> dict[str, dict[str, dict[str, str]]]:
    """The matrix of a study whose cells are named by `cell_name`, in the order of its cells.

    Args:
        study: Any such.
    """
    found: dict[str, dict[str, dict[str, str]]] = {}
    for cell in study.cells:
        match = match_of(cell.name)
        rows = found.setdefault(f"{match.pursuers}v{match.evaders}", {})
        rows.setdefault(match.variant, {})[match.opponent] = cell.name
    return found


def summarise_study(result: StudyResult, grid: StudyGrid) -> dict[str, object]:
    """The study in numbers, ready for JSON.

    Args:
        result: A finished study.
        grid: What to compare.

    Returns:
        study, seed, runs (of each cell, by opponent), confidence, cells: by name the sizes of the
        teams, opponent, horizon [s], mean (restricted mean of the tracking time: value, low, high,
        standard_error [s], count), kept (share of runs in which nobody was lost before the horizon,
        with its interval); comparisons: opponent, first, second, and what `paired_difference` finds
        in first - second [s], with holm_p, its p_value adjusted for all comparisons; matrix: by
        sizes of the teams, by pursuers, by evaders the mean with its interval [s]; worst: by sizes
        of the teams, by pursuers the evaders with the least mean (`worst_of`), or `UNDECIDED`.
        With a single run there are no comparisons.
    """
    study = result.study
    pairs = [
        (first, second) for first, second in grid.pairs if study.runs_of(study.cell(first)) > 1
    ]
    found = [
        paired_difference(result.times(first), result.times(second), CONFIDENCE)
        for first, second in pairs
    ]
    adjusted = holm([each.p_value for each in found])
    matrix = mean_matrix(result, grid)
    return {
        "study": study.name,
        "seed": study.seed,
        "runs": runs_by_opponent(study),
        "confidence": CONFIDENCE,
        "cells": {cell.name: _summarise_cell(result, cell.name) for cell in study.cells},
        "comparisons": [
            {
                "opponent": opponent_of(study, study.cell(first)),
                "first": first,
                "second": second,
                **asdict(each),
                "holm_p": float(p),
            }
            for (first, second), each, p in zip(pairs, found, adjusted, strict=True)
        ],
        "matrix": {
            size: {
                name: {
                    opponent: {"mean": mean.value, "low": mean.low, "high": mean.high}
                    for opponent, mean in row.items()
                }
                for name, row in rows.items()
            }
            for size, rows in matrix.items()
        },
        "worst": {
            size: {name: _decided(worst_of(result, row)) for name, row in rows.items()}
            for size, rows in grid.matrix.items()
        },
    }


def mean_matrix(result: StudyResult, grid: StudyGrid) -> dict[str, dict[str, dict[str, Estimate]]]:
    """Restricted means [s] in the places of the grid's matrix.

    Args:
        result: A finished study.
        grid: Whose matrix.
    """
    return {
        size: {
            name: {opponent: _mean(result, cell) for opponent, cell in row.items()}
            for name, row in rows.items()
        }
        for size, rows in grid.matrix.items()
    }


def worst_of(result: StudyResult, row: dict[str, str]) -> tuple[str, ...]:
    """The opponents with the least mean over the runs that all of a row have, mostly one.

    Over the same runs, as the means of fewer runs say less. Several have the least where all runs
    last to the horizon.

    Args:
        result: A finished study.
        row: Names of cells by opponent.
    """
    shared = min(len(result.times(cell)) for cell in row.values())
    means = {name: float(result.times(cell)[:shared].mean()) for name, cell in row.items()}
    return tuple(name for name, mean in means.items() if mean <= min(means.values()))


def _decided(worst: tuple[str, ...]) -> str:
    return worst[0] if len(worst) == 1 else UNDECIDED


def _mean(result: StudyResult, cell: str) -> Estimate:
    return restricted_mean(result.times(cell), result.lost(cell), result.horizon(cell), CONFIDENCE)


def _summarise_cell(result: StudyResult, cell: str) -> dict[str, object]:
    lost = result.lost(cell)
    row = result.rows(cell)
    return {
        "pursuers": row["pursuers"][0].as_py(),
        "evaders": row["evaders"][0].as_py(),
        "opponent": opponent_of(result.study, result.study.cell(cell)),
        "horizon": result.horizon(cell),
        "mean": asdict(_mean(result, cell)),
        "kept": asdict(share(int((~lost).sum()), len(lost), CONFIDENCE)),
    }


@dataclass(frozen=True)
class MeanTable:
    """Restricted means with their intervals.

    Attributes:
        title: What they are [s].
        head: Of the columns.
        rows: As many entries each, the first being the row's label.
    """

    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def mean_tables(summary: dict[str, Any], grid: StudyGrid) -> tuple[MeanTable, ...]:
    """The panels of a study over the number of evaders or, where it has none, its matrices.

    Args:
        summary: From `summarise_study`.
        grid: Of the same study.
    """
    level = f"{summary['confidence']:.0%}"
    if not grid.means:
        return tuple(
            _matrix_table(f"{size}: mean [s], {level} interval, * the worst", rows, worst)
            for (size, rows), worst in zip(
                summary["matrix"].items(), summary["worst"].values(), strict=True
            )
        )
    found = []
    for panel in grid.means:
        evaders = sorted({m for series in panel.series.values() for m in series})
        rows = tuple(
            (label, *(_interval(**_means(summary, series[m])) for m in evaders))
            for label, series in panel.series.items()
        )
        title = f"{panel.title}: mean up to the horizon [s], {level} interval"
        found.append(MeanTable(title, ("evaders", *map(str, evaders)), rows))
    return tuple(found)


def to_markdown(tables: tuple[MeanTable, ...]) -> str:
    """Tables as a page has them, each below its title.

    Args:
        tables: In this order.
    """
    parts = []
    for table in tables:
        lines = [table.head, ("---",) * len(table.head), *table.rows]
        body = "\n".join(f"| {' | '.join(entry.strip() for entry in line)} |" for line in lines)
        parts.append(f"{table.title}\n\n{body}\n")
    return "\n".join(parts)


def _matrix_table(
    title: str, rows: dict[str, dict[str, dict[str, float]]], worst: dict[str, str]
) -> MeanTable:
    opponents = tuple(next(iter(rows.values())))
    entries = tuple(
        (
            name,
            *(
                _interval(**row[opponent]) + (" *" if opponent == worst[name] else "  ")
                for opponent in opponents
            ),
        )
        for name, row in rows.items()
    )
    return MeanTable(title, ("pursuers", *opponents), entries)


def _means(summary: dict[str, Any], cell: str) -> dict[str, float]:
    mean = summary["cells"][cell]["mean"]
    return {"mean": mean["value"], "low": mean["low"], "high": mean["high"]}


def _interval(mean: float, low: float, high: float) -> str:
    return f"{mean:.1f} ({low:.1f}-{high:.1f})"
