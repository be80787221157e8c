"""An assignment rule and evaders of one's own, in the laboratory."""

import numpy as np
import pytest

from sightfield.diagrams.station.hardware import read_run_log
from sightfield.diagrams.station.replay import load_recording, replay_station
from sightfield.diagrams.station.run import run_station
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.tracking import RandomWalkEvaders


def crosswise(view):
    """The last evader to the first pursuer, and so on."""
    return np.arange(len(view.evaders))[::-1]


def wanderers(game):
    evaders = game.scenario.evaders
    return RandomWalkEvaders(evaders.size, top_speed=evaders.top_speed, seed=3)


@pytest.fixture(scope="module")
def recorded(load_laboratory, tmp_path_factory):
    """A second and a half of both, in the simulated laboratory."""
    path = tmp_path_factory.mktemp("own") / "run.log"
    scenario, game = load_laboratory("seconds=1.5")
    own = {"assignment": crosswise, "evasion": wanderers(game)}
    run_station(scenario, game, log=path, realtime_rate=0, **own)
    return path


def test_they_are_what_is_played(recorded):
    samples = read_run_log(recorded).samples
    assert (samples["tracking.assignment"] == [2, 1, 0]).all()
    assert np.ptp(samples["evader.poses"], axis=0).max() > 0.02


def test_with_them_the_commands_are_the_same_again(recorded, tmp_path):
    recording = load_recording(recorded)
    own = {"assignment": crosswise, "evasion": wanderers(recording.game)}
    assert replay_station(recording, tmp_path / "again.log", **own).identical


@pytest.mark.parametrize("missing", ["assignment", "evasion"])
def test_without_them_a_log_is_not_played(recorded, tmp_path, missing):
    recording = load_recording(recorded)
    own = {"assignment": crosswise, "evasion": wanderers(recording.game)}
    del own[missing]
    with pytest.raises(InvalidInput, match=f"`{missing}` must be the one that was recorded with"):
        replay_station(recording, tmp_path / "again.log", **own)


def test_a_log_of_the_scenario_alone_is_not_played_with_another(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=0.2")
    run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0)
    recording = load_recording(tmp_path / "run.log")
    with pytest.raises(InvalidInput, match="`assignment` must be the scenario's"):
        replay_station(recording, tmp_path / "again.log", assignment=crosswise)
