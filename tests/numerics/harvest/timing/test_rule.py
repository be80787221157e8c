"""Machines that drive by the rule, are late, stop and go on: all arrive, none near another."""

import numpy as np
import pytest

from sightfield.systems.numerics.harvest.timing.timetable import MachineTimetable, time_machines

# What the audit of a plan asks for [m].
LEAST = 0.3


@pytest.mark.parametrize("seed", range(8))
def test_late_machines_all_arrive_keep_their_distance_and_the_order(fleets, seed):
    rng = np.random.default_rng([7, seed])
    journeys = fleets.fleet_that_can_arrive(seed % 4, rng, 2 + seed % 3)
    found = time_machines(journeys, trials=5)
    assert isinstance(found, MachineTimetable)
    log = fleets.drive_disturbed(journeys, found, rng)
    assert log[-1] == pytest.approx([journey.path.length for journey in journeys], abs=0.02)
    assert fleets.least_distance(journeys, log) >= LEAST
    # Who goes first has left all that the other one comes to.
    progress = np.array([fleets.progress_at(found, each) for each in log])
    for (a, b), (i, j), first in zip(
        found.meetings.pairs, found.meetings.examples, found.first, strict=True
    ):
        ahead, behind = (a, b) if first == a else (b, a)
        left, entered = (i, j) if first == a else (j, i)
        begun = np.argmax(progress[:, behind] >= entered)
        assert progress[begun, ahead] > left


def test_a_machine_that_has_failed_stops_only_those_that_come_after_it(fleets):
    lines = [
        fleets.drive((0.0, 0.0, 0.1), (80.0, 0.0)),
        fleets.drive((40.0, -40.0, 1.7), (80.0, 0.0)),
        fleets.drive((0.0, 90.0, 0.1), (80.0, 0.0)),
    ]
    journeys = [fleets.journey(path, 1.5) for path in lines]
    found = time_machines(journeys)
    (first,) = found.first
    second = 1 - first
    stations = np.zeros(3)
    stations[first] = 20.0
    holds = fleets.holds_now(found, stations)
    assert holds[[first, 2]] == pytest.approx([80.0, 80.0])
    assert 20.0 < holds[second] < 40.0
    stations[first] = 79.99
    assert fleets.holds_now(found, stations) == pytest.approx([80.0] * 3)
