"""Payloads out and in by an XBee module (802.15.4, API mode), through digi-xbee."""

import contextlib
import logging
import math
import termios
import time
from collections.abc import Callable

from digi.xbee.devices import Raw802Device
from digi.xbee.exception import XBeeException
from digi.xbee.models.address import XBee64BitAddress
from digi.xbee.models.status import TransmitStatus
from digi.xbee.packets.base import XBeeAPIPacket
from digi.xbee.packets.raw import RX64Packet, TX64Packet, TXStatusPacket
from serial import SerialException, SerialTimeoutException

from ..links.robot_link import LinkError

# How long a module may take to answer when it is opened [s].
_PATIENCE = 3
# How long it may take to take a frame [s]: one is on the line for some 20 ms.
_WRITE_TIMEOUT = 0.1
# Frames that it has not confirmed; more would wait in buffers, and arrive when they are old.
_MOST_UNCONFIRMED = 4
# How long it may confirm none of them before it is given up [s].
_SILENCE = 0.5


class RadioError(LinkError):
    """No radio, no module that answers, or a module that went away."""


class XBeePort:
    """A context manager: opened, it sends payloads and hands on what it receives.

    Args:
        port: Serial device, as /dev/ttyUSB0.
        baud_rate: Of the module.
        on_payload: Called with payload, 64-bit address of the sender and RSSI [dBm], in threads
            of digi-xbee's.
        on_status: Called with a frame id and whether the payload was delivered.
    """

    def __init__(
        self,
        port: str,
        baud_rate: int,
        on_payload: Callable[[bytes, bytes, int], None],
        on_status: Callable[[int, bool], None],
    ) -> None:
        self.port = port
        self._baud_rate = baud_rate
        self._on_payload, self._on_status = on_payload, on_status
        self._device: Raw802Device | None = None
        # When each frame that is not confirmed was sent, by its id [s].
        self._unconfirmed: dict[int, float] = {}
        self._confirmed = -math.inf

    def __enter__(self) -> "XBeePort":
        # It reports on stderr what is also raised, where nobody has set up logging.
        logging.getLogger("digi").addHandler(logging.NullHandler())
        device = Raw802Device(self.port, self._baud_rate, _sync_ops_timeout=_PATIENCE)
        try:
            device.open()
        except SerialException as error:
            raise RadioError(f"no radio at {self.port}: {_reason(error)}") from None
        except XBeeException as error:
            device.close()
            raise RadioError(
                f"no 802.15.4 XBee module in API mode answers at {self.port} with "
                f"{self._baud_rate} baud: {_reason(error)}"
            ) from None
        # Nobody waits long on a line that takes nothing.
        if device.serial_port is not None:
            device.serial_port.write_timeout = _WRITE_TIMEOUT
        device.add_packet_received_callback(self._receive)
        self._device = device
        return self

    def __exit__(self, *_: object) -> None:
        device, self._device = self._device, None
        if device is not None:
            device.del_packet_received_callback(self._receive)
            with contextlib.suppress(SerialException, OSError, termios.error):
                if device.serial_port is not None:
                    device.serial_port.reset_output_buffer()
            device.close()

    def send(
        self, payload: bytes, address: bytes | None = None, *, urgent: bool = False
    ) -> int | None:
        """Hand a payload to the module, for one 64-bit address or for all; returns its frame id.

        While four frames are not confirmed by the module nothing is sent that is not urgent, and
        None is returned, as it is where the line did not take the frame in time.

        Raises:
            RadioError: The port is not open, its module has gone, or has taken no frame for half a
                second.
        """
        device = self._device
        if device is None:
            raise RadioError(f"the radio at {self.port} is not open: use it in a `with` statement")
        to = XBee64BitAddress(address) if address else XBee64BitAddress.BROADCAST_ADDRESS
        now = time.monotonic()
        if not (urgent or self._has_room(now)):
            return None
        frame_id = device.get_next_frame_id()
        self._unconfirmed[frame_id] = now
        try:
            device.send_packet(TX64Packet(frame_id, to, 0, rf_data=payload))
        except SerialTimeoutException:
            # Once, it may be this thread that was late; a line that is dead confirms nothing.
            return None
        except (XBeeException, SerialException, OSError) as error:
            raise RadioError(f"the radio at {self.port} has gone: {_reason(error)}") from None
        return frame_id

    def _has_room(self, now: float) -> bool:
        """Whether one more frame may be under way."""
        sent = list(self._unconfirmed.values())
        if len(sent) < _MOST_UNCONFIRMED:
            return True
        if now - max(self._confirmed, min(sent)) <= _SILENCE:
            return False
        if self._confirmed < min(sent):
            raise RadioError(f"the radio at {self.port} has confirmed no frame for {_SILENCE} s")
        # Their confirmations were lost.
        self._unconfirmed.clear()
        return True

    def _receive(self, packet: XBeeAPIPacket) -> None:
        if isinstance(packet, RX64Packet):
            address = bytes(packet.x64bit_source_addr.address)
            self._on_payload(bytes(packet.rf_data or b""), address, -packet.rssi)
        elif isinstance(packet, TXStatusPacket):
            self._confirmed = time.monotonic()
            self._unconfirmed.pop(packet.frame_id, None)
            self._on_status(packet.frame_id, packet.transmit_status == TransmitStatus.SUCCESS)


def _reason(error: Exception) -> str:
    """First line of what an exception says."""
    return (str(error).splitlines() or [type(error).__name__])[0]
