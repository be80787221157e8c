"""The radio without hardware: emulated XBee modules, and the air between them.

On a module's serial side a frame is 0x7E, u16 length (high byte first), data, and a checksum that
makes the data's sum 0xFF modulo 256; after the first byte 0x7E, 0x7D, 0x11 and 0x13 are sent as
0x7D and the byte with bit 5 flipped. Source: Digi, XBee/XBee-PRO RF Modules (802.15.4) user guide
90000982, chapter "API operation".
"""

import contextlib
import os
import pty
import tty
from collections.abc import Iterator
from dataclasses import dataclass

from .air import Air, AirSettings, Flight

START, ESCAPE, FLIP = 0x7E, 0x7D, 0x20
_ESCAPED = frozenset((START, ESCAPE, 0x11, 0x13))
LONGEST = 128


def api_frame(data: bytes) -> bytes:
    """Encode a frame with this data as bytes on the serial line."""
    plain = len(data).to_bytes(2, "big") + data + bytes([0xFF - sum(data) % 256])
    line = bytearray([START])
    for byte in plain:
        line += bytes([ESCAPE, byte ^ FLIP]) if byte in _ESCAPED else bytes([byte])
    return bytes(line)


class ApiParser:
    """Finds frames in a stream; other bytes are skipped."""

    def __init__(self) -> None:
        self._plain: bytearray | None = None
        self._escaped = False

    def take(self, stream: bytes) -> Iterator[bytes]:
        """Yield the data of each frame that these bytes complete."""
        for byte in stream:
            if byte == START:
                self._plain, self._escaped = bytearray(), False
            elif self._plain is None:
                continue
            elif byte == ESCAPE:
                self._escaped = True
            else:
                self._plain.append(byte ^ FLIP if self._escaped else byte)
                self._escaped = False
                data = self._finished()
                if data is not None:
                    yield data

    def _finished(self) -> bytes | None:
        """Data of the frame, if it has all its bytes and the right sum."""
        plain = self._plain
        if plain is None or len(plain) < 2:
            return None
        length = int.from_bytes(plain[:2], "big")
        if not 0 < length <= LONGEST:
            self._plain = None
            return None
        if len(plain) < length + 3:
            return None
        self._plain = None
        return bytes(plain[2:-1]) if sum(plain[2:]) % 256 == 0xFF else None


BROADCAST = 0xFFFF
# 64-bit addresses of the emulated modules; Digi's begin with 00:13:A2.
_FIRST_ADDRESS = 0x0013A20040000000

_TX_64, _AT, _AT_QUEUED = 0x00, 0x08, 0x09
_RX_64, _AT_RESPONSE, _TX_STATUS = 0x80, 0x88, 0x89
_OK, _INVALID_COMMAND = 0, 2
_LONGEST_PAYLOAD = 100
_TX_PAYLOAD_TOO_LARGE = 0x74
_TX_NO_ACKNOWLEDGEMENT = 0x01


@dataclass(frozen=True)
class SendRequest:
    """The module was asked to send.

    Attributes:
        frame_id: Id of the request, for its status report; 0 asks for none.
        receiver: Number of a module, None for all.
        payload: What is to be sent.
    """

    frame_id: int
    receiver: int | None
    payload: bytes


