"""One small example of every LeafSystem of the package, for tests that hold for all of them."""

from collections.abc import Callable

import pytest
from pydrake.systems.framework import LeafSystem


@pytest.fixture(scope="session")
def system_examples() -> dict[str, Callable[[], LeafSystem]]:
    """How to make a small one of each LeafSystem, by class name (templates without `_`).

    Choose sizes that differ from each other (2 pursuers, 3 evaders), so that a test which mixes
    them up fails.
    """
    return {}
