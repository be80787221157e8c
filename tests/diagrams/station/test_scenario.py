"""Laboratories from files, and what is refused."""

from dataclasses import replace

import pytest

from sightfield.diagrams.scenario_files import build
from sightfield.diagrams.station.laboratory_files import load_station
from sightfield.diagrams.station.recording import station_tree
from sightfield.diagrams.station.scenario import StationScenario
from sightfield.systems.numerics.errors import InvalidInput


def test_the_game_is_that_of_the_track_command_unchanged(load_laboratory):
    from sightfield.diagrams.scenario_files import find_scenario, load_scenario
    from sightfield.diagrams.tracking.scenario import TrackingScenario

    scenario, _ = load_laboratory()
    assert scenario.tracking == load_scenario(TrackingScenario, find_scenario("thesis_3v3"))


def test_a_laboratory_survives_being_written_into_a_log(load_laboratory):
    scenario, game = load_laboratory("mocap.bodies=[a, b, c, d, e, f]", "tracking.seed=4")
    assert build(StationScenario, station_tree(scenario, game)) == scenario


def test_a_built_in_laboratory_goes_by_its_name():
    scenario = load_station("thesis_3v3", ["tracking.seed=2"])
    assert (scenario.tracking.seed, scenario.tracking.pursuers.size) == (2, 3)
    with pytest.raises(InvalidInput, match=r"one of thesis_3v3; got thesis_3v4$"):
        load_station("thesis_3v4")


def test_a_world_from_a_file_is_written_into_the_log_itself(tmp_path):
    (tmp_path / "room.wkt").write_text("POLYGON ((0 0, 4 0, 4 2, 2 2, 2 4, 0 4, 0 0))")
    (tmp_path / "game.yaml").write_text(
        "world: {file: room.wkt}\n"
        "pursuers: {model: differential_drive, top_speed: 0.3, positions: [[3, 1]]}\n"
        "evaders: {model: differential_drive, top_speed: 0.1, positions: [[1, 1]]}\n"
    )
    (tmp_path / "laboratory.yaml").write_text("tracking: game.yaml\nradio: {port: /dev/ttyX}\n")
    from sightfield.diagrams.tracking.game import set_up_game

    scenario = load_station(tmp_path / "laboratory.yaml", ["tracking.seed=2"])
    game = set_up_game(scenario.tracking)
    alone = build(StationScenario, station_tree(scenario, game))
    assert alone.tracking.world.file == ""
    assert set_up_game(alone.tracking).world.boundary.tolist() == game.world.boundary.tolist()
    assert replace(alone, tracking=scenario.tracking) == scenario
    assert (scenario.robots, scenario.bodies) == ([1, 2], ["pursuer0", "evader0"])


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("mocap.source=sonar", "`mocap.source` must be one of vicon"),
        ("mocap.stale_after=0", "`mocap.stale_after` must be positive; got 0"),
        # What only real robots and another motion capture would use is checked as well.
        ("radio.kind=foo", "`radio.kind` must be one of xbee, udp, mavlink, dds, crtp, or module:"),
        ("radio.kind=no_such:KIND", "`radio.kind` must be a module and a name in it; got no_such"),
        ("mocap.message=Pose", "`mocap.message` must be one of PoseStamped, Odometry, tf; got"),
        ("mocap.topic=poses", "`mocap.topic` must have {body} in it; got poses"),
        ("mocap.domain=233", "`mocap.domain` must be 0 to 232; got 233"),
        ("mocap.source=log", "`mocap.log` must name a recorded run; got nothing"),
        ("mocap.bodies=[a]", "`mocap.bodies` must name 6 robots or none"),
        ("radio.robots=[1, 1, 2, 3, 4, 5]", "`radio.robots` must differ"),
        ("radio.repeats=0", "`radio.repeats` must be positive; got 0"),
        ("omni_camera.carrier=3", "`omni_camera.carrier` must be below 3; got 3"),
        ("imperfections.radio.dropout=2", "`imperfections.radio.dropout` must lie in"),
        ("imperfections.radio.droput=0.1", "`imperfections.radio.droput` must be a key"),
        ("emulation.frame_loss=-0.1", "`emulation.frame_loss` must lie in"),
        ("tracking.evaders.policies=[you, adversarial, adversarial]", "not be you"),
        ("tracking=nonsense", "`scenario` must be a YAML file or one of"),
        ("time_step=0", "`time_step` must be positive"),
        ("time_step=10", "`time_step` must be at most the game's period, which is 0.05; got 10.0"),
        ("tracking.period=1e-300", "`tracking.period` must be 0.001 at least; got 1e-300"),
        ("omni_camera.rate=1e8", "`omni_camera.rate` must be 1000 at most; got 100000000.0"),
        ("supervision.slack=1e8", "`supervision.slack` must be 100 at most; got 100000000.0"),
        ("radio.repeats=1000000000", "`radio.repeats` must be 100 at most; got 1000000000"),
        ("windows=3", "`windows` must be a key of the scenario; got 3"),
    ],
)
def test_what_cannot_be_is_refused_by_its_name(load_laboratory, setting, message):
    with pytest.raises(InvalidInput) as error:
        load_laboratory(setting)
    assert str(error.value).startswith(message) or message in str(error.value)
    assert "\n" not in str(error.value)