class XBeeModule:
    """The module's side of a serial line.

    Args:
        number: 0 to 999; its address follows from it.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self._parser = ApiParser()
        address = (_FIRST_ADDRESS + number).to_bytes(8, "big")
        # An XBee S1 with firmware 10EF, API mode 2, no 16-bit address.
        self._settings = {
            b"AP": b"\x02",
            b"HV": b"\x17\x44",
            b"VR": b"\x10\xef",
            b"SH": address[:4],
            b"SL": address[4:],
            b"NI": f"SIGHTFIELD {number}".encode(),
            b"MY": b"\xff\xfe",
            b"CE": b"\x00",
            b"ID": b"\x33\x32",
            b"CH": b"\x0c",
        }

    def take(self, stream: bytes) -> tuple[bytes, list[SendRequest]]:
        """Take bytes from the serial line; returns immediate answers, and requests to send.

        Args:
            stream: Bytes from the host or processor.
        """
        answers, requests = b"", []
        for data in self._parser.take(stream):
            if data[0] in (_AT, _AT_QUEUED) and len(data) >= 4:
                answers += self._at_answer(data[1], data[2:4], data[4:])
            elif data[0] == _TX_64 and len(data) > 11:
                frame_id, payload = data[1], data[11:]
                if len(payload) > _LONGEST_PAYLOAD:
                    answers += self._status(frame_id, _TX_PAYLOAD_TOO_LARGE)
                    continue
                address = int.from_bytes(data[2:10], "big")
                receiver = None if address == BROADCAST else address - _FIRST_ADDRESS
                requests.append(SendRequest(frame_id, receiver, payload))
        return answers, requests

    def report(self, request: SendRequest, delivered: bool) -> bytes:
        """Status frame of a payload that the module was asked to send.

        Args:
            request: The request to send.
            delivered: Whether the payload was delivered.
        """
        return self._status(request.frame_id, _OK if delivered else _TX_NO_ACKNOWLEDGEMENT)

    def received(self, sender: int, payload: bytes, rssi: int, broadcast: bool) -> bytes:
        """Frame by which the module passes on a payload from another module.

        Args:
            sender: Number of the module that sent it.
            payload: What it sent.
            rssi: Strength [dBm].
            broadcast: Whether it was sent to all.
        """
        address = (_FIRST_ADDRESS + sender).to_bytes(8, "big")
        return api_frame(bytes([_RX_64]) + address + bytes([-rssi, 2 * broadcast]) + payload)

    def _status(self, frame_id: int, status: int) -> bytes:
        return api_frame(bytes([_TX_STATUS, frame_id, status])) if frame_id else b""

    def _at_answer(self, frame_id: int, command: bytes, value: bytes) -> bytes:
        if frame_id == 0:
            return b""
        status, found = _OK, self._settings.get(command.upper(), b"")
        if value or not found:
            status, found = _INVALID_COMMAND, b""
        return api_frame(bytes([_AT_RESPONSE, frame_id]) + command + bytes([status]) + found)


# The work station's module; the robots' are 1 to n.
STATION = 0


class EmulatedRadio:
    """Modules on serial lines, with air between them; a context manager.

    Attributes:
        port: Path of the serial device that the work station opens.
        air: What is on its way; `air.cut` silences it.
        stalled: Whether the work station's module takes nothing from its serial line: a fault.

    Args:
        robots: Number of robots.
        settings: How bad the air is.
        seed: Of what is lost.
    """

    def __init__(self, robots: int, settings: AirSettings, seed: int = 0) -> None:
        self.air = Air(settings, seed)
        self._rssi = settings.rssi
        self._modules = [XBeeModule(number) for number in range(robots + 1)]
        self.port, self.stalled = "", False
        self._line = self._far_end = -1

    def __enter__(self) -> "EmulatedRadio":
        self._line, self._far_end = pty.openpty()
        # Raw bytes, no line editing. The far end stays open, so that the device remains when the
        # program that opened it closes it.
        tty.setraw(self._far_end)
        os.set_blocking(self._line, False)
        self.port = os.ttyname(self._far_end)
        return self

    def __exit__(self, *_: object) -> None:
        for end in (self._line, self._far_end):
            os.close(end)

    def exchange(self, time: float, from_robots: tuple[bytes, ...]) -> list[bytes]:
        """Let the modules send and receive what is due.

        Args:
            time: [s]; never less than before.
            from_robots: Bytes from each robot's processor.

        Returns:
            Bytes to each robot's processor.
        """
        to_line = [b""] * len(self._modules)
        for number, stream in enumerate((self._read(), *from_robots)):
            module = self._modules[number]
            answer, requests = module.take(stream)
            to_line[number] += answer
            for request in requests:
                to_line[number] += module.report(request, self._send(number, request, time))
        for flight in self.air.arrivals(time):
            to_line[flight.receiver] += self._modules[flight.receiver].received(
                flight.sender, flight.payload, self._rssi, flight.broadcast
            )
        self._write(to_line[STATION])
        return to_line[1:]

    def _send(self, sender: int, request: SendRequest, time: float) -> bool:
        """Send a request; returns whether the sender takes it for delivered."""
        if request.receiver is None:
            for each in range(len(self._modules)):
                if each != sender:
                    self.air.send(Flight(sender, each, request.payload, True), time)
            return True
        if not 0 <= request.receiver < len(self._modules):
            return False
        return self.air.send(Flight(sender, request.receiver, request.payload, False), time)

    def _read(self) -> bytes:
        if self.stalled:
            return b""
        # An error means that nothing has come.
        with contextlib.suppress(BlockingIOError):
            return os.read(self._line, 65536)
        return b""

    def _write(self, data: bytes) -> None:
        # If nobody reads and the line is full, bytes are dropped, as on a serial line.
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self._line, data) :]
