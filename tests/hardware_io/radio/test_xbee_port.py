"""A module that takes nothing holds nobody up."""

from types import SimpleNamespace

import pytest
from digi.xbee.models.status import TransmitStatus
from digi.xbee.packets.raw import TXStatusPacket
from serial import SerialTimeoutException

from sightfield.hardware_io.radio import xbee_port
from sightfield.hardware_io.radio.xbee_port import RadioError, XBeePort


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
    monkeypatch.setattr(xbee_port, "Raw802Device", lambda *_, **__: module)
    monkeypatch.setattr(xbee_port.time, "monotonic", lambda: clock.now)
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
