"""A study that takes a second or two."""

from collections.abc import Callable

import pytest

from sightfield.diagrams.studies.study import Cell, Study
from sightfield.diagrams.studies.tracking_study import thesis_base


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
