"""Seeds of runs, and the share of runs in which something happens."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.statistics import run_seed, share


def test_seeds_are_those_of_the_children_that_the_root_spawns():
    children = np.random.SeedSequence(7).spawn(4)
    seeds = [int(child.generate_state(1, np.uint64)[0] >> np.uint64(11)) for child in children]
    assert [run_seed(7, run) for run in range(4)] == seeds


def test_no_two_runs_share_a_seed_and_json_holds_each_exactly():
    seeds = [run_seed(root, run) for root in range(5) for run in range(2000)]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**53 for seed in seeds)


def test_negative_numbers_are_refused():
    with pytest.raises(InvalidInput, match="`run` must be zero or positive; got -1"):
        run_seed(0, -1)


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
