"""One set of ports, whatever is behind it."""

import gc
import time
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, PortDataType

from sightfield.diagrams.station.hardware import Devices, Operator, read_run_log
from sightfield.diagrams.station.make_station import MakeStation
from sightfield.diagrams.station.ports import (
    COMMANDS,
    IMAGE,
    SENT,
    believed_ports,
    device_ports,
    supervisor_ports,
)
from sightfield.diagrams.station.run import HORIZON, LOSS, STOP, run_station
from sightfield.hardware_io.cameras import NoCamera
from sightfield.hardware_io.mocap.pose_receiver import NewestPoses
from sightfield.systems.numerics.errors import InvalidInput
from sightfield.systems.numerics.station.supervision import Reason


def ports(station):
    """Names and sizes of all ports, in order; an abstract one has none."""

    def size(port):
        return port.size() if port.get_data_type() == PortDataType.kVectorValued else None

    inputs = [station.get_input_port(k) for k in range(station.num_input_ports())]
    outputs = [station.get_output_port(k) for k in range(station.num_output_ports())]
    return [[(port.get_name(), size(port)) for port in side] for side in (inputs, outputs)]


class SilentLink:
    """A link to robots that say nothing, which remembers what it was to send."""

    robots = (1, 2, 3, 4, 5, 6)

    def __init__(self):
        self.sent = []

    def send_commands(self, velocities, valid=None, age=0.0):
        self.sent.append((np.array(velocities), np.array(valid)))

    def telemetry(self):
        return {}

    def health(self):
        class Health:
            """Of a link over which nothing came."""

            quality = (0.0,) * 6

        return Health


def silent_devices():
    return Devices(
        poses=NewestPoses([f"robot{k}" for k in range(6)]), radio=SilentLink(), camera=NoCamera()
    )


@pytest.fixture(scope="module")
def short_log(load_laboratory, tmp_path_factory):
    """Of a second in the simulated laboratory."""
    path = tmp_path_factory.mktemp("short") / "run.log"
    scenario, game = load_laboratory("seconds=1")
    run_station(scenario, game, log=path, realtime_rate=0)
    return path


def test_the_ports_are_the_same_in_every_mode(load_laboratory, short_log):
    scenario, game = load_laboratory()
    simulated = ports(MakeStation(scenario, game=game))
    assert simulated == ports(MakeStation(scenario, silent_devices(), game=game))
    assert simulated == ports(MakeStation(scenario, read_run_log(short_log), game=game))
    told = {**believed_ports(scenario), **supervisor_ports(scenario)}
    sizes = {**device_ports(scenario), IMAGE: None, **told, SENT: 12}
    assert simulated == [[(COMMANDS, 12)], list(sizes.items())]


def test_a_log_of_a_single_tick_is_played_again(load_laboratory, short_log):
    scenario, game = load_laboratory()
    log = read_run_log(short_log)
    log = replace(log, times=log.times[:1], samples={k: v[:1] for k, v in log.samples.items()})
    station = MakeStation(scenario, log, game=game)
    context = station.CreateDefaultContext()
    assert np.isfinite(station.GetOutputPort("pursuer.poses").Eval(context)).all()


def test_without_hardware_true_is_refused_in_one_line(load_laboratory):
    scenario, game = load_laboratory("radio.port=/dev/ttyNOTHING")
    with pytest.raises(Exception, match="/dev/ttyNOTHING") as error:
        MakeStation(scenario, hardware=True, game=game)
    assert "\n" not in str(error.value)


def test_hardware_stays_open_as_long_as_the_process(load_laboratory, monkeypatch):
    scenario, game = load_laboratory()
    at_the_end, closed = [], []

    @contextmanager
    def opened(*_):
        yield silent_devices()
        closed.append(True)

    monkeypatch.setattr("sightfield.diagrams.station.make_station.open_laboratory", opened)
    monkeypatch.setattr("atexit.register", at_the_end.append)
    station = MakeStation(scenario, hardware=True, game=game)
    gc.collect()
    assert station.num_input_ports() == 1
    assert not closed
    for close in at_the_end:
        close()
    assert closed == [True]


