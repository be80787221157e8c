"""A study in numbers: each cell with its interval, each comparison with its p-value."""

from dataclasses import asdict

from ...systems.numerics.statistics.corrections import holm
from ...systems.numerics.statistics.estimate import share
from ...systems.numerics.statistics.paired import paired_difference
from ...systems.numerics.statistics.survival import restricted_mean
from .grid import Grid
from .records import StudyResult

CONFIDENCE = 0.95


def summarise(result: StudyResult, grid: Grid) -> dict[str, object]:
    """The study in numbers, ready for JSON.

    Args:
        result: A finished study.
        grid: What to compare.

    Returns:
        study, seed, runs (of each cell), confidence, cells: by name the sizes of the teams,
        horizon [s], mean (restricted mean of the tracking time: value, low, high, standard_error
        [s], count), kept (share of runs in which nobody was lost before the horizon, with its
        interval); comparisons: first, second, and what `paired_difference` finds in
        first - second [s], with holm_p, its p_value adjusted for all comparisons. With a single
        run there are no comparisons.
    """
    study = result.study
    pairs = grid.pairs if study.runs > 1 else ()
    found = [
        paired_difference(result.times(first), result.times(second), CONFIDENCE)
        for first, second in pairs
    ]
    adjusted = holm([each.p_value for each in found])
    return {
        "study": study.name,
        "seed": study.seed,
        "runs": study.runs,
        "confidence": CONFIDENCE,
        "cells": {cell.name: _summarise_cell(result, cell.name) for cell in study.cells},
        "comparisons": [
            {"first": first, "second": second, **asdict(each), "holm_p": float(p)}
            for (first, second), each, p in zip(pairs, found, adjusted, strict=True)
        ],
    }


def _summarise_cell(result: StudyResult, cell: str) -> dict[str, object]:
    times, lost, horizon = result.times(cell), result.lost(cell), result.horizon(cell)
    row = result.study.cells.index(result.study.cell(cell)) * result.study.runs
    return {
        "pursuers": result.table["pursuers"][row].as_py(),
        "evaders": result.table["evaders"][row].as_py(),
        "horizon": horizon,
        "mean": asdict(restricted_mean(times, lost, horizon, CONFIDENCE)),
        "kept": asdict(share(int((~lost).sum()), len(lost), CONFIDENCE)),
    }
