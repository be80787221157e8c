"""Studies whose times are made up, so that the verdicts are known."""

from collections.abc import Callable

import numpy as np
import pyarrow as pa
import pytest

from sightfield.diagrams.studies.records import SCHEMA, StudyResult
from sightfield.diagrams.studies.study import Cell, Study


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