def drive(station, commands, seconds):
    """Run a station on constant commands; a function of a port's name: its value."""
    builder = DiagramBuilder()
    builder.AddSystem(station)
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = station.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    station.GetInputPort(COMMANDS).FixValue(context, commands)
    simulator.AdvanceTo(seconds)
    return lambda name: np.asarray(station.GetOutputPort(name).Eval(context))


def test_simulated_robots_do_as_they_are_told(load_laboratory):
    scenario, game = load_laboratory("imperfections={}")
    commands = np.zeros(12)
    commands[0], commands[7] = 0.2, 1.0
    value = drive(MakeStation(scenario, game=game), commands, 1.025)
    way = value("pursuer.poses") - game.pursuer_starts.ravel()
    turn = value("evader.poses") - game.evader_starts.ravel()
    # The command is on its way for a period, and the pose for one of the motion capture.
    assert way[0] == pytest.approx(0.2 * 0.95, abs=0.2 * 0.1)
    assert np.abs(way[1:]).max() < 1e-9
    assert turn[2] == pytest.approx(0.95, abs=0.1)
    assert (value("pursuer.valid") == 1).all()
    assert np.allclose(1.0 - value("pursuer.stamp"), value("pursuer.age"))


def test_with_the_motion_capture_gone_nobody_in_simulation_moves(load_laboratory):
    scenario, game = load_laboratory("imperfections.mocap.dropout=1.0")
    value = drive(MakeStation(scenario, game=game), np.full(12, 0.2), 1.0)
    assert (value("pursuer.valid") == 0).all()
    assert (value(SENT) == 0).all()
    assert value("infrared.valid").any()


def test_with_the_radio_gone_nobody_in_simulation_moves(load_laboratory):
    scenario, game = load_laboratory("imperfections.radio.dropout=1.0")
    value = drive(MakeStation(scenario, game=game), np.full(12, 0.2), 0.63)
    assert np.abs(value("pursuer.poses") - game.pursuer_starts.ravel()).max() < 1e-3
    # Commands go out until it is noticed that nobody follows them.
    assert set(value("supervisor.reason")) == {Reason.NOT_FOLLOWING}
    assert (value(SENT) == 0).all()


def test_robots_that_nobody_sees_are_told_to_stand(load_laboratory):
    scenario, game = load_laboratory()
    devices = silent_devices()
    drive(MakeStation(scenario, devices, game=game), np.full(12, 0.2), 0.2)
    assert len(devices.radio.sent) >= 4
    for velocities, valid in devices.radio.sent:
        assert (velocities == 0).all()
        assert not valid.any()


def test_a_simulated_camera_gives_pictures_and_their_ages(load_laboratory):
    scenario, game = load_laboratory("omni_camera.source=capture")
    value = MakeStation(scenario, game=game)
    builder = DiagramBuilder()
    builder.AddSystem(value)
    simulator = Simulator(builder.Build())
    context = value.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    value.GetInputPort(COMMANDS).FixValue(context, np.zeros(12))
    simulator.AdvanceTo(0.27)
    picture = value.GetOutputPort(IMAGE).Eval(context).data
    assert len(np.unique(picture.reshape(-1, 4), axis=0)) > 100
    assert value.GetOutputPort("omni_camera.valid").Eval(context) == 1
    assert value.GetOutputPort("omni_camera.age").Eval(context) <= 0.15


def test_a_run_with_pictures_is_recorded_and_played_again(load_laboratory, tmp_path):
    scenario, game = load_laboratory("omni_camera.source=capture", "seconds=0.3")
    run_station(scenario, game, log=tmp_path / "a.log", realtime_rate=0)
    first = read_run_log(tmp_path / "a.log")
    assert len(first.pictures[IMAGE]) >= 3
    options = {"realtime_rate": 0, "ticks": len(first.times)}
    run_station(scenario, game, first, log=tmp_path / "b.log", **options)
    second = read_run_log(tmp_path / "b.log")
    assert [png for _, png in second.pictures[IMAGE]] == [png for _, png in first.pictures[IMAGE]]


