"""The filter uses each picture once, carries on without, and forgets in the end."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.vision.position_filter import PositionFilter

SPREAD = np.tile([0.01, 0.0, 0.0, 0.01], 2)


class Bench:
    """A filter of two points, fed by hand; the second is never seen."""

    def __init__(self, **settings):
        self.system = PositionFilter(2, **settings)
        self.simulator = Simulator(self.system)
        self.context = self.simulator.get_mutable_context()
        self.feed(-1, 0.0, None)

    def feed(self, number, time, position):
        """Show a picture of a time, with an estimate of the first point or none."""
        seen = position is not None
        places = [*(position if seen else (np.nan, np.nan)), np.nan, np.nan]
        spread = np.where(np.isfinite(places).repeat(2), SPREAD, np.inf)
        for name, values in (
            ("position", places),
            ("covariance", spread),
            ("valid", [float(seen), 0.0]),
            ("frame", [number, time, 1.0]),
        ):
            self.system.GetInputPort(name).FixValue(self.context, np.array(values, dtype=float))

    def read(self, name):
        return self.system.GetOutputPort(name).Eval(self.context)

    def run(self, time):
        self.simulator.AdvanceTo(time)


def test_before_the_first_picture_nothing_is_known():
    bench = Bench()
    bench.run(0.05)
    assert bench.read("known").tolist() == [0, 0]
    assert np.isnan(bench.read("filtered_position")).all()
    assert np.isnan(bench.read("velocity")).all()
    assert np.isinf(bench.read("filtered_covariance")[[0, 3, 4, 7]]).all()


def test_a_point_in_steady_motion_is_followed_and_its_velocity_found():
    bench = Bench(period=0.1)
    for k in range(40):
        time = 0.1 * k
        bench.feed(k, time, (1 + 0.2 * time, 2 - 0.1 * time))
        bench.run(time + 0.05)
    now = 3.95
    assert bench.read("known").tolist() == [1, 0]
    assert bench.read("velocity")[:2] == pytest.approx([0.2, -0.1], abs=0.02)
    expected = [1 + 0.2 * now, 2 - 0.1 * now]
    assert bench.read("filtered_position")[:2] == pytest.approx(expected, abs=0.01)
    assert np.isnan(bench.read("filtered_position")[2:]).all()


def test_a_picture_that_stays_is_used_once():
    bench = Bench(period=0.1, patience=10.0)
    bench.feed(1, 0.0, (1.0, 2.0))
    bench.run(0.05)
    first = bench.read("filtered_covariance")[0]
    bench.run(1.0)
    assert bench.read("filtered_covariance")[0] > first


def test_a_late_picture_counts_for_the_time_it_was_taken():
    prompt, late = Bench(period=0.1), Bench(period=0.1)
    for bench, delay in ((prompt, 0.0), (late, 0.1)):
        for k in range(1, 10):
            bench.run(max(0.1 * k + delay - 0.05, 0.0))
            bench.feed(k, 0.1 * k, (0.3 * 0.1 * k, 0.0))
        bench.run(1.2)
    for name in ("filtered_position", "velocity", "filtered_covariance"):
        np.testing.assert_allclose(late.read(name), prompt.read(name))


def test_after_its_patience_a_point_is_forgotten_and_found_anew_elsewhere():
    bench = Bench(period=0.1, patience=0.5)
    bench.feed(1, 0.0, (1.0, 2.0))
    bench.run(0.45)
    assert bench.read("known")[0] == 1
    bench.run(0.65)
    assert bench.read("known")[0] == 0
    bench.feed(2, 0.65, (3.0, 0.0))
    bench.run(0.75)
    assert bench.read("known")[0] == 1
    assert bench.read("filtered_position")[:2] == pytest.approx([3.0, 0.0])


def test_one_wild_estimate_is_left_out():
    bench = Bench(period=0.1)
    for k in range(20):
        wild = k == 15
        bench.feed(k, 0.1 * k, (4.0, 4.0) if wild else (1.0, 2.0))
        bench.run(0.1 * k + 0.05)
        if k > 5:
            assert bench.read("filtered_position")[:2] == pytest.approx([1.0, 2.0], abs=0.05)


@pytest.mark.parametrize(
    "wrong",
    [{"speed_std": 0}, {"acceleration_density": -1}, {"patience": 0}, {"period": 0}],
)
def test_parameters_out_of_range_are_refused(wrong):
    with pytest.raises(InvalidInput, match=f"`{next(iter(wrong))}` must be positive"):
        PositionFilter(1, **wrong)


def test_no_points_are_refused():
    with pytest.raises(InvalidInput, match="`count` must be positive; got 0"):
        PositionFilter(0)
