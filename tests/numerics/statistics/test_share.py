"""The share of runs in which something happens."""

import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import share


def test_a_share_has_wilsons_interval():
    """Of 10 runs, 2: Wilson's 95% interval is 5.67% to 50.98%."""
    found = share(2, 10)
    assert (found.value, found.low, found.high) == pytest.approx((0.2, 0.0567, 0.5098), abs=1e-4)


@pytest.mark.parametrize(("hits", "count"), [(0, 5), (5, 5)])
def test_a_share_of_nothing_or_all_is_not_for_certain(hits, count):
    found = share(hits, count)
    assert found.high - found.low > 0.3


@pytest.mark.parametrize(("hits", "count"), [(1, 0), (3, 2), (-1, 2)])
def test_an_impossible_share_is_refused(hits, count):
    with pytest.raises(InvalidInput):
        share(hits, count)
