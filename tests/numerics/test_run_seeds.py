"""Seeds of runs."""

import numpy as np
import pytest

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.run_seeds import run_seed


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