def test_a_run_ends_at_its_horizon(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=1")
    done = run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0)
    assert (done.how, done.lost_evader) == (HORIZON, None)
    assert done.tracking_time == pytest.approx(1.0)
    assert len(read_run_log(tmp_path / "run.log").times) == 21


def test_robots_keep_off_one_another_while_they_track(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=12")
    run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0)
    log = read_run_log(tmp_path / "run.log")
    places = np.concatenate(
        [log.samples[f"{team}.poses"].reshape(-1, 3, 3) for team in ("pursuer", "evader")], axis=1
    )[..., :2]
    first, second = np.triu_indices(6, 1)
    distances = np.hypot(*(places[:, first] - places[:, second]).transpose(2, 0, 1))
    # They do meet; the poses are rounded to a millimetre.
    contact = 2 * scenario.tracking.pursuers.radius
    assert contact - 0.01 < distances.min() < contact + 0.05


def test_a_run_ends_when_an_evader_is_lost(load_laboratory, tmp_path):
    scenario, game = load_laboratory("tracking=corner_1v1", "radio.robots=[]", "seconds=60")
    done = run_station(scenario, game, log=tmp_path / "run.log", realtime_rate=0)
    assert (done.how, done.lost_evader) == (LOSS, 0)
    log = read_run_log(tmp_path / "run.log")
    assert log.times[-2] <= done.tracking_time <= log.times[-1]


def test_a_run_ends_when_the_operator_stops_it_and_robots_are_told_so(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=5")
    operator = Operator()

    def at_tick(now):
        if now >= 1.0:
            operator.say("stop")

    done = run_station(
        scenario,
        game,
        log=tmp_path / "run.log",
        operator=operator,
        realtime_rate=0,
        at_tick=at_tick,
    )
    assert done.how == STOP
    log = read_run_log(tmp_path / "run.log")
    assert log.samples["operator.mode"][-1] == -1
    assert (log.samples[SENT][-1] == 0).all()
    assert np.abs(log.samples[SENT][-2]).max() > 0


def test_while_paused_robots_stand_and_sight_is_kept(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=2")
    operator = Operator(running=False)
    done = run_station(scenario, game, log=tmp_path / "run.log", operator=operator, realtime_rate=0)
    log = read_run_log(tmp_path / "run.log")
    assert (log.samples[SENT] == 0).all()
    # The clock runs only while robots do.
    assert done.tracking_time == 0
    poses = log.samples["pursuer.poses"]
    assert np.abs(poses - poses[0]).max() < 2e-3


def test_a_robot_off_the_map_harms_nobody(load_laboratory, tmp_path):
    scenario, game = load_laboratory("seconds=0.5")
    devices, now = silent_devices(), time.monotonic()
    devices.poses.see("robot0", [1e6, -1e6, 100.0], now + 60)
    devices.poses.see("robot5", [1.2, 0.9, 0.0], now + 60)
    run_station(scenario, game, devices, log=tmp_path / "run.log", realtime_rate=0)
    log = read_run_log(tmp_path / "run.log")
    assert log.samples["pursuer.valid"][-1].tolist() == [1, 0, 0]
    assert np.isfinite(log.samples[COMMANDS]).all()
    # Those that nobody sees stand.
    assert (log.samples[SENT].reshape(-1, 6, 2)[:, 1:5] == 0).all()


def test_a_laboratory_with_other_bodies_than_robots_is_refused(load_laboratory):
    scenario, game = load_laboratory()
    devices = Devices(poses=NewestPoses(["a"]), radio=SilentLink(), camera=NoCamera())
    with pytest.raises(InvalidInput, match=r"`starts` must have shape \(1, 3\); got \(6, 3\)"):
        MakeStation(scenario, devices, game=game)


@pytest.mark.parametrize("operated", [False, True])
@pytest.mark.parametrize("hardware", [False, True])
def test_every_input_is_connected(load_laboratory, unconnected, hardware, operated):
    scenario, game = load_laboratory()
    behind = silent_devices() if hardware else False
    operator = Operator() if operated else None
    assert unconnected(MakeStation(scenario, behind, game=game, operator=operator)) == []
