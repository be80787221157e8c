"""A link refuses what it cannot send, says in one line that no radio is there, and retries.

A module that takes nothing holds nobody up.
"""

import os
import pty
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from digi.xbee.models.status import TransmitStatus
from digi.xbee.packets.raw import TXStatusPacket
from serial import SerialTimeoutException

from sightfield.hardware_io.emulation.air import AirSettings, Flight
from sightfield.hardware_io.emulation.emulated_radio import EmulatedRadio
from sightfield.hardware_io.kinds import xbee_link
from sightfield.hardware_io.kinds.xbee_frames import Entry, Form, decode
from sightfield.hardware_io.kinds.xbee_link import RadioError, RadioLink, XBeePort
from sightfield.systems.numerics.errors import InvalidInput


@pytest.fixture
def deaf_robots():
    """A port with a module, and robots that never answer."""
    with EmulatedRadio(2, AirSettings()) as radio:
        leaving = threading.Event()

        def run() -> None:
            began = time.monotonic()
            while not leaving.wait(0.002):
                radio.exchange(time.monotonic() - began, (b"", b""))

        thread = threading.Thread(target=run)
        thread.start()
        yield radio
        leaving.set()
        thread.join()


@pytest.mark.parametrize("port", ["/dev/ttyUSB99", "/dev/null"])
def test_without_a_device_the_port_is_named(port):
    with pytest.raises(RadioError, match=f"no radio at {port}") as refusal, RadioLink(port, [1]):
        pass
    assert "\n" not in str(refusal.value)


def test_a_device_that_is_no_module_is_refused(monkeypatch):
    monkeypatch.setattr(xbee_link, "_PATIENCE", 0.1)
    ends = pty.openpty()
    port = os.ttyname(ends[1])
    with pytest.raises(RadioError, match=f"no 802.15.4 XBee .* at {port}"), RadioLink(port, [1]):
        pass
    for end in ends:
        os.close(end)


def test_a_link_that_is_not_open_sends_nothing():
    with pytest.raises(RadioError, match="not open"):
        RadioLink("/dev/null", [1]).heartbeat()


@pytest.mark.parametrize("robots", [[], [255], [-1], [1, 1], ["a"], [1.5]])
def test_robots_that_are_none_are_refused(robots):
    with pytest.raises(InvalidInput, match="`robots`"):
        RadioLink("/dev/null", robots)


@pytest.mark.parametrize(
    ("velocities", "options", "name"),
    [
        (np.zeros((1, 2)), {}, "velocities"),
        (np.zeros((2, 3)), {}, "velocities"),
        (np.full((2, 2), np.nan), {}, "velocities"),
        (np.zeros((2, 2)), {"valid": np.ones(3, bool)}, "valid"),
        (np.zeros((2, 2)), {"age": -0.1}, "age"),
        (np.zeros((2, 2)), {"age": np.inf}, "age"),
    ],
)
def test_commands_that_are_none_are_refused(velocities, options, name):
    with pytest.raises(InvalidInput, match=f"`{name}`"):
        RadioLink("/dev/null", [1, 2]).send_commands(velocities, **options)


def test_robots_that_do_not_answer_are_asked_again_and_then_reported(deaf_robots):
    with RadioLink(deaf_robots.port, [1, 2]) as link:
        assert link.arm(timeout=0.3) == ()
        statistics = link.health()
        assert statistics.lost == 2
        assert statistics.retried >= 2
        assert statistics.sent == statistics.retried + 1


def test_a_stop_is_repeated_often_enough_to_lose_several_frames_and_be_in_time(deaf_robots):
    with RadioLink(deaf_robots.port, [1, 2]) as link:
        assert link.stop(timeout=0.4) == ()
        # Every 0.02 s, on a busy machine less often; 0.1 s would be too late after two losses.
        assert link.health().retried >= 8


def test_a_stop_ends_an_arm_that_is_under_way(deaf_robots):
    with RadioLink(deaf_robots.port, [1, 2]) as link:
        answers = []
        arming = threading.Thread(target=lambda: answers.append(link.arm(timeout=60)))
        arming.start()
        while link.health().sent < 2:
            time.sleep(0.01)
        link.stop(timeout=0)
        arming.join(timeout=30)
        assert answers == [()]


def test_a_team_too_large_for_one_frame_gets_two(deaf_robots):
    robots = list(range(20))
    with RadioLink(deaf_robots.port, robots) as link:
        before = link.health().sent
        link.send_commands(np.zeros((20, 2)))
        assert link.health().sent == before + 2


@pytest.mark.parametrize(
    ("send", "form"), [("send_wheel_speeds", Form.WHEELS), ("send_commands", Form.TWIST)]
)
def test_speeds_of_robots_go_out_in_their_form(deaf_robots, monkeypatch, send, form):
    flights, fly = [], deaf_robots.air.send
    monkeypatch.setattr(
        deaf_robots.air, "send", lambda flight, time: (flights.append(flight), fly(flight, time))[1]
    )
    with RadioLink(deaf_robots.port, [3, 5]) as link:
        getattr(link, send)(np.array([[0.25, -0.125], [0.5, 1.0]]), np.array([True, False]))
        wait_until(lambda: flights)
    command = decode(flights[0].payload)
    assert command.form == form
    assert command.entries[0] == Entry(robot=3, first=250, second=-125)
    assert all((entry.first, entry.second) == (0, 0) for entry in command.entries[1:])


