"""Several robots' processors in simavr, with their wheels: one process, in lockstep.

Firmware and runner are rebuilt only when their sources change.
"""

import contextlib
import hashlib
import os
import select
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...diagrams.outputs import cache_folder
from ...systems.numerics.errors import SightfieldError, require, require_finite
from ..links.robot_link import require_robots
from .robot_body import RobotBody, sensor_voltages

FIRMWARE = Path(__file__).resolve().parents[1] / "firmware"
RUNNER = Path(__file__).resolve().parent
RUNNER_SOURCES = ("runner.c", "board.c", "wheels_model.c")

# What a build needs, and the Debian packages that have it.
_PACKAGES = {
    "avr-gcc": "gcc-avr avr-libc",
    "make": "make",
    "cc": "gcc libc6-dev",
    "libsimavr": "libsimavr-dev",
}


class ToolchainError(SightfieldError):
    """The firmware or the runner cannot be built; the message says what is wrong."""


class MissingTool(ToolchainError):
    """A program or library is not installed; the message says what to type."""


def firmware_path() -> Path:
    """The robots' program, robot.elf, built if need be.

    Raises:
        MissingTool: avr-gcc or make is not installed.
        ToolchainError: They refuse.
    """
    return _built(FIRMWARE, "robot.elf", ["make", "--silent", "OUT={out}"], ("avr-gcc", "make"))


def runner_path() -> Path:
    """The program that runs firmware in simavr, built if need be.

    Raises:
        MissingTool: A compiler or libsimavr is not installed.
        ToolchainError: The compiler refuses.
    """
    command = ["cc", "-O2", "-Wall", "-Wextra", "-Werror", "-o", "{out}/runner"]
    command += [*RUNNER_SOURCES, "-lsimavr", "-lm"]
    return _built(RUNNER, "runner", command, ("cc", "libsimavr"))


def _has(tool: str) -> bool:
    if tool != "libsimavr":
        return shutil.which(tool) is not None
    probe = ["cc", "-fsyntax-only", "-xc", "-"]
    source = b"#include <simavr/sim_avr.h>\n"
    done = subprocess.run(probe, input=source, capture_output=True, start_new_session=True)
    return done.returncode == 0


def _built(sources: Path, name: str, command: list[str], tools: tuple[str, ...]) -> Path:
    """Path of a product in the cache, under the digest of the sources it is made from."""
    digest = hashlib.sha256(repr(command).encode())
    for file in sorted(sources.rglob("*")):
        if file.suffix in (".c", ".h") or file.name == "Makefile":
            digest.update(file.relative_to(sources).as_posix().encode() + b"\0" + file.read_bytes())
    product = cache_folder() / digest.hexdigest()[:16] / name
    if product.is_file():
        return product
    for tool in tools:
        if not _has(tool):
            packages = _PACKAGES[tool]
            raise MissingTool(f"{tool} is not installed: sudo apt-get install {packages}")
    product.parent.mkdir(parents=True, exist_ok=True)
    # Build in a temporary folder and move the product: two processes may build at once.
    with tempfile.TemporaryDirectory(dir=product.parent) as folder:
        words = [word.format(out=folder) for word in command]
        done = subprocess.run(
            words,
            cwd=sources,
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            start_new_session=True,
        )
        if done.returncode != 0:
            said = done.stderr.strip().splitlines()
            reasons = [line for line in said if "error" in line] or said or ["no reason given"]
            raise ToolchainError(f"{name} cannot be built: {reasons[0]}")
        os.replace(Path(folder) / name, product)
    return product


_ANSWER = struct.Struct("=10dH")
# Longest slice of time for which the runner surely buffers what robots send [s].
_SLICE = 0.1
# Time-out for the runner's answer; a slice takes much less, even on a busy machine [s].
_PATIENCE = 5.0


class EmulationError(SightfieldError):
    """The emulator has ended, or a robot's processor has."""


@dataclass(frozen=True)
class CoresReport:
    """The robots at one time.

    Attributes:
        time: Time since the start [s].
        poses: Shape (n, 3) [m], [m], [rad]; headings are not wrapped.
        wheel_speeds: Left and right, shape (n, 2) [m/s].
        top_power: Largest power of a motor since the report before, shape (n,), 0 to 1.
        still_since: When the wheels came to rest, shape (n,) [s]; infinite while one turns.
        unpowered_since: When the motors were cut, shape (n,) [s]; infinite while one has power.
        lit: Whether each robot's lamp is lit, shape (n,).
        serial: Bytes that each robot has sent to its radio module since the report before.
    """

    time: float
    poses: np.ndarray
    wheel_speeds: np.ndarray
    top_power: np.ndarray
    still_since: np.ndarray
    unpowered_since: np.ndarray
    lit: np.ndarray
    serial: tuple[bytes, ...]


