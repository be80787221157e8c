"""The emulated module speaks as digi-xbee's own packets do."""

from digi.xbee.models.address import XBee64BitAddress
from digi.xbee.models.mode import OperatingMode
from digi.xbee.packets.common import ATCommPacket, ATCommResponsePacket
from digi.xbee.packets.factory import build_frame
from digi.xbee.packets.raw import RX64Packet, TX64Packet, TXStatusPacket
from hypothesis import given
from hypothesis import strategies as st

from sightfield.hardware_io.emulation.emulated_radio import (
    ApiParser,
    SendRequest,
    XBeeModule,
    api_frame,
)

payloads = st.binary(min_size=1, max_size=100)


def packet_of(line: bytes):
    """The packet that digi-xbee makes of bytes on the line."""
    unescaped, escaped = bytearray(line[:1]), False
    for byte in line[1:]:
        if byte == 0x7D:
            escaped = True
        else:
            unescaped.append(byte ^ 0x20 if escaped else byte)
            escaped = False
    return build_frame(unescaped, OperatingMode.ESCAPED_API_MODE)


@given(st.lists(st.tuples(st.binary(max_size=5), st.binary(min_size=1, max_size=120)), max_size=5))
def test_frames_are_found_between_other_bytes(parts):
    line = b"".join(noise.replace(b"~", b"") + api_frame(data) for noise, data in parts)
    assert list(ApiParser().take(line)) == [data for _, data in parts]


@given(st.binary(min_size=1, max_size=100), st.integers(1, 30))
def test_a_stream_may_come_in_any_pieces(data, size):
    line, parser = api_frame(data), ApiParser()
    pieces = [line[k : k + size] for k in range(0, len(line), size)]
    assert [found for piece in pieces for found in parser.take(piece)] == [data]


@given(payload=payloads, frame_id=st.integers(0, 255), robot=st.integers(0, 9))
def test_it_reads_digis_requests_to_send(payload, frame_id, robot):
    address = XBee64BitAddress((0x0013A20040000000 + robot).to_bytes(8, "big"))
    line = TX64Packet(frame_id, address, 0, rf_data=payload).output(escaped=True)
    assert XBeeModule(0).take(bytes(line)) == (b"", [SendRequest(frame_id, robot, payload)])


def test_to_all_is_to_nobody_in_particular():
    line = TX64Packet(1, XBee64BitAddress.BROADCAST_ADDRESS, 0, rf_data=b"x").output(escaped=True)
    (request,) = XBeeModule(0).take(bytes(line))[1]
    assert request.receiver is None


@given(payload=payloads, number=st.integers(0, 999), rssi=st.integers(-255, 0), all_=st.booleans())
def test_digi_reads_what_it_has_received(payload, number, rssi, all_):
    packet = packet_of(XBeeModule(1).received(number, payload, rssi, all_))
    assert isinstance(packet, RX64Packet)
    assert bytes(packet.rf_data) == payload
    assert packet.rssi == -rssi
    assert packet.is_broadcast() == all_
    expected = (0x0013A20040000000 + number).to_bytes(8, "big")
    assert bytes(packet.x64bit_source_addr.address) == expected


def test_digi_reads_its_status():
    module = XBeeModule(0)
    for delivered, code in ((True, 0), (False, 1)):
        packet = packet_of(module.report(SendRequest(7, 2, b"x"), delivered))
        assert isinstance(packet, TXStatusPacket)
        assert (packet.frame_id, packet.transmit_status.code) == (7, code)
    assert module.report(SendRequest(0, 2, b"x"), True) == b""


def test_it_answers_what_digi_asks_and_refuses_the_rest():
    module = XBeeModule(5)
    for command, value in (("AP", b"\x02"), ("SL", b"\x40\0\0\x05"), ("NI", b"SIGHTFIELD 5")):
        line = ATCommPacket(3, command).output(escaped=True)
        packet = packet_of(module.take(bytes(line))[0])
        assert isinstance(packet, ATCommResponsePacket)
        assert (packet.command, bytes(packet.command_value)) == (command, value)
    for refused in (ATCommPacket(3, "ZZ"), ATCommPacket(3, "NI", b"other")):
        packet = packet_of(module.take(bytes(refused.output(escaped=True)))[0])
        assert packet.status.code == 2


def test_a_payload_that_is_too_long_is_refused():
    line = api_frame(bytes([0, 9, *bytes(6), 0xFF, 0xFF, 0]) + bytes(101))
    answer, requests = XBeeModule(0).take(line)
    assert requests == []
    assert packet_of(answer).transmit_status.code == 0x74