def test_noise_in_payloads_is_counted_and_the_link_goes_on(deaf_robots):
    rng = np.random.default_rng(0)
    with RadioLink(deaf_robots.port, [1, 2]) as link:
        for count in range(1, 101):
            noise = rng.bytes(int(rng.integers(1, 100)))
            deaf_robots.air.send(Flight(1, 0, noise, False), 0.0)
            wait_until(lambda count=count: link.health().refused == count)
        before = link.health()
        assert (before.received, before.rssi) == (0, -48)
        link.heartbeat()
        assert link.health().sent == before.sent + 1


def wait_until(condition, patience=20.0):
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.002)


def test_a_module_that_goes_away_is_an_error():
    radio = EmulatedRadio(1, AirSettings())
    leaving = threading.Event()

    def run() -> None:
        while not leaving.wait(0.002):
            radio.exchange(0.0, (b"",))

    with radio:
        thread = threading.Thread(target=run)
        thread.start()
        link = RadioLink(radio.port, [1]).__enter__()
        leaving.set()
        thread.join()

    def send_until_it_fails() -> None:
        for _ in range(200):
            link.heartbeat()
            time.sleep(0.05)

    with pytest.raises(RadioError, match="has gone"):
        send_until_it_fails()
    with pytest.raises(RadioError, match="has gone"):
        link.__exit__(None, None, None)
    # What went wrong before is not hidden by it.
    link.__exit__(KeyError, KeyError(), None)


class Module:
    """In place of digi-xbee's device: keeps what is sent, and confirms it when told to."""

    def __init__(self, *_, **__):
        self.serial_port = SimpleNamespace(write_timeout=None, reset_output_buffer=lambda: None)
        self.sent, self.stalled = [], False

    def open(self):
        self.number = 0

    def close(self):
        """Nothing is held."""

    def add_packet_received_callback(self, hear):
        self.hear = hear

    def del_packet_received_callback(self, hear):
        assert hear == self.hear

    def get_next_frame_id(self):
        self.number = self.number % 255 + 1
        return self.number

    def send_packet(self, packet):
        if self.stalled:
            raise SerialTimeoutException("Write timeout")
        self.sent.append(packet.frame_id)

    def confirm(self, frame_id):
        self.hear(TXStatusPacket(frame_id, TransmitStatus.SUCCESS))


@pytest.fixture
def port(monkeypatch):
    """An open port to such a module, the module, and its clock."""
    module, clock = Module(), SimpleNamespace(now=10.0)
    monkeypatch.setattr(xbee_link, "Raw802Device", lambda *_, **__: module)
    monkeypatch.setattr(xbee_link.time, "monotonic", lambda: clock.now)
    with XBeePort("/dev/none", 57600, lambda *_: None, lambda *_: None) as opened:
        yield opened, module, clock


def test_a_line_that_takes_a_frame_late_loses_that_frame_alone(port):
    opened, module, clock = port
    assert module.serial_port.write_timeout == 0.1
    opened.send(b"x")
    module.stalled = True
    assert opened.send(b"x") is None
    clock.now += 0.1
    module.stalled = False
    assert opened.send(b"x") == 3
    module.confirm(3)
    assert [opened.send(b"x") for _ in range(2)] == [4, 5]


def test_a_line_that_takes_nothing_is_given_up_after_half_a_second(port):
    opened, module, clock = port
    module.stalled = True
    for _ in range(6):
        assert opened.send(b"x") is None
        clock.now += 0.1
    with pytest.raises(RadioError, match="has confirmed no frame for"):
        opened.send(b"x")


def test_at_most_four_frames_are_not_confirmed_and_what_is_urgent_goes_out_all_the_same(port):
    opened, module, _ = port
    assert [opened.send(b"x") for _ in range(6)] == [1, 2, 3, 4, None, None]
    assert opened.send(b"stop", urgent=True) == 5
    module.confirm(2)
    module.confirm(3)
    assert [opened.send(b"x") for _ in range(2)] == [6, None]
    assert module.sent == [1, 2, 3, 4, 5, 6]


def test_a_module_that_confirms_nothing_is_given_up(port):
    opened, _, clock = port
    for _ in range(4):
        opened.send(b"x")
    clock.now += 0.4
    assert opened.send(b"x") is None
    clock.now += 0.2
    with pytest.raises(RadioError, match="has confirmed no frame for"):
        opened.send(b"x")


def test_confirmations_that_are_lost_now_and_then_cost_nothing_but_a_pause(port):
    opened, module, clock = port
    for _ in range(4):
        opened.send(b"x")
    module.confirm(4)
    lost = opened.send(b"x")
    clock.now += 0.1
    assert opened.send(b"x") is None
    clock.now += 0.5
    assert opened.send(b"x") == lost + 1