class RobotCores:
    """The real firmware on n emulated boards; a context manager.

    Time passes only in `advance`, and the same calls give the same reports.

    Args:
        robots: Numbers of the robots, in their EEPROMs.
        starts: Start poses, shape (n, 3) [m], [m], [rad].
        body: Body of all robots.

    Raises:
        InvalidInput: An argument is out of its range.
        ToolchainError: Firmware or runner cannot be built.
    """

    def __init__(
        self, robots: Sequence[int], starts: np.ndarray, *, body: RobotBody | None = None
    ) -> None:
        self.robots = require_robots(robots)
        self.body = body or RobotBody()
        self._starts = np.asarray(starts, dtype=float)
        count = len(self.robots)
        require(count <= 32, "robots", "be at most 32", count)
        require(self._starts.shape == (count, 3), "starts", f"have shape ({count}, 3)", starts)
        require(bool(np.isfinite(self._starts).all()), "starts", "be finite", starts)
        self._time = 0.0
        self._process: subprocess.Popen[bytes] | None = None
        # What the runner is yet to be told.
        self._requests = bytearray()

    def __enter__(self) -> "RobotCores":
        command: list[str | Path] = [runner_path(), firmware_path()]
        # A file: nobody reads it while it runs, and a pipe could fill up.
        self._said = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
            # Ctrl-C is for the controller, which still needs this process to stop its robots.
            start_new_session=True,
        )
        body = self.body
        parameters = (body.track_width, body.counts_per_metre, body.top_speed)
        motor = (body.friction, body.time_constant, body.coasting_constant)
        self._write(b"b" + struct.pack("=6d", *parameters, *motor))
        for robot, start in zip(self.robots, self._starts, strict=True):
            self._write(b"r" + struct.pack("=B3d", robot, *start))
        far = np.full(4, 10.0)
        for k in range(len(self.robots)):
            self.set_sensors(k, far, body.battery)
        return self

    def __exit__(self, *_: object) -> None:
        if self._process is not None:
            # A process that hangs reads nothing, and so would not end by itself.
            self._process.kill()
            for stream in (self._process.stdin, self._process.stdout, self._said):
                # A process that has died may have left requests unread.
                with contextlib.suppress(BrokenPipeError):
                    if stream is not None:
                        stream.close()
            self._process.wait()
            self._process = None

    @property
    def time(self) -> float:
        """Time simulated so far [s]."""
        return self._time

    def send(self, k: int, data: bytes) -> None:
        """Have robot k's radio module send bytes to its processor, at 57600 baud.

        Args:
            k: Number of the robot.
            data: The bytes.
        """
        for start in range(0, len(data), 2048):
            part = data[start : start + 2048]
            self._write(b"u" + struct.pack("=BH", k, len(part)) + part)

    def set_sensors(self, k: int, ranges: np.ndarray, battery: float) -> None:
        """Set robot k's free infrared ranges, shape (4,) [m], and its battery voltage [V]."""
        self._write(b"v" + struct.pack("=B5d", k, *sensor_voltages(ranges, battery)))

    def place(self, k: int, pose: np.ndarray) -> None:
        """Put robot k to a pose, shape (3,) [m], [m], [rad]."""
        self._write(b"p" + struct.pack("=B3d", k, *pose))

    def set_encoder(self, k: int, wheel: int, sense: int) -> None:
        """Set in which direction an encoder of robot k counts: a fault.

        Args:
            k: Number of the robot.
            wheel: 0 for the left, 1 for the right.
            sense: 1 the wheel's way, -1 the other way, 0 nothing.
        """
        self._write(b"e" + struct.pack("=BBb", k, wheel, sense))

    def jump(self, k: int, address: int) -> None:
        """Make robot k's processor jump to an address, with interrupts off: a fault."""
        self._write(b"j" + struct.pack("=BI", k, address))

    def advance(self, duration: float) -> CoresReport:
        """Let time pass [s], and report.

        Args:
            duration: How long [s].

        Raises:
            InvalidInput: Time would run backwards.
            EmulationError: The runner or a processor has died, or the runner does not answer.
        """
        require_finite("duration", duration)
        require(duration >= 0, "duration", "be zero or positive", duration)
        end = self._time + duration
        serial = [b""] * len(self.robots)
        power = np.zeros(len(self.robots))
        while True:
            self._time = min(end, self._time + _SLICE)
            numbers = self._step(serial)
            power = np.maximum(power, numbers[:, 5])
            if self._time >= end:
                break
        return CoresReport(
            time=self._time,
            poses=numbers[:, :3],
            wheel_speeds=numbers[:, 3:5],
            top_power=power,
            still_since=numbers[:, 6],
            unpowered_since=numbers[:, 7],
            lit=numbers[:, 8] > 0,
            serial=tuple(serial),
        )

    def _step(self, serial: list[bytes]) -> np.ndarray:
        """Advance to `time`; append sent bytes to `serial`, return other values, shape (n, 10)."""
        self._write(b"a" + struct.pack("=d", self._time), flush=True)
        rows = []
        for k, robot in enumerate(self.robots):
            *numbers, count = _ANSWER.unpack(self._read(_ANSWER.size))
            serial[k] += self._read(count)
            rows.append(numbers)
            if not numbers[9]:
                raise EmulationError(f"the processor of robot {robot} died at {self._time:.3f} s")
        return np.array(rows)

    def _write(self, data: bytes, *, flush: bool = False) -> None:
        if self._process is None or self._process.stdin is None:
            raise EmulationError("the emulator is not running: use it in a `with` statement")
        self._requests += data
        if not flush:
            return
        pipe, waiting = self._process.stdin.fileno(), memoryview(bytes(self._requests))
        self._requests.clear()
        try:
            while waiting:
                if not select.select([], [pipe], [], _PATIENCE)[1]:
                    raise self._silent()
                waiting = waiting[os.write(pipe, waiting[: select.PIPE_BUF]) :]
        except BrokenPipeError:
            raise self._ended() from None

    def _read(self, count: int) -> bytes:
        assert self._process is not None
        assert self._process.stdout is not None
        pipe, data = self._process.stdout.fileno(), b""
        while len(data) < count:
            if not select.select([pipe], [], [], _PATIENCE)[0]:
                raise self._silent()
            part = os.read(pipe, count - len(data))
            if not part:
                raise self._ended()
            data += part
        return data

    def _silent(self) -> EmulationError:
        return EmulationError(f"the emulator has not answered for {_PATIENCE:g} s")

    def _ended(self) -> EmulationError:
        self._said.seek(0)
        said = self._said.read().decode(errors="replace").strip().splitlines()
        return EmulationError(f"the emulator has ended: {said[-1] if said else 'no reason given'}")
