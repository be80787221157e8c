"""No damaged frame moves a robot, crashes its firmware or changes whom it listens to."""

import subprocess
from pathlib import Path

import numpy as np
import pytest

from sightfield.hardware_io.emulation.emulated_radio import api_frame
from sightfield.hardware_io.emulation.robot_cores import RobotCores
from sightfield.hardware_io.kinds.xbee_frames import Arm, Command, Entry, Form, encode

SESSION = 77


def test_a_million_frames_under_the_sanitizers(compile_firmware):
    """Noise, damaged, stale and strangers' frames, on the portable part of the firmware."""
    sanitizers = ("-O2", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
    fuzz = compile_firmware("fuzz", *sanitizers, Path(__file__).with_name("fuzz.c"))
    done = subprocess.run([fuzz, "1000000", "1"], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert min(map(int, done.stdout.split())) > 100_000


def packet(payload: bytes) -> bytes:
    """What the module says of a payload from the work station."""
    return api_frame(bytes([0x80, *bytes(8), 40, 2]) + payload)


def damaged_packets(rng: np.random.Generator, robot: int) -> bytes:
    """Serial bytes of noise, of damaged and of stale commands at full speed."""
    stream = b""
    for _ in range(20):
        entry = (Entry(robot, 600, 600),)
        fresh = int(rng.integers(100, 30000))
        sequence = int(rng.integers(40000, 65536)) if rng.random() < 0.3 else fresh
        command = Command(
            session=SESSION, sequence=sequence, form=Form.WHEELS, age=0, entries=entry
        )
        payload = bytearray(encode(command))
        way = rng.integers(4)
        if way == 0:
            payload = bytearray(rng.bytes(int(rng.integers(1, 60))))
        elif way == 1 or sequence == fresh:
            at = int(rng.integers(len(payload)))
            payload[at] ^= int(rng.integers(1, 256))
        serial = bytearray(packet(bytes(payload)))
        if way == 2:
            serial[int(rng.integers(len(serial)))] ^= int(rng.integers(1, 256))
        stream += bytes(serial)
    return stream


@pytest.mark.usefixtures("emulator")
def test_ten_thousand_frames_on_the_processors():
    """The same on the whole program in simavr, armed and listening."""
    rng, robots = np.random.default_rng(3), (1, 2, 3, 4)
    starts = np.zeros((4, 3))
    with RobotCores(robots, starts) as cores:
        arm = packet(encode(Arm(session=SESSION, sequence=0)))
        cores.advance(0.1)
        for k in range(4):
            cores.send(k, arm)
        cores.advance(0.1)
        for _ in range(125):
            for k, robot in enumerate(robots):
                cores.send(k, damaged_packets(rng, robot))
            report = cores.advance(0.2)
            assert report.top_power.max() == 0
        assert (report.poses == starts).all()

        # They still listen, to whom and to what they did before.
        for k, robot in enumerate(robots):
            entry = (Entry(robot, 300, 300),)
            command = Command(session=SESSION, sequence=1, form=Form.WHEELS, age=0, entries=entry)
            cores.send(k, packet(encode(command)))
        assert cores.advance(0.1).top_power.min() > 0.2
