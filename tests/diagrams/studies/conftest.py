"""Studies small enough to be played in tests, and tables of studies made up for claims."""

from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pytest

from sightfield.diagrams.studies.records import SCHEMA, StudyResult
from sightfield.diagrams.studies.study import Cell, Study
from sightfield.diagrams.studies.team_studies import thesis_base


@pytest.fixture(scope="session")
def make_study() -> Callable[..., Study]:
    """A function of the number of runs: one pursuer against one and two, and lots and walks.

    Those who walk are played four times at most.
    """

    def make(runs: int, **changes) -> Study:
        cells = (
            Cell(name="1v1"),
            Cell(name="1v2", settings=("evaders.count=2",)),
            Cell(
                name="2v2-random",
                settings=(
                    "pursuers.count=2",
                    "evaders.count=2",
                    "pursuers.assignment=random_visible",
                    "evaders.policies=[random_walk]",
                ),
                runs=4 if runs > 4 else None,
            ),
        )
        settings = {"name": "small", "base": thesis_base(5.0), "cells": cells, "seed": 11}
        return Study(**{**settings, "runs": runs, **changes})

    return make


def make_result(study: Study, time_of: Callable[[Cell, np.random.Generator], np.ndarray]):
    """A finished study in which each cell's times come from a function, cut off at the horizon.

    Of the times of the function as many are taken as the cell has runs.
    """
    horizon, rows = study.base.seconds, []
    for cell in study.cells:
        times = np.maximum(time_of(cell, np.random.default_rng(3)), 0.0)
        for run, time in enumerate(times[: study.runs_of(cell)].tolist()):
            rows.append(
                {
                    "cell": cell.name,
                    "run": run,
                    "seed": run,
                    "pursuers": cell.value("pursuers.count"),
                    "evaders": cell.value("evaders.count"),
                    "horizon": horizon,
                    "time": min(time, horizon),
                    "censored": time >= horizon,
                    "lost_evader": -1 if time >= horizon else 0,
                }
            )
    return StudyResult(study, pa.Table.from_pylist(rows, schema=SCHEMA))


@pytest.fixture(scope="session")
def made_up():
    """See `make_result`."""
    return make_result
