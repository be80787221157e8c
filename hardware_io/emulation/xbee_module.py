"""An emulated XBee module (802.15.4): AT commands, requests to send, received packets."""

from dataclasses import dataclass

from .xbee_api import ApiParser, api_frame

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
        frame_id: Of the request, for its report; 0 wants none.
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
        """Bytes from the host or processor: what the module answers at once, and is to send.

        Args:
            stream: The bytes.
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
        """What the module says of a payload it was asked to send.

        Args:
            request: Which.
            delivered: Whether it got there.
        """
        return self._status(request.frame_id, _OK if delivered else _TX_NO_ACKNOWLEDGEMENT)

    def received(self, sender: int, payload: bytes, rssi: int, broadcast: bool) -> bytes:
        """What the module says of a payload from another module.

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
