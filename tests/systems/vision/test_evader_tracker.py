"""The tracker in a diagram: each picture once, for its own time, and outputs for the present."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.geometry.world import make_world
from sightfield.systems.numerics.vision.estimation.shell_detection import Outcome
from sightfield.systems.vision.evader_tracker import EvaderTracker

WORLD = make_world([[0, 0], [4, 0], [4, 3], [0, 3]])
SIZES = {"cameras": 2, "colours": ["red"], "speed": 0.1, "period": 0.1, "cells": 400}


class Bench:
    """A tracker of one evader with two cameras, fed by hand."""

    def __init__(self, **settings):
        self.system = EvaderTracker(WORLD, [WORLD], **{**SIZES, **settings})
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        for camera in range(2):
            self.show(camera, -1, 0.0, None)

    def show(self, camera, number, time, position, outcome=Outcome.NO_SHELL_SHAPE):
        seen = position is not None
        for name, values in (
            ("position", position if seen else (np.nan, np.nan)),
            ("covariance", np.diag([1e-4, 1e-4] if seen else [np.inf, np.inf]).ravel()),
            ("valid", [seen]),
            ("outcome", [Outcome.SEEN if seen else outcome]),
            ("frame", [number, time, 1.0]),
            ("exposure_pose", [0.5, 0.5, 0.0]),
        ):
            port = self.system.GetInputPort(f"{name}_{camera}")
            port.FixValue(self.context, np.array(values, dtype=float))

    def read(self, name):
        return self.system.GetOutputPort(name).Eval(self.context)

    def film_a_runner(self):
        """Pictures at 10 Hz of one that goes along at 0.06, -0.05 m/s, until 3 s."""
        for k in range(31):
            time = 0.1 * k
            self.simulator.AdvanceTo(time)
            self.show(0, k, time, (1 + 0.06 * time, 2 - 0.05 * time))


def test_before_the_first_picture_nobody_is_known():
    bench = Bench()
    bench.simulator.AdvanceTo(0.05)
    assert bench.read("evader_known") == [0]
    assert (bench.read("evader_position") < 0).all()
    assert np.isinf(bench.read("evader_covariance")[[0, 3]]).all()
    assert bench.read("evader_set").all()


def test_a_picture_counts_from_the_moment_at_which_it_is_due():
    bench = Bench(delay=0.05)
    bench.show(0, 0, 0.0, (1.0, 1.0))
    bench.show(1, 0, 0.0, (1.01, 1.0))
    bench.simulator.AdvanceTo(0.04)
    assert bench.read("evader_known") == [0]
    bench.simulator.AdvanceTo(0.051)
    assert bench.read("evader_known") == [1]
    assert bench.read("evader_position") == pytest.approx([1.005, 1.0])
    assert bench.read("evader_covariance")[0] == pytest.approx(5e-5, rel=0.3)


def test_a_mover_that_is_filmed_but_gives_no_estimate_is_carried_on():
    bench = Bench()
    bench.film_a_runner()
    for k in range(31, 35):
        bench.show(0, k, 0.1 * k, None)
        bench.simulator.AdvanceTo(0.1 * k + 0.03)
        now = 0.1 * k + 0.03
        expected = [1 + 0.06 * now, 2 - 0.05 * now]
        np.testing.assert_allclose(bench.read("evader_position"), expected, atol=2e-3)
    np.testing.assert_allclose(bench.read("evader_velocity"), [0.06, -0.05], atol=5e-3)


def test_a_picture_that_stays_is_used_once():
    bench = Bench()
    bench.show(0, 0, 0.0, (1.0, 2.0))
    bench.simulator.AdvanceTo(0.12)
    first = bench.read("evader_covariance")[0]
    bench.simulator.AdvanceTo(0.4)
    assert bench.read("evader_covariance")[0] > first


def test_out_of_sight_the_set_grows_and_a_look_shrinks_it():
    bench = Bench()
    bench.film_a_runner()
    bench.simulator.AdvanceTo(12.0)
    wide = bench.read("evader_set").sum()
    assert wide > 20
    # A wall of the room stands in nobody's way here: all of the set within reach is empty, and
    # the evader is somewhere else.
    before = bench.read("evader_set") > 0.5
    bench.show(1, 1, 12.0, None, Outcome.NO_BLOB)
    bench.simulator.AdvanceTo(12.15)
    after = bench.read("evader_set") > 0.5
    assert (before & ~after).sum() > 0.8 * wide


def test_a_run_is_resumed_from_a_copy_of_its_context():
    bench = Bench()
    bench.film_a_runner()
    copy = bench.context.Clone()
    bench.simulator.AdvanceTo(4.0)
    other = Simulator(bench.system, copy)
    other.AdvanceTo(4.0)
    for name in ("evader_position", "evader_covariance", "evader_set"):
        again = bench.system.GetOutputPort(name).Eval(copy)
        np.testing.assert_array_equal(again, bench.read(name))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"cameras": 0}, "`cameras` must be positive; got 0"),
        ({"colours": []}, "`colours` must have an entry for each evader"),
        ({"period": 0.0}, "`period` must be positive; got 0.0"),
        ({"speed": -1.0}, "`speed` must be zero or positive; got -1.0"),
        ({"delay": -1.0}, "`delay` must be zero or positive; got -1.0"),
        ({"certain_range": (2.0, 1.0)}, "`certain_range` must be"),
        ({"cells": 3}, "`cells` must be at least 100; got 3"),
    ],
)
def test_numbers_out_of_range_are_refused(change, message):
    with pytest.raises(InvalidInput, match=message):
        EvaderTracker(WORLD, [WORLD], **{**SIZES, **change})
