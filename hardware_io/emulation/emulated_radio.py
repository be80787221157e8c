"""All modules of a laboratory and the air between them; the work station's is on a pty."""

import contextlib
import os
import pty
import tty

from .air import Air, AirSettings, Flight
from .xbee_module import SendRequest, XBeeModule

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
        # Bytes, not lines. The far end stays open, so that the device outlives who opens it.
        tty.setraw(self._far_end)
        os.set_blocking(self._line, False)
        self.port = os.ttyname(self._far_end)
        return self

    def __exit__(self, *_: object) -> None:
        for end in (self._line, self._far_end):
            os.close(end)

    def exchange(self, time: float, from_robots: tuple[bytes, ...]) -> list[bytes]:
        """Let modules send and receive what is due.

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
        """Whether the sender may think that it was delivered."""
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
        # An error is an empty line.
        with contextlib.suppress(BlockingIOError):
            return os.read(self._line, 65536)
        return b""

    def _write(self, data: bytes) -> None:
        # Nobody reads, and the line is full: a serial line drops bytes then.
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self._line, data) :]
