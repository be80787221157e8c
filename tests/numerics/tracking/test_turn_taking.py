"""Who waits, and whose turn it is."""

import numpy as np
import pytest

from sightfield.systems.numerics.tracking.collision_stop import (
    PATIENCE,
    TURN_LENGTH,
    still_waiting,
    take_turns,
)

PERIOD = 0.05


class TestWaiting:
    def waited(self, moved, wished=0.3, waiting=1.0):
        """For how long one has waited that moved so far in the last period."""
        positions, velocities = np.array([1.0 + moved, 2.0]), np.array([0.0, wished])
        return still_waiting(
            np.array([waiting]), np.array([1.0, 2.0]), positions, velocities, PERIOD
        )[0]

    def test_one_that_does_not_come_on_waits_longer(self):
        assert self.waited(0.0) == pytest.approx(1.0 + PERIOD)

    def test_one_that_comes_on_as_it_wishes_does_not_wait(self):
        assert self.waited(0.3 * PERIOD) == 0.0

    def test_one_that_wishes_for_nothing_does_not_wait(self):
        assert self.waited(0.0, wished=0.0) == 0.0

    def test_one_that_creeps_does_not_begin_to_wait_but_does_not_stop_either(self):
        assert self.waited(0.3 * 0.3 * PERIOD) == 1.0
        assert self.waited(0.3 * 0.3 * PERIOD, waiting=0.0) == 0.0


# Three in a row, each near the next, and a fourth far away; a stranger at the right.
ROW = np.array([0.0, 0.0, 0.33, 0.0, 0.66, 0.0, 5.0, 0.0])
RADII, STRANGER = np.full(4, 0.16), np.array([1.2, 0.0])


def turns_of(waiting, turns=None, places=ROW, strangers=STRANGER):
    """Whose turn it is."""
    before = np.zeros(len(waiting)) if turns is None else np.array(turns)
    left, waited = take_turns(before, np.array(waiting), places, RADII, strangers, PERIOD)
    assert (waited[left > 0.0] == 0.0).all()
    return np.flatnonzero(left).tolist()


class TestTurns:
    def test_nobody_has_a_turn_before_it_has_waited_for_a_while(self):
        assert turns_of([0.5, 0.3, 0.0, 0.55]) == []

    def test_the_one_that_has_waited_longest_is_first(self):
        assert turns_of([0.7, 0.9, 0.8, 0.0]) == [1]

    def test_of_those_that_have_waited_as_long_the_one_nearest_to_the_other_team_is_first(self):
        assert turns_of([0.7, 0.7, 0.7, 0.0]) == [2]

    def test_without_another_team_the_one_farthest_from_the_middle_is_first(self):
        assert turns_of([0.7, 0.7, 0.7, 0.0], strangers=np.empty(0)) == [0]

    def test_one_that_waits_elsewhere_takes_nobodys_turn(self):
        assert turns_of([0.7, 0.0, 0.0, 9.0]) == [0, 3]

    def test_a_group_has_one_turn_at_a_time(self):
        assert turns_of([5.0, 4.0, 0.0, 0.0], turns=[0.0, 0.0, 0.3, 0.0]) == [2]

    def test_a_turn_lasts_as_long_whether_it_is_used_or_not(self):
        turns, waiting = np.zeros(4), np.array([0.7, 0.0, 0.0, 0.0])
        steps = 0
        while steps == 0 or turns[0] > 0.0:
            turns, waiting = take_turns(turns, waiting, ROW, RADII, STRANGER, PERIOD)
            # It comes on from the first step.
            waiting[:] = 0.0
            steps += 1
        assert steps - 1 == pytest.approx(TURN_LENGTH / PERIOD)

    def test_all_of_a_group_that_stands_have_their_turns_one_after_the_other(self):
        turns, waiting, order = np.zeros(4), np.zeros(4), []
        for _ in range(round(3.5 * (TURN_LENGTH + PATIENCE) / PERIOD)):
            wished = np.array([0.3, 0.0, 0.3, 0.0, 0.3, 0.0, 0.0, 0.0])
            waiting = still_waiting(waiting, ROW, ROW, wished, PERIOD)
            turns, waiting = take_turns(turns, waiting, ROW, RADII, STRANGER, PERIOD)
            for i in np.flatnonzero(turns):
                if order[-1:] != [i]:
                    order.append(int(i))
        assert order[:4] in ([2, 1, 0, 2], [2, 0, 1, 2])
