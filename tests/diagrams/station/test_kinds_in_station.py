"""The game with six robots of each kind, by one diagram and under one supervisor."""

import numpy as np
import pytest

from sightfield.diagrams.station.hardware import Operator, read_run_log
from sightfield.diagrams.station.replay import load_recording, replay_station
from sightfield.diagrams.station.run import HORIZON, run_station
from sightfield.diagrams.station.session import open_laboratory
from sightfield.hardware_io.kinds.known_kinds import KINDS
from sightfield.systems.numerics.station.supervision import Reason


# Robots with the real firmware play in `test_emulated_laboratory.py`.
@pytest.mark.parametrize("kind", [name for name in KINDS if name != "xbee"])
def test_six_robots_play_and_the_run_is_played_again_to_the_bit(kind, load_laboratory, tmp_path):
    scenario, game = load_laboratory(f"radio.kind={kind}", "seconds=1.5")
    log = tmp_path / "run.log"
    with open_laboratory(scenario, game, "emulate", Operator()) as devices:
        run = run_station(scenario, game, devices, log=log, mode="emulate")
        # A tenth of the messages is lost.
        assert devices.radio.health().sent > 50
    assert run.how == HORIZON
    record = read_run_log(log)
    assert np.unique(record.samples["supervisor.reason"]).tolist() == [Reason.NONE]
    poses = record.samples["pursuer.poses"].reshape(-1, 3, 3)
    ways = np.hypot(*np.diff(poses[:, :, :2], axis=0).transpose(2, 0, 1)).sum(axis=0)
    assert (ways > 0.1).all()
    # What robots report is heard, and encoders count the same ways.
    counts = record.samples["radio.counts"].reshape(-1, 6, 2)
    driven = (counts[-1] - counts[0])[:3].mean(axis=1) / scenario.supervision.counts_per_metre
    assert driven == pytest.approx(ways, rel=0.2, abs=0.12)
    again = replay_station(load_recording(log), tmp_path / "again.log")
    assert (again.identical, again.differing) == (True, ())
