"""The weight of the modified field, swept."""

import json

import numpy as np
import pytest

from sightfield.diagrams.vision.report import sweep_weights, write_sweep
from sightfield.systems.numerics.errors import InvalidInput


def test_weights_are_swept_and_written_down(loaded, tmp_path):
    # From afar the pull alone brings the pursuer nearer than the field alone.
    scenario = loaded("omni_1v1", "seconds=2", "vision.senses=truth")
    told = []
    sweep = sweep_weights(scenario, [0.0, 1.0], [0, 1], told.append)
    assert told == [1, 2, 3, 4]
    assert sweep.values["tracking_time"].shape == (2, 2)
    alone, field = sweep.table()
    assert alone["weight"] == 0
    assert alone["mean_distance"] < field["mean_distance"]
    assert write_sweep(sweep, tmp_path) == ["weights.json", "weights.png"]
    written = json.loads((tmp_path / "weights.json").read_text())
    assert written["means"] == sweep.table()
    assert written["seeds"] == [0, 1]
    np.testing.assert_allclose(written["runs"]["tracking_time"], 2.0)


def test_a_weight_out_of_range_is_refused_before_anything_runs(loaded):
    told = []
    with pytest.raises(InvalidInput, match=r"`weight` must lie in \[0, 1\]; got 2"):
        sweep_weights(loaded("omni_1v1"), [0.5, 2.0], [0], told.append)
    assert told == []
