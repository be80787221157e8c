"""When a driver looks about for something else to do."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.driving.deciding import (
    MORE_PATIENCE,
    PATIENCE,
    deliberate,
    patience_of,
)
from sightfield.systems.numerics.harvest.driving.memory import (
    BACKING,
    BESIDE,
    DOING,
    EN_ROUTE,
    FAILS,
    MEMORY,
    NEWEST,
    RESTING,
    RETRY,
    STILL,
    STUCK,
    TARGET,
    WAY,
    note_task,
)
from sightfield.systems.numerics.harvest.strategies.serving import STAY

NOW = 100.0
# Nothing that a driver far from its place beside a combine would look at.
NOBODY = SimpleNamespace(time=NOW, progress=np.zeros(1))
LANES = SimpleNamespace(place_at=lambda combine, number, progress: 40.0)


def remember(doing, *, way=10.0, stuck=math.inf, still=math.inf, retry=0.0, target=0):
    memory = np.zeros(MEMORY)
    memory[[DOING, WAY, STUCK, STILL, RETRY]] = doing, way, stuck, still, retry
    memory[TARGET], memory[NEWEST], memory[FAILS] = target, 5, 2
    return memory


def thinks(memory, *, pours=False):
    return deliberate(memory, LANES, NOBODY, patience=PATIENCE, pours=pours)


def test_a_resting_driver_looks_for_a_way_to_its_task():
    assert thinks(remember(RESTING)) == (True, True)


def test_without_a_task_it_only_looks_about():
    assert thinks(remember(RESTING, target=STAY)) == (True, False)


@pytest.mark.parametrize("doing", [EN_ROUTE, BESIDE])
def test_on_its_way_it_goes_on_until_something_is_in_the_way_for_long(doing):
    assert thinks(remember(doing)) == (False, False)
    assert thinks(remember(doing, stuck=NOW - 0.9 * PATIENCE)) == (False, False)
    assert thinks(remember(doing, stuck=NOW - 1.1 * PATIENCE)) == (True, True)


def test_it_does_not_try_again_too_soon():
    assert thinks(remember(RESTING, retry=NOW + 1.0)) == (False, False)


def test_what_is_poured_from_a_standing_combine_is_poured_to_the_end():
    assert thinks(remember(BESIDE, stuck=0.0, still=0.0), pours=True) == (False, False)


def test_standing_beside_a_combine_it_looks_about_but_stays():
    assert thinks(remember(BESIDE, way=40.0, still=0.0)) == (True, False)


def test_far_past_its_place_it_comes_back():
    assert thinks(remember(BESIDE, way=400.0, still=0.0)) == (True, True)


def test_backing_up_ends_where_it_was_to_end_or_nothing_gives_way():
    backing = remember(BACKING)
    assert thinks(backing) == (False, False)
    assert backing[DOING] == BACKING
    for ended in (remember(BACKING, way=0.0), remember(BACKING, stuck=0.0)):
        assert thinks(ended) == (True, True)
        assert (ended[DOING], ended[FAILS]) == (RESTING, 0)


def test_a_new_task_ends_what_was_done_for_the_old_one():
    memory = remember(BESIDE, retry=NOW + 30.0)
    note_task(memory, 0, NOW)
    assert memory[DOING] == BESIDE
    note_task(memory, 1, NOW)
    assert (memory[TARGET], memory[DOING], memory[RETRY]) == (1, RESTING, NOW)


def test_those_that_come_first_try_again_first():
    assert patience_of(1, 2) == PATIENCE
    assert patience_of(0, 2) == PATIENCE + MORE_PATIENCE
