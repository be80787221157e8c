"""A study in numbers: each cell with its interval, each comparison with its p-value."""

from dataclasses import asdict

from ...systems.numerics.statistics import Estimate, holm, paired_difference, restricted_mean, share
from .grid import StudyGrid
from .opponents import opponent_of, runs_by_opponent
from .records import StudyResult

CONFIDENCE = 0.95


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
        of the teams, by pursuers the evaders with the least mean (`worst_of`). With a single run
        there are no comparisons.
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
            size: {name: worst_of(result, row) for name, row in rows.items()}
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


def worst_of(result: StudyResult, row: dict[str, str]) -> str:
    """The opponent with the least mean over the runs that all of a row have.

    Over the same runs, as the means of fewer runs say less. The first where several have the least.

    Args:
        result: A finished study.
        row: Names of cells by opponent.
    """
    shared = min(len(result.times(cell)) for cell in row.values())
    return min(row, key=lambda opponent: result.times(row[opponent])[:shared].mean())


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
